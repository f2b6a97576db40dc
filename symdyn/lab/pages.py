"""`symdyn bench pages`: what a picture of a page that plays costs without a graphics card, in headless Chromium."""

from __future__ import annotations

import os
import shutil
import time as clock
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import symdyn as sd
from symdyn.errors import MissingExtra, SymdynError
from symdyn.lab.figures import Figure, print_figures

WIDE, HIGH = 800, 600
# Seconds before and of a measurement.
WARM, SPAN = 1.5, 4.0
# Processor time of a picture, ms, that 60 and 20 pictures a second of one core leave.
SIXTY, TWENTY = 16.0, 50.0
_CHROMIUM = ("chromium", "chromium-browser", "google-chrome")
_SOFTWARE = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
# A page of the same size whose canvas has another colour in every picture: what the browser takes by itself.
_EMPTY = f"""<!doctype html><body style="margin: 0"><canvas id="c" width="{WIDE}" height="{HIGH}"></canvas><script>
window.symdyn = {{ stage: {{ frames: 0 }} }};
const g = document.getElementById("c").getContext("webgl2", {{ antialias: false, alpha: false }});
(function f() {{ const n = ++symdyn.stage.frames; g.clearColor(n % 60 / 60, 0, 0, 1); g.clear(g.COLOR_BUFFER_BIT);
    requestAnimationFrame(f); }})();
</script>"""
# Style of a page with the picture alone, as large as the window.
_ALONE = "header, #player, #plots, #note { display: none !important; }</style>"
# Counts what the page's own drawing takes, and begins to play.
_PLAY = """() => { const stage = symdyn.stage; stage.spent = 0; if (!stage.draw) return;
    for (const { source } of symdyn.scenes) { const seek = source.seek.bind(source);
        source.seek = t => { const begun = performance.now(); seek(t); stage.spent += performance.now() - begun; }; }
    const draw = stage.draw.bind(stage);
    stage.draw = fine => { const begun = performance.now(); draw(fine); stage.spent += performance.now() - begun; };
    document.querySelector("button.play").click(); }"""


def empty() -> Iterator[Figure]:
    """A page that only fills its canvas."""
    yield from _page("an empty page", _EMPTY, 0.0)


def puma() -> Iterator[Figure]:
    """The PUMA 560."""
    yield from _both("PUMA 560", sd.systems.puma560(), SIXTY)


def turbine() -> Iterator[Figure]:
    """The floating wind turbine."""
    yield from _both("floating turbine", sd.systems.floating_wind_turbine(), TWENTY)


def _both(name: str, system: sd.System, bound: float) -> Iterator[Figure]:
    """In a window of that size with curves below, and with a picture of that size alone."""
    html = system.compile().simulate().view().html
    yield from _page(f"{name}, window", html, bound)
    yield from _page(f"{name}, picture", html.replace("</style>", _ALONE, 1), bound)


GROUPS = (empty, puma, turbine)


def run(only: Sequence[str] | None = None) -> int:
    """Measure; returns the number of figures that miss their bound. Raises MissingExtra without Playwright, SymdynError without
    Chromium and where there is no /proc."""
    _chromium()
    return print_figures(GROUPS, only)


def _chromium() -> tuple[Any, str]:
    try:
        from playwright.sync_api import sync_playwright
    except ImportError as error:
        raise MissingExtra(f"pages are measured through Playwright: pip install playwright ({error})") from None
    program = next(filter(None, map(shutil.which, _CHROMIUM)), None)
    if program is None or not Path("/proc/self/stat").exists():
        raise SymdynError("pages are measured in Chromium on Linux, by its processes in /proc; there is "
                          + ("no Chromium" if program is None else "no /proc"))
    return sync_playwright, program


def _page(name: str, html: str, bound: float) -> Iterator[Figure]:
    """Figures of a page; bound: of the processor time of one picture of all processes of the browser, ms; 0: none."""
    playwright, program = _chromium()
    with TemporaryDirectory() as folder, playwright() as p:
        path = Path(folder) / "page.html"
        path.write_text(html, encoding="utf-8")
        browser = p.chromium.launch(executable_path=program, args=list(_SOFTWARE))
        page = browser.new_page(viewport={"width": WIDE, "height": HIGH})
        page.goto(path.as_uri())
        page.wait_for_function("window.symdyn && symdyn.stage.frames > 0")
        page.evaluate(_PLAY)
        page.wait_for_timeout(1000 * WARM)
        inside = page.context.new_cdp_session(page)
        inside.send("Performance.enable")
        before, begun = _state(page, inside), clock.perf_counter()
        page.wait_for_timeout(1000 * SPAN)
        after, span = _state(page, inside), clock.perf_counter() - begun
        browser.close()
    frames, drawing, script = max(after[0] - before[0], 1), after[1] - before[1], after[2] - before[2]
    by_process = {kind: spent - before[3].get(kind, 0.0) for kind, spent in after[3].items()}
    yield f"{name}: pictures a second, of at most 60", frames / span, "", ""
    if bound:
        yield f"{name}: positions, matrices and draw calls, a picture", drawing / frames, "ms", ""
        yield f"{name}: all JavaScript, a picture", 1000 * script / frames, "ms", ""
    for kind, what in (("renderer", "process of the page"), ("gpu-process", "drawing and putting the page together")):
        yield f"{name}: {what}, a picture", 1000 * by_process.get(kind, 0.0) / frames, "ms", ""
    whole = 1000 * sum(by_process.values()) / frames
    yield f"{name}: all processes, a picture", whole, "ms", f"< {bound:g}" if bound else ""


def _state(page: Any, inside: Any) -> tuple[int, float, float, dict[str, float]]:
    """Pictures so far, ms of the page's drawing, s of its scripts, and processor time of processes of the browser by kind, s."""
    frames, spent = page.evaluate("[symdyn.stage.frames, symdyn.stage.spent]")
    metrics = {one["name"]: one["value"] for one in inside.send("Performance.getMetrics")["metrics"]}
    return int(frames), float(spent), float(metrics["ScriptDuration"]), _processes()


def _processes() -> dict[str, float]:
    """Processor time, s, of the processes of Chromium that this one has started, by what they do."""
    children: dict[int, list[tuple[int, float, str]]] = {}
    for folder in Path("/proc").iterdir():
        if not folder.name.isdigit():
            continue
        try:
            stat, command = (folder / "stat").read_text(), (folder / "cmdline").read_text()
        except OSError:  # it has ended
            continue
        fields = stat[stat.rindex(")") + 2:].split()
        spent = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        words = command.replace("\0", " ").split()
        named = next((word.removeprefix("--type=") for word in words if word.startswith("--type=")), "")
        kind = named or ("browser" if words and "chrom" in words[0] else "")
        children.setdefault(int(fields[1]), []).append((int(folder.name), spent, kind))
    result: dict[str, float] = {}
    waiting = [os.getpid()]
    while waiting:
        for number, spent, kind in children.get(waiting.pop(), ()):
            waiting.append(number)
            if kind:
                result[kind] = result.get(kind, 0.0) + spent
    return result
