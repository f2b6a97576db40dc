"""Spelling, and the words that docs/style.md does not want, in pages, notebooks and docstrings."""

from __future__ import annotations

import ast
import inspect
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import symdyn as sd
from tests.test_examples import PUBLIC

ROOT = Path(__file__).parents[1]
STYLE = ROOT / "docs" / "style.md"
PAGES = [*sorted((ROOT / "docs").rglob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md",
         *sorted((ROOT / "notebooks").glob("*.py"))]


def unwanted(style: str) -> dict[str, str]:
    """The words of the table -> what to write in their place."""
    rows = re.findall(r"^\| (.+) \| (.+) \|$", style, re.MULTILINE)
    return {word: right for left, right in rows if left not in ("not", "---") for word in left.split(", ")}


def prose(path: Path) -> Iterator[tuple[int, str]]:
    """Lines of text with their numbers: of a page without its code, of a notebook its markdown, of a module its docstrings."""
    lines = path.read_text(encoding="utf-8").splitlines()
    if path.suffix == ".md":
        yield from _outside_code(lines)
    elif path.is_relative_to(ROOT / "notebooks"):
        yield from ((k, line) for k, line in enumerate(lines, 1) if line.startswith("# "))
    else:
        for node in ast.walk(ast.parse("\n".join(lines))):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
                first = node.body[0]
                yield from ((k, lines[k - 1]) for k in range(first.lineno, (first.end_lineno or 0) + 1))


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


# Sentences that begin so have a clause for a subject, or their subject late.
BEGINNINGS = re.compile(r"(What|Of|With which|Whoever)\b")
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
    return BEGINNINGS.match(sentence) is not None and not sentence.endswith("?")


def test_sentences_begin_with_their_subject() -> None:
    """As docs/style.md asks; and no word stands twice."""
    assert [line for page in PAGES if page != STYLE for line in clumsy(page)] == []


def test_public_docstrings_begin_sentences_with_their_subject() -> None:
    """Those of the reference, without their examples."""
    public = {**PUBLIC, **{name: getattr(sd, name) for name in sd.__all__}}
    texts = {name: (inspect.getdoc(thing) or "").partition(">>>")[0] for name, thing in public.items()}
    assert [(name, one) for name, text in texts.items() for one in sentences(" ".join(text.split())) if begins_late(one)] == []


def test_a_clumsy_sentence_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    text = "# What it is\n\nA mass. What is left is\nzero. What is it?\n\n- Of two the first is taken.\n\nIt is is so.\n"
    page.write_text(text, encoding="utf-8")
    expected = ["page.md:3: What is left is zero.", "page.md:6: Of two the first is taken.", "page.md:8: It is is so."]
    assert clumsy(page) == expected


def test_pages_and_notebooks_use_the_words_of_the_field() -> None:
    assert found(PAGES, unwanted(STYLE.read_text(encoding="utf-8"))) == []


def test_docstrings_use_the_words_of_the_field() -> None:
    modules = sorted((ROOT / "symdyn").rglob("*.py"))
    assert found(modules, unwanted(STYLE.read_text(encoding="utf-8"))) == []


def test_an_unwanted_word_is_found(tmp_path: Path) -> None:
    """In a page outside of code, and in a docstring."""
    page, module = tmp_path / "page.md", tmp_path / "module.py"
    page.write_text("A value told\n\n```python\ntold = 1\n```\nand `told`.\n", encoding="utf-8")
    module.write_text('"""Begins anew."""\ntold = 1\n', encoding="utf-8")
    assert found([page, module], {"told": "reports", "anew": "again"}) == ["page.md:1: 'told'; write: reports",
                                                                        "module.py:1: 'anew'; write: again"]


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
