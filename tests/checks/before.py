"""Figures of a benchmark compared with those of another commit, each the median of some runs.

    python tests/checks/before.py --against HEAD~1 nets --sizes 5 10
    python tests/checks/before.py --against v0.1.0 --rounds 5 figures

The words after the options are those of `symdyn bench`. It runs in turn in the working tree and in a worktree of the commit, in a
process of its own with an empty cache and, unless OPENBLAS_NUM_THREADS says otherwise, one thread of BLAS. The table has the
figures that differ, with their ratio, and the processor time of the whole run; figures that are the same are counted. On a busy
machine more rounds give steadier medians. The exit code is 1 if the runs fail.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import resource
import statistics
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(1, str(Path(__file__).resolve().parents[2] / "docs" / "extensions"))

from printed import as_table

from tests.checks.commits import ROOT, tree_of

# Cells that are compared: (row, column) -> the cell, as text.
Cells = dict[tuple[str, str], str]
NUMBER = re.compile(r"(-?(?:\d[\d.,]*(?:e[-+]?\d+)?|inf|nan))(?: (.*))?")
WHOLE = ("the whole run", "processor s")


def cells_of(text: str) -> Cells:
    """The cells of a table that was printed, else the numbers in the lines. Raises ValueError where there are none.

    Rows of a table are called by their first cells, as far as these are words and whole numbers, and as many as tell them apart.
    """
    lines = text.rstrip().splitlines()
    head, rows, _ = as_table(lines)
    if not rows:
        return _by_place(lines)
    words = next((n for n, cells in enumerate(zip(*rows, strict=True))
                  if any((number := _number(c)) and not number[1] and not c.isdigit() for c in cells)), 1)
    named = next((n for n in range(1, words) if len({tuple(row[:n]) for row in rows}) == len(rows)), max(words, 1))
    named = 1 if not head[0] else named
    return _numbered((("  ".join(row[:named]), column), cell) for row in rows
                     for column, cell in list(zip(head, row, strict=True))[named:])


def _by_place(lines: Sequence[str]) -> Cells:
    """Numbers that stand between spaces, called by what is before the first of their line, and by the word that ends above them
    in the last line without numbers."""
    above: dict[int, str] = {}
    found = []
    for k, line in enumerate(lines):
        numbers = [m for m in re.finditer(r"\S+", line) if _number(m[0])]
        if not numbers:
            above = {m.end(): m[0] for m in re.finditer(r"\S+", line)}
        row = line[:numbers[0].start()].strip() if numbers else ""
        found += [((row or f"line {k + 1}", above.get(m.end(), f"number {n + 1}")), m[0]) for n, m in enumerate(numbers)]
    if not found:
        raise ValueError(f"no figures were found in what was printed; it begins {lines[0][:60]!r}")
    return _numbered(found)


def _numbered(found: Iterable[tuple[tuple[str, str], str]]) -> Cells:
    """Figures of the same row and column get numbers."""
    cells, times = Cells(), Counter[tuple[str, str]]()
    for key, cell in found:
        times[key] += 1
        cells[key if times[key] == 1 else (f"{key[0]} ({times[key]})", key[1])] = cell
    return cells


def run(root: Path, words: Sequence[str]) -> Cells:
    """Output of `symdyn bench` in a tree, and its processor time. Raises RuntimeError where it fails."""
    with tempfile.TemporaryDirectory() as made:
        known = {"OPENBLAS_NUM_THREADS": "1", **os.environ, "PYTHONPATH": str(root), "SYMDYN_CACHE_DIR": made}
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([sys.executable, "-m", "symdyn", "bench", *words], cwd=root, env=known, capture_output=True,
                              text=True, check=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in (0, 1) or not done.stdout.strip():  # 1: a bound is missed
        raise RuntimeError("\n".join(done.stderr.strip().splitlines()[-3:]))
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {**cells_of(done.stdout), WHOLE: f"{seconds:.2f}"}


def typical(runs: Sequence[Cells]) -> Cells:
    """The median of each cell that is a number in all runs, with its unit; of others the first run's."""
    found = dict(runs[0])
    for key in found:
        numbers = [_number(cells[key]) for cells in runs if key in cells]
        if len(runs) > 1 and all(numbers):
            value = statistics.median_low([n for n, _ in filter(None, numbers)])
            found[key] = next(cells[key] for cells, n in zip(runs, numbers, strict=False) if n and n[0] == value)
    return found


def _number(cell: str) -> tuple[float, str] | None:
    """The number and the unit of a cell; None of words."""
    found = NUMBER.fullmatch(cell)
    return (float(found[1].replace(",", "")), found[2] or "") if found and found[1] != "nan" else None


def table(now: Mapping[tuple[str, str], str], then: Mapping[tuple[str, str], str]) -> list[str]:
    """Lines: the figures that differ and their ratio, how many are the same, and rows that one of both lacks."""
    lines, same = [("row", "figure", "now", "then", "ratio")], 0
    for key in [*now, *(key for key in then if key not in now)]:
        a, b = now.get(key, "-"), then.get(key, "-")
        if a == b:
            same += 1
            continue
        x, y = _number(a), _number(b)
        comparable = x is not None and y is not None and x[1] == y[1] and y[0] != 0
        lines.append((*key, a, b, f"{x[0] / y[0]:.3g}" if comparable and x and y else ""))
    widths = [max(len(line[k]) for line in lines) for k in range(5)]
    texts = [f"{row:<{widths[0]}}  {figure:<{widths[1]}}" + "".join(f"  {text:>{width}}" for text, width in zip(
        numbers, widths[2:], strict=True)) for row, figure, *numbers in lines]
    return [*(text.rstrip() for text in texts), f"{same} figures are the same"]


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python tests/checks/before.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", metavar="COMMIT", default="HEAD", help="default HEAD: what is not committed yet")
    parser.add_argument("--rounds", metavar="N", type=int, default=3, help="runs in each tree, in turn (default 3)")
    parser.add_argument("words", nargs=argparse.REMAINDER, metavar="WORD ...", help="those of symdyn bench")
    options = parser.parse_args(arguments)
    if not options.words or options.rounds < 1:
        parser.error("give a benchmark, such as nets --sizes 5, and 1 round or more")
    runs: tuple[list[Cells], list[Cells]] = ([], [])
    with contextlib.ExitStack() as stack:
        other = stack.enter_context(tree_of(options.against))
        for k in range(options.rounds):
            for name, tree, own in zip(("the working tree", options.against), (ROOT, other), runs, strict=True):
                print(f"round {k + 1} of {options.rounds}: {name}", file=sys.stderr, flush=True)
                try:
                    own.append(run(tree, options.words))
                except (RuntimeError, ValueError) as error:
                    print(f"symdyn bench {' '.join(options.words)} failed in {name}: {error}", file=sys.stderr)
                    return 1
    print("\n".join(table(*map(typical, runs))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
