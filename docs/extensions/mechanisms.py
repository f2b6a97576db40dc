"""Gallery of mechanisms of the catalogue, made by the package itself.

    python docs/extensions/mechanisms.py docs/gallery generated/gallery/views NAME ...

writes NAME.rst into the first folder, NAME.html (the motion), NAME.svg and NAME.c into the second.
"""

from __future__ import annotations

import inspect
import os
import re
import sys
import textwrap
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from views import frame

import symdyn as sd
from symdyn.formulation.equations import Equations
from symdyn.pipeline import emit
from symdyn.runtime.solutions.solution import Solution
from symdyn.viewer.live import mechanism_of
from symdyn.viewer.still import picture_of

# Starts and inputs of mechanisms that would stay at rest from the initial state of the catalogue, and their text.
STIRRED: dict[str, tuple[dict[str, Any], str]] = {
    "floating_crane": ({"q": {"beta": 0.2}}, ", with beta = 0.2 rad (it would stay at rest)"),
    "floating_wind_turbine": ({"inputs": {"v_w": 8.0}}, ", in a wind v_w of 8 m/s (it would stay at rest without)")}
# Lines of C that a page shows; the file has all of them.
LINES = 60


def write(pages: Path, views: Path, name: str) -> None:
    """The page of a mechanism, and the files that it shows."""
    system = sd.systems.get(name)
    model = system.check()
    equations = system.equations()
    mechanism, lengths = mechanism_of(model)
    (code,) = emit(equations, "c", ["rhs"], standalone=False, integrator=False).files.values()
    stirred, by = STIRRED.get(name, ({}, ""))
    solution = equations.compile().simulate(**stirred)
    picture = picture_of(mechanism, [shape.record for shape in model.shapes], lengths, name)
    parts = [f"{name}\n{'=' * len(name)}", _moving(name), _description(name), _equations(system),
             _numbers(equations, solution, by), _code(name, code)]
    texts = {views / f"{name}.svg": picture, views / f"{name}.c": code, views / f"{name}.html": solution.view(forces=True).html,
             pages / f"{name}.rst": "\n\n".join(parts) + "\n"}
    scratch = pages / f".{name}.{os.getpid()}"  # another build may read what is there: files are exchanged whole
    for path, text in texts.items():
        scratch.write_text(text, encoding="utf-8")
        scratch.replace(path)


def summary(name: str) -> str:
    """The first line of what a function of the catalogue documents."""
    return (inspect.getdoc(getattr(sd.systems, name)) or "").partition("\n")[0].replace("`", "")


def _description(name: str) -> str:
    return f".. autofunction:: symdyn.systems.{name}\n   :no-index:"


def _moving(name: str) -> str:
    return "\n\n".join([
        ".. raw:: html", textwrap.indent(frame(f"{name}.html", f"{name}: its motion"), "   "),
        f"``symdyn view {name}`` opens the mechanism with a slider for every coordinate."])


def _equations(system: sd.System) -> str:
    """The equations as a notebook shows them."""
    model = system.check()
    equations = system.augmented() if model.loops or model.constraints else system.embedding()
    formula = equations._repr_latex_().strip().strip("$").strip()
    return f"Equations\n---------\n\n.. math::\n\n{textwrap.indent(formula, '   ')}"


def _numbers(equations: Equations, solution: Solution, by: str) -> str:
    report = solution.module.report()
    rows = [(row.function, row.total, row.prologue, row.chain) for row in report.rows]
    motion = [("simulated time, s", f"{solution.t[-1]:g}"), ("method", solution.method), ("steps", solution.n_steps),
              ("evaluations of the right-hand side", solution.nfev)]
    if equations.constraints:
        motion.append(("largest defect of the constraints", f"{solution.constraint_violation.max():.1e}"))
    sizes = ", ".join(f"{count} {what}" for what, count in report.sizes.items() if count)
    return "\n\n".join([
        "Numbers\n-------", f"{equations.formulation} equations: {sizes}.",
        _table(("function", "operations", "prologue", "longest chain"), rows),
        f"The prologue runs once a simulation. The motion above, from the initial state of the catalogue{by}:",
        _table(("", ""), motion)])


def _table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    lines = [".. list-table::", "   :header-rows: 1" if any(head) else "", ""]
    for row in ([head] if any(head) else []) + list(rows):
        lines += [f"   {'-' if k else '* -'} {cell}".replace("   - ", "     - ") for k, cell in enumerate(row)]
    return "\n".join(lines)


def _code(name: str, code: str) -> str:
    """The function with the equations of motion, or the lines that it begins with."""
    begin = re.search(r"^(?:SYMDYN_EXPORT|static) int \w+?_rhs(?:_regular)?\([^;]*\{$", code, re.MULTILINE)
    assert begin is not None, f"{name}.c has no right-hand side"
    lines = code[begin.start():code.index("\n}", begin.start()) + 2].splitlines()
    more = f" The first {LINES} of its {len(lines)} lines:" if len(lines) > LINES else ""
    return "\n\n".join([
        "Code\n----", f"The right-hand side in C, x_dot = f(t, x).{more}",
        ".. code-block:: c\n\n" + textwrap.indent("\n".join(lines[:LINES]), "   "),
        f".. raw:: html\n\n   <p><a href=\"../_static/{name}.c\">All of {name}.c</a></p>",
        "Its description in Python:",
        ".. code-block:: python\n\n" + textwrap.indent(_source(name), "   ")])


def _source(name: str) -> str:
    """The function of the catalogue without its documentation."""
    text = inspect.getsource(getattr(sd.systems, name))
    return re.sub(r'\n    """.*?"""', "", text, count=1, flags=re.DOTALL).rstrip()


if __name__ == "__main__":
    warnings.simplefilter("ignore", sd.ModelWarning)
    for made in sys.argv[3:]:
        write(Path(sys.argv[1]), Path(sys.argv[2]), made)
