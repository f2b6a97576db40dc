"""A newcomer's walk: the README's own set-up in a fresh clone, then each tutorial and each command with copy and paste only.

python -m sphinx -W -b html docs generated/site && python tests/checks/walk.py generated/site

prints the minutes of every step. Tutorials are the blocks of code of the built pages, one after the other, in an empty folder.
Commands are those that the README and the pages of COMMANDS print; some are left out, with the reason.

python tests/checks/walk.py generated/site --only tutorials/a_walker commands

takes the set-up, these pages and all commands of pages (some need what others wrote), and puts their rows with their day into the
stored walk. `python docs/extensions/measured.py walk` repeats and stores all of it.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from html import unescape
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
STORED = ROOT / "docs" / "measured" / "walk.json"
# Pages with code to copy, besides the tutorials; and those with commands, whose files are made from blocks of the pages before.
FIRST = ("start",)
COMMANDS = ("start", "command_line", "clusters", "firmware")
# Seconds that one step may take.
LIMIT = 900
# Commands that are not tried.
LEFT_OUT = {
    "python3 -m venv .venv && .venv/bin/pip install -q -e '.[test]' && .venv/bin/python -m pytest -n 2 --dist worksteal":
        "runs the whole suite, as .ci/run does",
    ".venv/bin/jupyter lab notebooks": "serves until it is stopped",
    "symdyn compare --all": "has a stored result on the page of measured figures",
    "symdyn bench figures": "has a stored result on the page of measured figures",
    "symdyn bench double_pendulum": "takes minutes; symdyn bench my_mechanism.py is tried",
    "symdyn stress": "takes minutes; symdyn stress my_mechanism.py is tried",
    "symdyn sweep map.toml": "needs Slurm; symdyn sweep my_sweep.toml is tried",
    "symdyn sweep map.toml --status": "needs Slurm; symdyn sweep my_sweep.toml --status is tried",
    "symdyn sweep map.toml --resume": "needs Slurm",
    "symdyn --print-completion bash > ~/.local/share/bash-completion/completions/symdyn": "writes into the shell's own folder",
}
WIDTH = 84
HEAD = f"{'step':<{WIDTH}}  {'minutes':>7}  {'day':<10}  end"
# Parts of the walk besides pages: what all others need, and the commands of pages.
SET_UP, SHELL = "set-up", "commands"
EXAMPLE = "README, example"


@dataclass(frozen=True)
class Step:
    """A step, its minutes, how it ended ("done", or why it failed or was left out), and the day."""

    name: str
    minutes: float | None
    end: str
    day: str

    @property
    def line(self) -> str:
        return f"{self.name:<{WIDTH}}  {'-' if self.minutes is None else f'{self.minutes:.2f}':>7}  {self.day}  {self.end}"

    @property
    def part(self) -> str:
        """The page whose blocks it ran, or SET_UP or SHELL."""
        if page := re.fullmatch(r"(.+): \d+ blocks?", self.name):
            return page[1]
        return SET_UP if self.name.startswith(("README: ", "tutorials: ")) else SHELL


def step_of(line: str) -> Step:
    """The step that a line is of."""
    name, minutes, day, end = re.split(r"\s{2,}", line, maxsplit=3)
    return Step(name, None if minutes == "-" else float(minutes), end, day)


def today() -> str:
    return datetime.now(UTC).date().isoformat()


def blocks(page: str, kind: str) -> list[str]:
    """The blocks of code of a page of the site, as its button copies them."""
    found = re.findall(rf'<div class="highlight-{kind} notranslate"><div class="highlight"><pre>(.*?)</pre>', page, re.DOTALL)
    return [unescape(re.sub("<[^>]+>", "", block)) for block in found]


def tutorials(site: Path) -> list[str]:
    """The pages of tutorials in the order in which their page lists them."""
    listed = (site / "tutorials.html").read_text(encoding="utf-8")
    return list(dict.fromkeys(re.findall(r'href="(tutorials/\w+)\.html"', listed)))


def commands(text: str) -> list[str]:
    """The commands of a block: without comments, and without what a list says of each after two or more spaces."""
    lines = [re.split(r"\s{2,}|\s#", line.strip())[0] for line in text.splitlines()]
    return [line for line in lines if re.match(r"(python3|\.venv/bin/|symdyn |pip |cmake )", line)]


def tried(name: str, command: str, folder: Path) -> Step:
    """Run a command of the shell as a newcomer has it: nothing of this process's Python, and no browser that opens."""
    mine = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "PYTHONDONTWRITEBYTECODE")
    clean = {name: value for name, value in os.environ.items() if name not in mine}
    clean |= {"SYMDYN_CACHE_DIR": str(folder.parent / "cache"), "BROWSER": "true", "MPLBACKEND": "agg"}
    begun = time.monotonic()
    try:
        run = subprocess.run(command, shell=True, cwd=folder, env=clean, capture_output=True, text=True, check=False,
                             timeout=LIMIT)
    except subprocess.TimeoutExpired:
        return Step(name, LIMIT / 60, f"FAILED: not at its end after {LIMIT} s", today())
    last = (run.stderr.strip() or run.stdout.strip() or "no output").splitlines()[-1]
    return Step(name, (time.monotonic() - begun) / 60, "done" if run.returncode == 0 else f"FAILED: {last[:200]}", today())


def parts(site: Path) -> list[str]:
    """The parts of the walk after the set-up, in their order."""
    return [EXAMPLE, *FIRST, *tutorials(site), SHELL]


def walk(site: Path, folder: Path, only: Collection[str]) -> Iterator[Step]:
    """The set-up and the steps of some parts, each run when it is asked for."""
    clone, work = folder / "symdyn", folder / "work"
    subprocess.run(["git", "clone", "-q", str(ROOT), str(clone)], check=True)
    readme = (clone / "README.md").read_text(encoding="utf-8")
    for command in commands("\n".join(re.findall(r"```bash\n(.*?)```", readme, re.DOTALL))):
        yield step("README: ", command, clone)
    (both,) = blocks((site / "tutorials.html").read_text(encoding="utf-8"), "bash")
    for command in both.strip().split(" && "):
        yield step("tutorials: ", command, clone)
    codes = {name: blocks((site / f"{name}.html").read_text(encoding="utf-8"), "python") for name in (*FIRST, *tutorials(site))}
    for name, code in {EXAMPLE: re.findall(r"```python\n(.*?)```", readme, re.DOTALL), **codes}.items():
        if name not in only:
            continue
        empty = folder / re.sub(r"\W+", "_", name)
        empty.mkdir()
        (empty / "page.py").write_text("\n".join(code), encoding="utf-8")
        yield tried(f"{name}: {len(code)} block{'s' * (len(code) > 1)}", f"{clone}/.venv/bin/python page.py", empty)
    if SHELL not in only:
        return
    work.mkdir()
    files(site, work)
    for command in printed(site):
        yield step("", command, work, f"{clone}/.venv/bin/")


def printed(site: Path) -> list[str]:
    """The commands of symdyn that the pages of COMMANDS print."""
    pages = [(site / f"{name}.html").read_text(encoding="utf-8") for name in COMMANDS]
    lists = [block for page in pages for kind in ("default", "none", "bash") for block in blocks(page, kind)]
    return list(dict.fromkeys(command.removeprefix(".venv/bin/") for block in lists for command in commands(block)))


def files(site: Path, folder: Path) -> None:
    """The files that commands name, copied from the pages that show them."""
    (mechanism,) = blocks((site / "command_line.html").read_text(encoding="utf-8"), "python")
    (sweep,) = blocks((site / "many_at_once.html").read_text(encoding="utf-8"), "toml")
    (folder / "my_mechanism.py").write_text(mechanism, encoding="utf-8")
    (folder / "my_sweep.toml").write_text(sweep, encoding="utf-8")
    large, _ = blocks((site / "clusters.html").read_text(encoding="utf-8"), "toml")
    (folder / "map.toml").write_text(large, encoding="utf-8")


def step(before: str, command: str, folder: Path, programs: str = "") -> Step:
    """A command that is tried, or left out; programs: the folder of the environment, where the page leaves it to the shell."""
    name = before + command
    if command in LEFT_OUT:
        return Step(name, None, f"left out: {LEFT_OUT[command]}", today())
    return tried(name, (programs if command.startswith(("symdyn ", "pip ")) else "") + command, folder)


def summary(steps: Collection[Step]) -> str:
    failed = sum(one.end.startswith("FAILED") for one in steps)
    return (f"{sum(one.end == 'done' for one in steps)} done, {failed} failed, "
            f"{sum(one.minutes is None for one in steps)} left out; {sum(one.minutes or 0 for one in steps):.0f} minutes in all")


def put_in(stored: Collection[Step], new: Collection[Step], order: Collection[str]) -> list[Step]:
    """Steps of an earlier walk with the parts that were walked again in place of theirs."""
    again = {one.part for one in new}
    return [one for part in (SET_UP, *order) for one in (new if part in again else stored) if one.part == part]


def main(site: Path, only: Collection[str]) -> int:
    steps = []
    print(HEAD)
    with tempfile.TemporaryDirectory(prefix="symdyn-walk-") as folder:
        for one in walk(site, Path(folder), only or parts(site)):
            print(one.line, flush=True)
            steps.append(one)
    print(summary(steps))
    if only:
        result = json.loads(STORED.read_text(encoding="utf-8"))
        rows = put_in([step_of(line) for line in result["lines"][1:-1]], steps, parts(site))
        result["lines"] = [HEAD, *(one.line for one in rows), f"{summary(rows)}; walked again: {', '.join(only)}"]
        STORED.write_text(json.dumps(result, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return int(any(one.end.startswith("FAILED") for one in steps))


if __name__ == "__main__":
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("site", type=Path)
    asked.add_argument("--only", nargs="+", default=[], metavar="PART", help="pages, or: commands")
    given = asked.parse_args()
    folder = given.site.resolve()
    if unknown := set(given.only) - set(parts(folder)):
        asked.error(f"there is no {', '.join(sorted(unknown))}; there are {', '.join(parts(folder))}")
    sys.exit(main(folder, given.only))
