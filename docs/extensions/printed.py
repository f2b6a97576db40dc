"""Output of benchmarks as a table: figures a line each, or columns two spaces apart."""

from __future__ import annotations

import re
from collections.abc import Sequence

# A line with a figure, as the lab prints it: its name, the number, the unit, the bound, whether that is missed.
FIGURE = re.compile(r"(?P<name>\S+(?: \S+)*?)\s+(?P<value>-?(?:\d[\d.]*(?:e[-+]?\d+)?|inf|nan))"
                    r"(?: (?P<unit>[^\s<>]+))?\s*(?P<bound>(?:<=?|>=) \S+)?\s*(?P<missed>MISSED)?")


def as_table(lines: Sequence[str]) -> tuple[list[str], list[list[str]], list[str]]:
    """The head and the rows of a table, and the lines below it; no rows of what is no table."""
    found = [FIGURE.fullmatch(line) for line in lines]
    if all(found):
        return ["", "measured", "bound"], [[one["name"], f"{one['value']} {one['unit'] or ''}".strip(), " ".join(
            filter(None, (one["bound"], one["missed"] and "(missed)")))] for one in found if one], []
    # Columns that are two or more spaces apart, without an empty cell; the last one may have two.
    head, *cells = [re.split(r"\s{2,}", line.strip()) for line in lines]
    count = next((k for k, row in enumerate(cells) if len(row) - len(head) not in (0, 1)), len(cells))
    if len(head) < 3 or not count:
        return [], [], list(lines)
    return head, [[*row[:len(head) - 1], ": ".join(row[len(head) - 1:])] for row in cells[:count]], list(lines[1 + count:])
