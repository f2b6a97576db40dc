"""The page of measured figures: tables of what commands printed, which is kept in docs/measured with their dates and machines.

python docs/extensions/measured.py [NAME ...] runs the commands and keeps what they print.
"""

from __future__ import annotations

import json
import os
import platform
import re
import subprocess
import sys
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from printed import as_table
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "docs" / "measured"
# Commands to run, by the names of the files in which their output is kept.
COMMANDS = {
    "figures": "symdyn bench figures",
    "peers": "symdyn bench peers",
    "peers_of_derivatives": "symdyn bench peers --derivatives",
    "robots": "symdyn bench robots",
    "loops": "symdyn bench loops",
    "turbine": "symdyn bench turbine",
    "flexible": "symdyn bench flexible",
    "batch": "symdyn bench batch",
    "sweep": "symdyn bench sweep",
    "growth": "symdyn bench growth",
    "rolled": "symdyn bench rolled",
    "bridges": "symdyn bench bridges --sizes 20 50",
    "nets": "symdyn bench nets",
    "windows": "symdyn bench windows",
    "stiff": "symdyn bench stiff",
    "pages": "symdyn bench pages",
    "sensitivities": "symdyn bench sensitivities",
    "optimize": "symdyn bench optimize",
    "contacts": "symdyn bench contacts",
    "predictions": "symdyn bench predictions",
    "backends": "python tests/checks/backends.py",
    "printing": "symdyn bench printing",
    "sympy": "symdyn bench sympy",
    "comparison": "symdyn compare --all",
    "tolerance": "python docs/extensions/tolerance.py",
    "reference": "python tests/checks/public_names.py generated/site",
    "site": "python tests/checks/whole_site.py generated/site",
    "walk": "python tests/checks/walk.py generated/site",
}
# Columns from which on a table has small letters, and letters of a cell that gets some width there.
WIDE, LONG = 8, 40


def file_of(name: str) -> Path:
    return RESULTS / f"{name}.json"


def kept(name: str) -> dict[str, Any]:
    """Output of a command, and when and where it was printed."""
    if not file_of(name).exists():
        raise ExtensionError(f"nothing is kept of {COMMANDS.get(name, name)!r}: run python docs/extensions/measured.py {name}")
    found: dict[str, Any] = json.loads(file_of(name).read_text(encoding="utf-8"))
    return found


def store(name: str) -> None:
    """Run a command and keep what it prints. Raises where it fails otherwise than by a bound that is missed."""
    load, begun = os.getloadavg()[0], time.monotonic()
    words = COMMANDS[name].split()
    command = [sys.executable, *(words[1:] if words[0] == "python" else ["-m", *words])]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    if done.returncode not in (0, 1) or not done.stdout.strip():
        raise SystemExit(f"{COMMANDS[name]} failed:\n{done.stderr[-2000:]}")
    result = {"command": COMMANDS[name], "date": datetime.now(UTC).date().isoformat(), "seconds": round(time.monotonic() - begun),
              "machine": machine(), "load": round(load, 1), "missed": done.returncode == 1,
              "lines": done.stdout.rstrip().splitlines()}
    RESULTS.mkdir(exist_ok=True)
    file_of(name).write_text(json.dumps(result, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def machine() -> str:
    """The processor, the number of cores that may be used, the compiler and Python."""
    info = Path("/proc/cpuinfo")
    found = re.search(r"^model name\s*: (.+)$", info.read_text(encoding="utf-8"), re.MULTILINE) if info.exists() else None
    compiler = subprocess.run(["cc", "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{found[1] if found else platform.machine()}, {cores} cores, {compiler}, Python {platform.python_version()}"


def rows_of(result: dict[str, Any]) -> tuple[list[str], list[list[str]], list[str]]:
    """The head and the rows of a table, and the lines below it; no rows of what is no table."""
    return (result["head"], result["rows"], []) if "rows" in result else as_table(result["lines"])


class Measured(SphinxDirective):
    """Output of a command, as a table where it prints figures, with the command, the date and the machine; `lines`: the first
    ones alone."""

    required_arguments = 1
    option_spec: ClassVar[dict[str, Any]] = {"lines": int}

    def run(self) -> list[nodes.Node]:
        result = kept(self.arguments[0])
        self.env.note_dependency(str(file_of(self.arguments[0])))
        took = f" It took {result['seconds']} s." if "seconds" in result else ""
        load = f" The load average was {result['load']:g} when it began." if result.get("load", 0) >= 1 else ""
        about = nodes.paragraph("", "", nodes.literal("", result["command"]), nodes.Text(
            f", {result['date']}: {result['machine']}.{took}{load}"), classes=["measured"])
        head, rows, below = rows_of(result)
        shown: list[nodes.Node] = [about, table(head, rows)] if rows else [about]
        if text := "\n".join(below[:self.options.get("lines")]):
            shown.append(nodes.literal_block(text, text, language="text", classes=["printed"]))
        return shown


def table(head: list[str], rows: list[list[str]]) -> nodes.container:
    """A table within the box in which the theme lets it scroll."""
    group = nodes.tgroup("", *[nodes.colspec(colwidth=1) for _ in head], cols=len(head))
    # Quotes and hyphens stay those of what was printed, such as options of commands.
    wide = len(head) > WIDE
    line = [nodes.row("", *[nodes.entry("", nodes.paragraph("", cell, support_smartquotes=False),
                                        classes=["long"] if wide and len(cell) > LONG else []) for cell in cells])
            for cells in (head, *rows)]
    group += [nodes.thead("", line[0]), nodes.tbody("", *line[1:])]
    classes = ["docutils", "align-default", *(["wide"] if wide else [])]
    return nodes.container("", nodes.table("", group, classes=classes), classes=["table-wrapper"])


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("measured", Measured)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    for chosen in sys.argv[1:] or COMMANDS:
        store(chosen)
        print(chosen, flush=True)
