"""Parts of the runtime put into one text, and what is said of parts that cannot be."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from symdyn.backend import thresholds
from symdyn.backend.gathered import Gathered
from symdyn.backend.integrated import Shape, sizes
from symdyn.backend.metadata import EventRecord
from symdyn.backend.methods import METHODS
from symdyn.backend.parts import Parts
from symdyn.errors import SymdynError

RUNTIME = Path(__file__).parents[2] / "templates" / "c" / "runtime"


def parts(files: dict[str, str], **switches: bool) -> Parts:
    return Parts(files.__getitem__, switches)


def test_each_part_stands_once_where_it_is_first_included() -> None:
    files = {"a.h": "#pragma once\n// a", "b.h": '#pragma once\n#include "a.h"\n// b',
             "c.c": '#include "b.h"\n#include "a.h"\n// c'}
    one = parts(files)
    assert one.text("c.c") == "// a\n\n// b\n\n// c\n"
    assert one.text("a.h") == ""


@pytest.mark.parametrize(("condition", "kept"), [
    ("A", True), ("!A", False), ("A && B", False), ("A && !B", True), ("B || A", True), ("B || !A", False)])
def test_conditions_of_switches_are_resolved(condition: str, kept: bool) -> None:
    text = parts({"a": f"#if {condition}\nyes\n#else\nno\n#endif\nend"}, A=True, B=False).text("a")
    assert text == ("yes\nend\n" if kept else "no\nend\n")


def test_other_conditions_stay_also_around_those_that_are_resolved() -> None:
    text = "#if defined(__GNUC__)\n#if A\n1\n#endif\n#elif X\n#if !A\n2\n#if X\n3\n#endif\n#endif\n#endif"
    assert parts({"a": text}, A=True).text("a") == "#if defined(__GNUC__)\n1\n#elif X\n#endif\n"
    assert parts({"a": text}, A=False).text("a") == "#if defined(__GNUC__)\n#elif X\n2\n#if X\n3\n#endif\n#endif\n"


def test_a_part_that_is_left_out_is_not_read() -> None:
    assert parts({"a": '#if A\n#include "missing"\n#endif\n1'}, A=False).text("a") == "1\n"


def test_a_text_for_a_macro() -> None:
    assert parts({"a": "1\n#include MODEL\n2"}).text("a", MODEL="model\n") == "1\n\nmodel\n\n2\n"
    with pytest.raises(SymdynError, match=r"a: #include MODEL, but there is no text of MODEL; pass one"):
        parts({"a": "#include MODEL"}).text("a")


def test_a_condition_that_is_not_closed() -> None:
    with pytest.raises(SymdynError, match="a: #if without #endif; close the condition"):
        parts({"a": "#if A\n1"}, A=True).text("a")


def test_the_head_of_a_file_stands_where_its_own_text_begins() -> None:
    files = {"list.h": '// List.\n#pragma once\n\n#include "a.h"\n#include "b.h"', "a.h": "// A.\n#pragma once\n\nint a;",
             "b.h": '// B.\n#pragma once\n\n#include "a.h"\n#if X\n#include "c.h"\n#endif\n\nint b;', "c.h": "// C.\nint c;"}
    assert parts(files, X=True).text("list.h") == "// A.\n\nint a;\n\n// C.\nint c;\n\n// B.\n\nint b;\n"


# The parts that written files may have, by those that are asked for.
ROOTS = ("runtime.c", "batch_explicit.h", "motions.h", "states.h", "rows.h", "sincos.h", "columns.h", "motion_columns.h",
         "status_text.h", "symdyn_saddle.h", "symdyn_multipliers.h", "symdyn_catenary.h", "symdyn_cube.h", "symdyn_grid_spline.h",
         "symdyn_line_spline.h", "symdyn_touching.h")


def test_comments_of_written_files_name_no_other_files() -> None:
    """Readers of a written file have none of symdyn's."""
    texts: dict[str, str] = {}
    names = list(ROOTS)
    while names:
        name = names.pop()
        if name not in texts:
            texts[name] = (RUNTIME / name).read_text(encoding="utf-8")
            names += re.findall(r'#include "(\w+\.h)"', texts[name])
    assert len(texts) > 45
    dangling = re.compile(r"//.*\b\w+\.(?:h|c|py|jinja)\b")
    assert [(name, line) for name, text in texts.items() for line in text.splitlines() if dangling.search(line)] == []


def test_thresholds_that_python_has_too_are_macros() -> None:
    """C has none of their numbers; the macros have the values of the constants."""
    macros = dict(sum((thresholds.EVENTS, thresholds.MOVES, thresholds.PROJECTIONS, thresholds.RESETS, thresholds.PIVOTS), ()))
    texts = {name: re.sub("//.*", "", (RUNTIME / name).read_text(encoding="utf-8"))
             for name in ("projection.h", "pivots.h", "resets.h", "events.h")}
    numbers = r"(?<![\w.-])(?:1e-14|1e4|1e-13|9e-16|3\.6e-15|4e-16|0\.7|1e-15|1e-3|13|12)(?![\w.])"
    assert {name: re.findall(numbers, text) for name, text in texts.items()} == {name: [] for name in texts}
    read = set(re.findall(r"\bSYMDYN_\w+", "".join(texts.values())))
    assert set(macros) <= read and len(macros) == 22
    shape = Shape({"q": 2, "u": 2, "z": 0, "inputs": 0}, 1, (), [EventRecord("a", 0, False, (2,), False, (), ())], (), True)
    assert macros.items() <= dict(sizes(METHODS["dop853"], shape, Gathered())).items()


@pytest.mark.parametrize("path", sorted(RUNTIME.iterdir()), ids=lambda path: path.name)
def test_parts_are_plain_c(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert not re.search(r"\{\{ |\{%|\{#", text) and text.startswith("//") and max(map(len, text.splitlines())) <= 130
