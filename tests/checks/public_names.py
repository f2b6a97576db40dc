"""How many public names have an entry in the reference of a built site, and an example that runs.

python -m sphinx -W -b html docs generated/site && python tests/checks/public_names.py generated/site
"""

from __future__ import annotations

import doctest
import inspect
import re
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
import sympy as sp

import symdyn as sd
from tests.test_examples import PUBLIC


def entries(site: Path) -> str:
    return "".join(page.read_text(encoding="utf-8") for page in (site / "reference").glob("*.html"))


def listed(name: str, thing: Any, text: str) -> bool:
    if inspect.ismodule(thing):
        return f'id="module-{thing.__name__}"' in text or (callable(thing) and f"sd.{name}" in text)
    return any(f'id="{one}"' in text for one in (f"symdyn.{name}", f"{getattr(thing, '__module__', 'symdyn')}.{name}"))


def runs(name: str, thing: Any) -> bool | None:
    """Whether the examples give what they say; None without an example."""
    example = doctest.DocTestParser().get_doctest(inspect.getdoc(thing) or "", {"sd": sd, "np": np, "sp": sp}, name, None, 0)
    return not doctest.DocTestRunner(verbose=False).run(example, out=lambda text: None).failed if example.examples else None


def report(found: int, of: int, what: str, missing: list[str]) -> None:
    print(f"{found} of {of} {what}{': not ' + ', '.join(missing) if missing else ''}")


def main(site: Path) -> int:
    text = entries(site)
    names = {name: getattr(sd, name) for name in sd.__all__}
    without = [name for name, thing in names.items() if not listed(name, thing, text)]
    report(len(names) - len(without), len(names), "public names have an entry in the reference", without)
    methods = [name for name in PUBLIC if not name.startswith("sd.")]
    missing = [name for name in methods if not re.search(rf'id="[\w.]*\b{re.escape(name)}"', text)]
    report(len(methods) - len(missing), len(methods), "methods of System, Equations, Module, Solution have an entry", missing)
    bad = [name for name, thing in PUBLIC.items() if not runs(name, thing)]
    report(len(PUBLIC) - len(bad), len(PUBLIC), "classes, functions and methods have an example that runs", bad)
    others = [name for name in names if f"sd.{name}" not in PUBLIC]
    print(f"{len(others)} names are errors, packages or constants, which need none: {', '.join(others)}")
    return bool(without or missing or bad)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
