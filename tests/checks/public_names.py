"""Number of public names with an entry in the reference of a built site, and an example that runs.

python -m sphinx -W -b html docs generated/site && python tests/checks/public_names.py generated/site

Counted are the classes, functions, methods and properties that the site's reference lists, each with an example of its own, and
fields of records, which stand in the example of their class.
"""

from __future__ import annotations

import doctest
import inspect
import re
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import symdyn as sd
from tests.test_examples import PUBLIC, example

OBJECT = re.compile(r'<dl class="py (\w+)">\s*((?:<dt class="sig sig-object py" id="[\w.]+".*?</dt>\s*)+)', re.DOTALL)


def entries(site: Path) -> str:
    return "".join(page.read_text(encoding="utf-8") for page in sorted((site / "reference").glob("*.html")))


def objects(text: str) -> dict[str, str]:
    """Every name that the reference has an entry of -> its kind: class, function, method, property, exception, data."""
    return {name: kind for kind, heads in OBJECT.findall(text) for name in re.findall(r'<dt[^>]* id="([\w.]+)"', heads)}


def listed(name: str, thing: Any, text: str) -> bool:
    if inspect.ismodule(thing):
        return f'id="module-{thing.__name__}"' in text or (callable(thing) and f"sd.{name}" in text)
    return any(f'id="{one}"' in text for one in (f"symdyn.{name}", f"{getattr(thing, '__module__', 'symdyn')}.{name}"))


def runs(name: str) -> bool:
    """Whether it has an example, and this gives what it says; fields of records stand in the example of their class."""
    if name not in PUBLIC:
        owner, _, field = name.rpartition(".")
        return owner in PUBLIC and re.search(rf">>> .*\.{field}\b", example(owner).docstring or "") is not None and runs(owner)
    shown = example(name)
    return bool(shown.examples) and not doctest.DocTestRunner(verbose=False).run(shown, out=lambda text: None).failed


def report(found: int, of: int, what: str, missing: list[str]) -> None:
    print(f"{found} of {of} {what}{': not ' + ', '.join(missing) if missing else ''}")


def main(site: Path) -> int:
    text = entries(site)
    names = {name: getattr(sd, name) for name in sd.__all__}
    without = [name for name, thing in names.items() if not listed(name, thing, text)]
    report(len(names) - len(without), len(names), "public names of the package have an entry in the reference", without)
    kinds = objects(text)
    shown = [name for name, kind in kinds.items() if kind not in ("exception", "data")]
    bad = [name for name in shown if not runs(name)]
    what = "classes, functions, methods, properties and fields of the reference have an example that runs"
    report(len(shown) - len(bad), len(shown), what, bad)
    print(f"{list(kinds.values()).count('exception')} errors and warnings of the reference are raised, not called, and need none")
    unlisted = [name for name in PUBLIC if name not in kinds]
    if unlisted:
        print(f"names that the pages ask for and the site lacks: {', '.join(unlisted)}")
    return bool(without or bad or unlisted)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
