"""The picture of errors against tolerances: drawn when the site is built, from what this command printed last.

python docs/extensions/measured.py tolerance runs the command, python docs/extensions/tolerance.py, and keeps what it prints.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence

from docutils import nodes
from measured import file_of, kept, rows_of
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

# Names of `symdyn bench --all`, and tenths of their usual motion after which the errors are taken.
CASES = (("pendulum", 10), ("car_axis", 10), ("four_bar", 10), ("n_link_pendulum(5)", 10), ("double_pendulum", 2),
         ("double_pendulum", 10))
TOLERANCES = [10.0**-k for k in range(3, 15)]
METHOD = "dop853"
# Size of the picture, and of the room around its axes: left, top, right, bottom.
WIDTH, HEIGHT, ROOM = 760, 430, (62, 16, 196, 48)
# Decades of errors; of tolerances from the first to the last.
LARGEST, LEAST = 1, -15
# Colours of mechanisms: those of Okabe and Ito that are seen on white and on black, and a violet.
COLORS = ("#0072b2", "#d55e00", "#009e73", "#8a63d2", "#cc79a7")


def measure() -> None:
    """Print the errors: a row for each mechanism and time, a column for each tolerance."""
    import symdyn as sd

    print("  ".join(["mechanism", "after", *(f"{tolerance:.0e}" for tolerance in TOLERANCES)]))
    results = {name: sd.bench(name, methods=[METHOD], tolerances=TOLERANCES, repeats=1) for name in dict(CASES)}
    for name, tenths in CASES:
        first = {row.tolerance: row for row in reversed(results[name].rows)}
        errors = [first[tolerance].errors[tenths - 1] for tolerance in TOLERANCES]
        print("  ".join([name, f"{results[name].end * tenths / 10:g} s", *(f"{error:.1e}" for error in errors)]), flush=True)


def x_of(tolerance: float) -> float:
    first, last = math.log10(TOLERANCES[0]), math.log10(TOLERANCES[-1])
    left, _, right, _ = ROOM
    return left + (WIDTH - left - right) * (math.log10(tolerance) - first) / (last - first)


def y_of(error: float) -> float:
    _, top, _, bottom = ROOM
    exponent = min(max(math.log10(error), LEAST), LARGEST)
    return top + (HEIGHT - top - bottom) * (LARGEST - exponent) / (LARGEST - LEAST)


def apart(wanted: Sequence[float], distance: float) -> list[float]:
    """Heights of labels near those that are wanted, a distance from each other, in the same order."""
    order = sorted(range(len(wanted)), key=lambda k: wanted[k])
    heights = dict(enumerate(wanted))
    for below, above in zip(order[1:], order, strict=False):
        heights[below] = max(heights[below], heights[above] + distance)
    over = heights[order[-1]] - (HEIGHT - ROOM[3])
    for above, below in zip([*reversed(order)][1:], reversed(order), strict=False):
        if over > 0:
            heights[order[-1]] = HEIGHT - ROOM[3]
            heights[above] = min(heights[above], heights[below] - distance)
    return [heights[k] for k in range(len(wanted))]


def drawn(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """The picture as SVG, whose text and lines have the colours of the page."""
    left, top, right, bottom = ROOM
    tolerances = [float(cell) for cell in head[2:]]
    parts = [f'<svg class="figure" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
             'aria-label="Errors against tolerances, a line for each mechanism">']
    for k in range(LEAST, LARGEST + 1, 2):
        y = y_of(10.0**k)
        parts += [f'<line class="grid" x1="{left}" x2="{WIDTH - right}" y1="{y:.1f}" y2="{y:.1f}"/>',
                  f'<text x="{left - 8}" y="{y + 4:.1f}" text-anchor="end">1e{k}</text>']
    for word, tolerance in zip(head[2:], tolerances, strict=True):
        x = x_of(tolerance)
        parts += [f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{top}" y2="{HEIGHT - bottom}"/>',
                  f'<text x="{x:.1f}" y="{HEIGHT - bottom + 18}" text-anchor="middle">{word.replace("e-0", "e-")}</text>']
    parts += [f'<line class="equal" x1="{x_of(tolerances[0]):.1f}" y1="{y_of(tolerances[0]):.1f}" '
              f'x2="{x_of(tolerances[-1]):.1f}" y2="{y_of(tolerances[-1]):.1f}"/>']
    ends = apart([y_of(float(row[-1])) for row in rows] + [y_of(tolerances[-1])], 17)
    colors = dict(zip(dict.fromkeys(row[0] for row in rows), COLORS, strict=True))
    for k, (row, end) in enumerate(zip(rows, ends, strict=False)):
        color = colors[row[0]]
        dashes = ' stroke-dasharray="6 4"' if any(row[0] == other[0] for other in rows[k + 1:]) else ""
        points = [(x_of(t), y_of(float(e))) for t, e in zip(tolerances, row[2:], strict=True)]
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        parts += [f'<polyline points="{line}" fill="none" stroke="{color}" stroke-width="2"{dashes}/>']
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{color}"/>' for x, y in points]
        x, y = points[-1]
        parts += [f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{x + 14:.1f}" y2="{end:.1f}" stroke="{color}"/>',
                  f'<text x="{x + 18:.1f}" y="{end + 4:.1f}">{row[0]}, {row[1]}</text>']
    parts += [f'<text x="{x_of(tolerances[-1]) + 18:.1f}" y="{ends[-1] + 4:.1f}">error = tolerance</text>',
              f'<text x="{(left + WIDTH - right) / 2}" y="{HEIGHT - 8}" text-anchor="middle">rtol = atol</text>',
              f'<text transform="translate(14 {(top + HEIGHT - bottom) / 2}) rotate(-90)" text-anchor="middle">error</text>',
              "</svg>"]
    return "".join(parts)


class Tolerances(SphinxDirective):
    """The picture, with the command, the day and the machine."""

    def run(self) -> list[nodes.Node]:
        self.env.note_dependency(str(file_of("tolerance")))
        result = kept("tolerance")
        head, rows, _ = rows_of(result)
        below = f"{result['command']}, {result['date']}: {result['machine']}."
        return [nodes.raw("", drawn(head, rows), format="html"), nodes.paragraph("", below, classes=["measured"])]


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("tolerances", Tolerances)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    sys.exit(measure())
