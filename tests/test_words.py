"""Spelling, and the words that docs/style.md does not want, in pages, notebooks, docstrings, comments, messages and templates."""

from __future__ import annotations

import ast
import functools
import inspect
import io
import re
import subprocess
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

import symdyn as sd
from tests.test_examples import PUBLIC

ROOT = Path(__file__).parents[1]
STYLE = ROOT / "docs" / "style.md"
CHANGELOG = ROOT / "CHANGELOG.md"
PAGES = [*sorted((ROOT / "docs").rglob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md",
         *sorted((ROOT / "notebooks").glob("*.py"))]


TEMPLATES = [path for folder in ("templates", "symdyn") for path in sorted((ROOT / folder).rglob("*"))
             if path.suffix in {".jinja", ".h", ".c", ".cpp", ".hpp", ".js", ".md", ".toml"}]


def unwanted(style: str, title: str = "not") -> dict[str, str]:
    """The words of the table with a title -> what to write in their place."""
    rows = style.partition(f"\n| {title} | but |\n| --- | --- |\n")[2].partition("\n\n")[0].splitlines()
    cells = [row.strip("| ").split(" | ") for row in rows]
    return {word: right for left, right in cells for word in left.split(", ")}


@functools.cache
def prose(path: Path) -> list[tuple[int, str]]:
    """Lines of text with their numbers: of a page without its code, of the changelog its newest section, of a notebook its
    markdown; of a module its docstrings, comments, messages and names of tests; of other files all."""
    return list(_prose(path))


def _prose(path: Path) -> Iterator[tuple[int, str]]:
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    if path.name == CHANGELOG.name:
        lines = "\n## ".join(text.split("\n## ")[:2]).splitlines()
    if path.suffix == ".md":
        yield from _outside_code(lines)
    elif path.is_relative_to(ROOT / "notebooks"):
        yield from ((k, line) for k, line in enumerate(lines, 1) if line.startswith("# "))
    elif path.suffix == ".py":
        yield from sorted(_of_module(text))
    else:
        yield from enumerate(lines, 1)


def _of_module(text: str) -> Iterator[tuple[int, str]]:
    """Messages are texts of more than one word that are no docstrings; those of tests are data."""
    tests = re.search("^def test_", text, re.MULTILINE) is not None
    tree, lines, documented = ast.parse(text), text.splitlines(), set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
            first = node.body[0]
            documented |= set(ast.walk(first))
            yield from ((k, lines[k - 1]) for k in range(first.lineno, (first.end_lineno or 0) + 1))
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            yield node.lineno, node.name.replace("_", " ")
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in documented and not tests:
            yield from ((node.lineno, line) for line in node.value.splitlines() if " " in line)
    for k, line in enumerate(lines, 1):
        if "#" in line:
            yield from _comment(k, line)


def _comment(number: int, line: str) -> Iterator[tuple[int, str]]:
    """The comment of a line of Python by itself; a line within a text of several may be none, and is then read as if it were."""
    try:
        tokens = list(tokenize.generate_tokens(io.StringIO(line.strip() + "\n").readline))
    except (tokenize.TokenError, SyntaxError):
        yield number, line.partition("#")[2]
        return
    yield from ((number, token.string) for token in tokens if token.type == tokenize.COMMENT)


def _outside_code(lines: list[str]) -> Iterator[tuple[int, str]]:
    code = False
    for k, line in enumerate(lines, 1):
        if line.startswith("```"):
            code = not code
        elif not code:
            yield k, line


def found(paths: list[Path], words: dict[str, str]) -> list[str]:
    pattern = re.compile(rf"\b({'|'.join(map(re.escape, words))})\b", re.IGNORECASE)
    return [f"{path.name}:{k}: {match[0]!r}; write: {words[match[0].lower()]}" for path in paths if path != STYLE
            for k, line in prose(path) for match in pattern.finditer(re.sub(r"`[^`]*`", "", line))]


# Sentences that begin so have a clause for a subject, or their subject late; questions may.
BEGINNINGS = re.compile(r"(?:What|Whatever|Whoever|Which|Whichever|How|Of|That which|(?:With|By|On|At|To|For) (?:which|what))\b")
SPLIT = re.compile(r"(?<=[.!?:])\s+(?=[A-Z`*\[])|\s*\|\s*")
TWICE = re.compile(r"\b([a-z]+) \1\b")


def paragraphs(path: Path) -> Iterator[tuple[int, str]]:
    """Paragraphs, items of lists and rows of tables, each with its first line; headings are left out."""
    notebook = path.suffix == ".py" and path.is_relative_to(ROOT / "notebooks")
    begun, last, text = 0, 0, ""
    for k, line in prose(path):
        stripped = line.removeprefix("#" if notebook else "").strip()
        if text and (k != last + 1 or not stripped or re.match(r"[-*|#] ?|\d+\. |%%", stripped)):
            yield begun, text
            text = ""
        if stripped and not stripped.startswith(("#", "%%")):
            begun, text = (begun, f"{text} {stripped}") if text else (k, re.sub("^[-*] ", "", stripped))
        last = k
    if text:
        yield begun, text


def clumsy(path: Path) -> list[str]:
    """Sentences that begin with a clause in place of a subject, or have a word twice."""
    return [f"{path.name}:{k}: {one[:60]}" for k, paragraph in paragraphs(path) for one in sentences(paragraph)
            if begins_late(one) or TWICE.search(one)]


def sentences(paragraph: str) -> list[str]:
    return [one.strip(" -*") for one in SPLIT.split(paragraph)]


def begins_late(sentence: str) -> bool:
    return BEGINNINGS.match(sentence) is not None and not re.match(r"[^.!?]*\?", sentence)


def test_sentences_begin_with_their_subject() -> None:
    """As docs/style.md asks; and no word stands twice."""
    assert [line for page in PAGES if page != STYLE for line in clumsy(page)] == []


def test_public_docstrings_begin_sentences_with_their_subject() -> None:
    """Those of the reference, without their examples."""
    public = {**PUBLIC, **{name: getattr(sd, name) for name in sd.__all__}}
    texts = {name: (inspect.getdoc(thing) or "").partition(">>>")[0] for name, thing in public.items()}
    assert [(name, one) for name, text in texts.items() for one in sentences(" ".join(text.split())) if begins_late(one)] == []


def test_public_docstrings_begin_with_a_verb_or_a_noun() -> None:
    public = {**PUBLIC, **{name: getattr(sd, name) for name in sd.__all__}}
    firsts = {name: (inspect.getdoc(thing) or "").partition(" ")[0] for name, thing in public.items()}
    assert len(firsts) > 500
    assert {name: first for name, first in firsts.items() if first in {"Where", "Whether", "How", "Which", "What"}} == {}


# Marks of comments and of docstrings, behind which sentences begin; a sentence may also begin behind the end of another one.
MARKS = re.compile(r"^.*?(?://+[/!<]*|/\*+|\{#-?|#:?|%|\"\"\"|^\s*[*-])\s*(?=[A-Z])")
BEHIND = re.compile(r"(?:(?<=[.!?:]\s)|(?<=[.!?:]\s\s))(?=[A-Z])")


def late(path: Path) -> list[str]:
    """Sentences of a module, a template or a file of C that begin with a clause for a subject: at the beginning of a line,
    of a comment or of a docstring, or behind another sentence."""
    lines, result = prose(path), []
    for index, (k, line) in enumerate(lines):
        starts = {len(line) - len(line.lstrip()), *(match.end() for match in [MARKS.match(line)] if match),
                  *(match.end() for match in BEHIND.finditer(line))}
        behind = " ".join(text.strip(" #/*") for _, text in lines[index + 1:index + 4])
        result += [f"{path.name}:{k}: {line[start:start + 60]}" for start in sorted(starts)
                   if begins_late(f"{line[start:]} {behind}")]
    return result


ROOMS = sorted(path.name for path in (ROOT / "symdyn").iterdir() if any(path.rglob("*.py")))


@pytest.mark.parametrize("folder", ROOMS)
def test_modules_begin_sentences_with_their_subject(folder: str) -> None:
    """In docstrings, comments and messages."""
    assert [line for path in sorted((ROOT / "symdyn" / folder).rglob("*.py")) for line in late(path)] == []


def test_other_texts_begin_sentences_with_their_subject() -> None:
    """Those of modules outside of packages, of tests, of extensions of the site, of templates and C, and of the changelog."""
    modules = [*(ROOT / "symdyn").glob("*.py"), *(ROOT / "tests").rglob("*.py"), *(ROOT / "docs").rglob("*.py")]
    assert [line for path in [*sorted(modules), *TEMPLATES, CHANGELOG] if path != Path(__file__) for line in late(path)] == []


def test_the_readme_of_templates_begins_sentences_with_their_subject() -> None:
    assert clumsy(ROOT / "templates" / "README.md") == []


def test_a_late_subject_is_found(tmp_path: Path) -> None:
    """In a docstring, a comment and a message of a module, in a comment of C; not in questions, code and within sentences."""
    texts = {"module.py": '"""Mass. Of two the\nfirst."""\nWhat = 1  # What is left\nraise Error("none: What is zero is left")\n',
             "asked.py": '"""What is it\nfor?"""\nprint("Which one? It shows what is left")  # of two\n',
             "run.h": "// Rows. How many there are.\nint n;  // Whatever\n"}
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    assert [line for name in texts for line in late(tmp_path / name)] == [
        "module.py:1: Of two the", "module.py:3: What is left", "module.py:4: What is zero is left",
        "run.h:1: How many there are.", "run.h:2: Whatever"]


def test_a_clumsy_sentence_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    text = "# What it is\n\nA mass. What is left is\nzero. What is it?\n\n- Of two the first is taken.\n\nIt is is so.\n"
    page.write_text(text, encoding="utf-8")
    expected = ["page.md:3: What is left is zero.", "page.md:6: Of two the first is taken.", "page.md:8: It is is so."]
    assert clumsy(page) == expected


def test_pages_and_notebooks_use_the_words_of_the_field() -> None:
    assert found([*PAGES, CHANGELOG], unwanted(STYLE.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize("folder", ["symdyn", "tests"])
def test_modules_use_the_words_of_the_field(folder: str) -> None:
    """In docstrings, comments and messages; in names of tests."""
    assert found(sorted((ROOT / folder).rglob("*.py")), unwanted(STYLE.read_text(encoding="utf-8"))) == []


def test_templates_use_the_words_of_the_field() -> None:
    assert found(TEMPLATES, unwanted(STYLE.read_text(encoding="utf-8"))) == []


def test_tables_of_words() -> None:
    style = ("Text\n\n| not | but |\n| --- | --- |\n| a, b | c |\n| d | e, f |\n\n"
             "| not in names | but |\n| --- | --- |\n| g | h |\n")
    assert unwanted(style) == {"a": "c", "b": "c", "d": "e, f"} and unwanted(style, "not in names") == {"g": "h"}


def test_an_unwanted_word_is_found(tmp_path: Path) -> None:
    """In a page outside of code, in a docstring, a comment and a message of a module, in the name of a test but not in its data,
    in a template, and in the newest section of a changelog."""
    texts = {"page.md": "A value told\n\n```python\ntold = 1\n```\nand `told`.\n",
             "module.py": '"""Begins anew."""\ntold = 1  # was told\nraise Error(f"{told} is told")\n',
             "test_one.py": 'def test_it_is_told():\n    run("it told")\n',
             "run.h": "// Begin anew.\n", "CHANGELOG.md": "# Changes\n\n## 2\n\ntold\n\n## 1\n\nanew\n"}
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    assert found([tmp_path / name for name in texts], {"told": "reports", "anew": "again"}) == [
        "page.md:1: 'told'; write: reports", "module.py:1: 'anew'; write: again", "module.py:2: 'told'; write: reports",
        "module.py:3: 'told'; write: reports", "test_one.py:1: 'told'; write: reports", "run.h:1: 'anew'; write: again",
        "CHANGELOG.md:5: 'told'; write: reports"]


def prose_faults(texts: dict[str, str], folder: Path) -> list[str]:
    """The complaints of proselint, by the rules of .proselintrc.json, with the paragraph."""
    pytest.importorskip("proselint")
    for name, text in texts.items():
        (folder / f"{name}.md").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "proselint", "--config", ".proselintrc.json", "check", str(folder)]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert "Traceback" not in run.stderr and run.returncode in (0, 1), run.stderr
    return [line for line in (run.stdout + run.stderr).splitlines() if line.strip()]


def test_prose(tmp_path: Path) -> None:
    """By proselint, without code and targets of links."""
    def plain(paragraph: str) -> str:
        return re.sub(r"\]\([^)]*\)", "]", re.sub(r"`[^`]*`", "code", paragraph))

    texts = {f"{page.parent.name}-{page.stem}": "\n\n".join(plain(paragraph) for _, paragraph in paragraphs(page))
             for page in PAGES}
    assert prose_faults(texts, tmp_path) == []


def test_faulty_prose_is_found(tmp_path: Path) -> None:
    (fault,) = prose_faults({"page": "The most unique joint is revolute... as \"usual\".\n"}, tmp_path)
    assert "uncomparables" in fault and "page.md:1:" in fault


def test_spelling() -> None:
    """By codespell, with the words that pyproject.toml lists."""
    pytest.importorskip("codespell_lib")
    texts = ["docs", "README.md", "CONTRIBUTING.md", "CHANGELOG.md", "notebooks", "symdyn", "templates"]
    run = subprocess.run([sys.executable, "-m", "codespell_lib", *texts], cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
