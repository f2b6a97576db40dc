"""Pages with a mechanism or a motion that turns, zooms and moves: one HTML file each, which needs no network."""

from __future__ import annotations

from symdyn.viewer.live import show
from symdyn.viewer.page import View
from symdyn.viewer.recorded import view

__all__ = ["View", "show", "view"]
