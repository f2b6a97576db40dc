"""Cost of a picture of a page: the command measures, and reports what it needs."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from symdyn.errors import MissingExtra, SymdynError
from symdyn.lab import pages


@pytest.mark.usefixtures("chromium")  # skipped where there is none
def test_pictures_and_processor_time_are_counted(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """In a thread of its own, as there may be one browser in each."""
    monkeypatch.setattr(pages, "WARM", 0.3)
    monkeypatch.setattr(pages, "SPAN", 0.7)
    monkeypatch.setattr(pages, "GROUPS", (pages.empty,))
    with ThreadPoolExecutor(1) as one:
        assert one.submit(pages.run).result() == 0
    lines = capsys.readouterr().out.splitlines()
    numbers = {line.split(":")[1].split("  ")[0].strip(): float(line.removesuffix(" ms").split()[-1]) for line in lines}
    assert 0 < numbers["pictures a second, of at most 60"] < 75
    parts = [numbers[name] for name in ("process of the page, a picture", "drawing and putting the page together, a picture")]
    assert min(parts) > 0 and sum(parts) <= numbers["all processes, a picture"] * 1.01 < 1000


def test_what_is_missing_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("playwright")
    monkeypatch.setattr("shutil.which", lambda _: None)
    with pytest.raises(SymdynError, match="in Chromium on Linux, by its processes in /proc; there is no Chromium"):
        pages.run()
    monkeypatch.setitem(sys.modules, "playwright.sync_api", None)
    with pytest.raises(MissingExtra, match="pages are measured through Playwright: pip install playwright"):
        pages.run()
