"""The direction of imports, as docs/architecture.md has it, held over every file of the package."""

from __future__ import annotations

import ast
import functools
import re
from pathlib import Path
from typing import NamedTuple

from tests.package_trees import PACKAGE, package_trees
from tests.test_words import STYLE, unwanted

# GPUs run kernels; the tape has intrinsic functions.
KERNELS = {"kernel", "kernels"}
FOR_GPUS = re.compile(r"gpu|_device\.py$|c/runtime/kernel\.h$")
ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "architecture.md"


def _section(title: str) -> str:
    text = PAGE.read_text(encoding="utf-8")
    return text.split(f"## {title}\n")[1].split("\n## ")[0]


def layers() -> dict[str, int]:
    """Packages and modules of the first level, by the number of their row in the table."""
    rows = re.findall(r"^\| (\d+) \| ([^|]+) \|", _section("Who may import whom"), re.MULTILINE)
    return {name: int(number) for number, names in rows for name in re.findall(r"`(\w+)`", names)}


def upward() -> set[str]:
    """Files that may import what comes after them, inside functions."""
    return set(re.findall(r"^- `([\w/.]+)`", _section("Who may import whom"), re.MULTILINE))


class File(NamedTuple):
    """Path in the package, name of the first level, statements at the top, what tests look at (imports, attributes, `if`), and
    the words of its names."""

    path: str
    own: str
    top: list[ast.stmt]
    nodes: list[ast.AST]
    words: set[str]


@functools.cache
def files() -> list[File]:
    return [File(path, path.split("/")[0].removesuffix(".py"), tree.body, *looked_through(tree))
            for path, tree in package_trees().items() if path not in ("__init__.py", "__main__.py")]


# Attributes that hold the name of a kind of node.
NAMED = {ast.Name: "id", ast.arg: "arg", ast.FunctionDef: "name", ast.ClassDef: "name"}


def looked_through(tree: ast.Module) -> tuple[list[ast.AST], set[str]]:
    """Imports, attributes and `if` of a file, and the words of the names that it gives to variables, arguments, functions and
    classes. All nodes of the package are more than a million: each is seen once, and where it has no others inside, not asked."""
    nodes: list[ast.AST] = []
    names: set[str] = set()
    rest: list[ast.AST] = [tree]
    while rest:
        node = rest.pop()
        kind = type(node)
        if kind in NAMED:
            names.add(getattr(node, NAMED[kind]))
            if kind is ast.Name:
                continue
        elif kind in (ast.Import, ast.ImportFrom, ast.Attribute, ast.If):
            nodes.append(node)
        elif kind is ast.Constant:
            continue
        rest += ast.iter_child_nodes(node)
    return nodes, {word for name in names for word in name.lower().split("_")}


def imported(node: ast.AST) -> list[str]:
    """Names of the first level that a statement imports; nothing for `import symdyn` itself."""
    if isinstance(node, ast.ImportFrom) and node.module == "symdyn":
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("symdyn."):
        return [(node.module or "").split(".")[1]]
    if isinstance(node, ast.Import):
        return [alias.name.split(".")[1] for alias in node.names if alias.name.startswith("symdyn.")]
    return []


def for_types(nodes: list[ast.AST]) -> set[ast.AST]:
    """Statements that only type checkers read."""
    guards = [n for n in nodes if isinstance(n, ast.If) and isinstance(n.test, ast.Name) and n.test.id == "TYPE_CHECKING"]
    return {inner for guard in guards for inner in ast.walk(guard)}


def test_every_package_has_one_row() -> None:
    here = {p.name.removesuffix(".py") for p in PACKAGE.iterdir() if p.suffix == ".py" or (p / "__init__.py").is_file()}
    assert set(layers()) == here - {"__init__", "__main__", "templates"}


def test_every_folder_and_module_is_explained() -> None:
    """The tables under Folders name every folder of the package, by its path, and every module outside of folders."""
    rows = re.findall(r"^\| [^|]+ \| .+ \|$", _section("Folders"), re.MULTILINE)
    named = {name for row in rows for name in re.findall(r"`([\w/.]+)`", row)}
    modules = {path.name for path in PACKAGE.glob("*.py")} - {"__init__.py", "__main__.py"}
    folders = {f"{path.relative_to(PACKAGE).as_posix()}/" for path in PACKAGE.rglob("*") if path.is_dir()
               and path.name != "templates" and any(one.is_file() and one.suffix != ".pyc" for one in path.iterdir())}
    assert {"cli/", "backend/methods/"} <= folders and {"facade.py", "shown.py"} <= modules
    assert (folders | modules) - named == set()
    first = {name for row in rows for name in re.findall(r"`(\w+\.py)`", row.split(" | ")[0])}
    assert first == modules


def test_imports_go_down_the_table() -> None:
    """At the top of a file only what stands in an earlier row; inside functions of the listed files also what comes later."""
    rows, allowed = layers(), upward()
    wrong, used = [], set()
    for path, own, statements, nodes, _ in files():
        top, types = set(statements), for_types(nodes)
        for node in nodes:
            for name in imported(node) if node not in types else ():
                if name != own and rows[name] >= rows[own]:
                    used.add(path)
                    if node in top or path not in allowed:
                        wrong.append(f"{path}, line {node.lineno}: {name}")  # type: ignore[attr-defined]
    assert not wrong, "\n".join(wrong)
    assert allowed == used, allowed - used


def test_public_names_are_for_what_stands_on_them() -> None:
    """Up to the stress tests, the package itself is imported for its version and its folder alone."""
    rows = layers()
    for path, own, _, nodes, _ in files():
        if rows[own] <= rows["comparison"]:
            names = [n for n in nodes if isinstance(n, ast.Attribute) and isinstance(n.value, ast.Name)
                     and n.value.id in ("symdyn", "sd")]
            assert all(n.attr in ("__version__", "__file__") for n in names), path


def test_only_the_command_line_runs_the_laboratory() -> None:
    outside = [f"{path} imports symdyn.{name}" for path, own, _, nodes, _ in files() if own not in ("lab", "cli")
               for node in nodes for name in imported(node) if name == "lab"]
    assert not outside


def test_the_recursions_of_the_lecture_are_no_source_of_code() -> None:
    """They print pages, and verification compares the lean ones with them."""
    readers = {path for path, _, _, nodes, _ in files() for node in nodes if isinstance(node, ast.ImportFrom)
               and (node.module or "").startswith("symdyn.formulation.textbook") and "formulation/textbook" not in path}
    assert readers == {"formulation/trees/recursive.py"}


@functools.cache
def not_names() -> set[str]:
    """Words of the first two tables of docs/style.md."""
    style = STYLE.read_text(encoding="utf-8")
    return {*unwanted(style), *unwanted(style, "not in names")}


def wrong_words(path: str, words: set[str]) -> set[str]:
    return words & (not_names() - KERNELS if FOR_GPUS.search(path) else not_names())


def test_names_have_the_words_of_the_field() -> None:
    assert {file.path: wrong for file in files() if (wrong := wrong_words(file.path, file.words))} == {}
    assert looked_through(ast.parse("def told(beside):\n    is_locking = beside")) == ([], {"told", "beside", "is", "locking"})
    assert wrong_words("tape/intrinsics.py", {"kernel", "painter", "of"}) == {"kernel", "painter"}
    assert wrong_words("runtime/gpu/device.py", {"kernel", "painter", "of"}) == {"painter"}


def names_in_c(text: str) -> set[str]:
    """Names in C, or in a template of it, without comments and files."""
    return set(re.findall(r"[A-Za-z_]\w*", re.sub(r"//.*|#include .*", "", text)))


def functions_in_c(text: str) -> set[str]:
    """The functions, and macros like functions, that a file defines."""
    begun = r"^(?:__attribute__\(\(\w+\)\) )?(?:static|SYMDYN_LINKED|#define)[\w\s*]*?\b(symdyn_\w+)\((?!.*;$)"
    return set(re.findall(begun, text, re.MULTILINE))


def test_names_in_c_have_the_words_of_the_field() -> None:
    paths = [path for path in (ROOT / "templates").rglob("*") if path.is_file() and re.search(r"\.[ch](\.jinja)?$", path.name)]
    assert len(paths) > 70 and names_in_c("int slope_beside;  // told\n") == {"int", "slope_beside"}
    wrong = {(path.name, name) for path in paths for name in names_in_c(path.read_text(encoding="utf-8")) - {"SYMDYN_KERNEL"}
             if not_names() & set(name.lower().split("_"))}
    assert wrong == set()


# Functions that each method of integration, or each kind of matrices, defines.
OF_METHODS = {"symdyn_try", "symdyn_between", "symdyn_begin", "symdyn_ahead", "symdyn_newton_matrix", "symdyn_newton_solve"}


def test_functions_in_c_have_one_meaning() -> None:
    """A name is defined in one file of the runtime."""
    text = "static int symdyn_a(int b) {\nstatic int symdyn_b(void);\n#define symdyn_c(d) (d)\n"
    assert functions_in_c(text) == {"symdyn_a", "symdyn_c"}
    where: dict[str, list[str]] = {}
    for path in sorted((ROOT / "templates" / "c" / "runtime").glob("*.[ch]")):
        for name in functions_in_c(path.read_text(encoding="utf-8")):
            where.setdefault(name, []).append(path.name)
    assert len(where) > 200
    assert {name: files for name, files in where.items() if len(files) > 1 and name not in OF_METHODS} == {}


def test_names_of_files_have_the_words_of_the_field() -> None:
    paths = [path.relative_to(ROOT).as_posix() for folder in ("symdyn", "templates", "tests", "docs", "notebooks")
             for path in (ROOT / folder).rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    assert "tests/test_architecture.py" in paths
    assert [path for path in paths if wrong_words(path, set(re.split(r"[/_.]", path.lower())))] == []
