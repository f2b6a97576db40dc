"""Pictures of a motion: curves over time, and the moving bodies. No display is needed; pyplot's state is not touched.

Bodies are drawn as lines through the points of their joints and those that are outputs. Where a module does not give the
joints, a tree of them is found in the motion itself, so that every mechanism can be drawn whose module gives frames or
centres of mass.
"""

from __future__ import annotations

from symdyn.errors import MissingExtra

try:
    from symdyn.pictures.animation import animate
    from symdyn.pictures.plotting import plot
    from symdyn.pictures.still import picture
except ImportError as error:
    raise MissingExtra(f"pictures need matplotlib: pip install 'symdyn[plot]' ({error})") from None

__all__ = ["animate", "picture", "plot"]
