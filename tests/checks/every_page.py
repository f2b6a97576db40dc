"""Every page of a built site in Chromium: what is requested and reported, what is too wide, what cannot be read or reached.

python -m sphinx -W -b html docs generated/site && python tests/checks/every_page.py generated/site

Views of mechanisms and motions, which pages embed, are opened by themselves as well. Ends with 1 and a line for each fault.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.helpers import CONTRAST, browser

# As wide as screens, with and without the contents of a page at its side, and as a telephone.
WIDTHS = 1400, 1280, 1100, 400
HEIGHT = 900
# Text of a page that reaches beyond its column, and boxes that cut what they hold; headings and boxes of tables reach
# half a rem beyond it in this theme. Content that scrolls within a box is seen.
WIDER = """() => {
    const column = document.querySelector(".content"), html = "http://www.w3.org/1999/xhtml";
    const right = column ? column.getBoundingClientRect().right + 9 : innerWidth;
    const scrolls = e => e && e !== document.body
        && (/auto|scroll/.test(getComputedStyle(e).overflowX) || scrolls(e.parentElement));
    return [...(column || document.body).querySelectorAll("*")].filter(e => e.checkVisibility({ visibilityProperty: true })
        && e.namespaceURI === html && (
            (e.getBoundingClientRect().right > right && !e.closest(".toc-drawer") && !scrolls(e.parentElement))
            || (/hidden|clip/.test(getComputedStyle(e).overflowX) && e.clientWidth && e.scrollWidth > e.clientWidth + 1)
        )).map(e => `${e.tagName}.${e.className}: ${e.textContent.trim().slice(0, 40)}`);
}"""
# Elements that the keyboard should reach, and a list of those that it has reached without an outline.
LISTEN = """() => {
    window.reached = new Set();
    window.unseen = new Set();
    window.reachable = [...document.querySelectorAll("a[href], button, input, select, summary, iframe, [tabindex]")].filter(
        e => e.checkVisibility({ visibilityProperty: true }) && e.tabIndex >= 0 && !e.disabled);
    window.arrive = e => {
        reached.add(e);
        if (e.tagName !== "IFRAME" && getComputedStyle(e).outlineStyle === "none") unseen.add(e);
    };
    document.addEventListener("focusin", event => arrive(event.target));
    return reachable.length;
}"""
# Keys that are pressed before it is looked whether all is reached; stops at most that are none of these elements, in a page and
# in each view that it embeds: boxes that scroll, what a view has.
BATCH, MORE, IN_VIEW = 60, 150, 200
NOT_REACHED, UNSEEN = "reachable.filter(e => !reached.has(e))", "[...unseen].filter(e => reachable.includes(e))"


class CheckedPage:
    """A page with all that it requests and reports; faults of one document after the other."""

    def __init__(self, browser: Any, **options: Any) -> None:
        self.page = browser.new_page(viewport={"width": WIDTHS[0], "height": HEIGHT}, **options)
        self._asked: list[str] = []
        self._said: list[str] = []
        self.page.on("request", lambda request: self._asked.append(request.url))
        self.page.on("console", lambda message: self._said.append(message.text))
        self.page.on("pageerror", lambda error: self._said.append(str(error)))

    def open(self, file: Path) -> Iterator[str]:
        """Faults by opening it: requests beyond the disk, messages on the console."""
        self._asked.clear()
        self._said.clear()
        self.page.goto(file.as_uri())
        yield from self.said()

    def said(self) -> Iterator[str]:
        yield from (f"requested: {url}" for url in self._asked if not url.startswith(("file:", "data:", "blob:")))
        yield from (f"on the console: {text}" for text in self._said)

    def wider(self) -> Iterator[str]:
        """In each width what is wider than its box, or than the window."""
        for width in WIDTHS:
            self.page.set_viewport_size({"width": width, "height": HEIGHT})
            if self.page.evaluate("document.documentElement.scrollWidth") > width:
                yield f"wider than a window of {width} pixels"
            yield from (f"wider than its box in a window of {width} pixels: {one}" for one in self.page.evaluate(WIDER))
        self.page.set_viewport_size({"width": WIDTHS[0], "height": HEIGHT})

    def unreadable(self) -> Iterator[str]:
        """Text below the contrast AA in the light and in the dark theme."""
        for theme in ("light", "dark"):
            self.page.evaluate("theme => { document.body.dataset.theme = theme; }", theme)
            yield from (f"contrast in the {theme} theme: {one}" for one in self.page.evaluate(CONTRAST))

    def unreached(self) -> Iterator[str]:
        """Elements that Tab does not reach in a cycle, or without an outline."""
        count = self.page.evaluate(LISTEN)
        views = self.page.evaluate("document.querySelectorAll('iframe').length")
        for k in range(count + MORE + IN_VIEW * views):
            self.page.keyboard.press("Tab")
            if views:  # which take the focus without an event
                self.page.evaluate("arrive(document.activeElement)")
            if k > count and k % BATCH == 0 and not self.page.evaluate(f"{NOT_REACHED}.length"):
                break
        for what, faulty in (("not reached by Tab", NOT_REACHED), ("without an outline", UNSEEN)):
            yield from (f"{what}: {one}" for one in self.page.evaluate(f"{faulty}.map(e => e.outerHTML.slice(0, 120))"))

    def blank(self) -> Iterator[str]:
        """A view of a mechanism in which nothing is drawn."""
        self.page.wait_for_function("window.symdyn && symdyn.stage.frames > 0", timeout=30_000)
        if self.page.evaluate(COLORS) < 4:
            yield "the picture is blank"


# Faults of the picture of a view.
COLORS = """() => { const { stage } = symdyn, { canvas, renderer } = stage, gl = renderer.gl;
    stage.draw(false);
    const p = new Uint8Array(4 * canvas.width * canvas.height);
    gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, p);
    return new Set(new Uint32Array(p.buffer)).size; }"""


def pages(site: Path) -> list[Path]:
    return sorted(page for page in site.rglob("*.html") if "_static" not in page.parts)


def faults(checked: CheckedPage, file: Path) -> Iterator[str]:
    """Faults of a page of text."""
    yield from checked.open(file)
    yield from checked.wider()
    yield from checked.unreadable()
    yield from checked.unreached()


def faults_of_view(checked: CheckedPage, file: Path) -> Iterator[str]:
    yield from checked.open(file)
    yield from checked.blank()
    if checked.page.evaluate("document.documentElement.scrollWidth > innerWidth"):
        yield "wider than the window"
    yield from (f"contrast: {one}" for one in checked.page.evaluate(CONTRAST))
    yield from checked.unreached()
    yield from checked.said()


def main(site: Path) -> int:
    found, begun = 0, time.perf_counter()
    listed = [(file, faults) for file in pages(site)] + [(file, faults_of_view) for file in sorted(site.glob("_static/*.html"))]
    with browser() as opened:
        checked = CheckedPage(opened)
        for file, look in listed:
            for fault in look(checked, file):
                print(f"{file.relative_to(site)}: {fault}", flush=True)
                found += 1
    print(f"{len(listed)} pages opened, {found} faults, {time.perf_counter() - begun:.0f} s")
    return found > 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
