"""Taylor series of the solution, of an order that follows the tolerance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from symdyn.backend.gathered import Gathered
from symdyn.backend.methods.record import Method

if TYPE_CHECKING:
    from symdyn.backend.dialect import Dialect
    from symdyn.backend.program import Program
    from symdyn.backend.source import Content


def _gather(content: Content, program: Program, dialect: Dialect, leaves: Mapping[str, tuple[str, int]]) -> Gathered:
    """The series, whose code is loaded where it is generated: runs read the records of methods, and need no SymPy."""
    from symdyn.backend.series import gather_series

    return gather_series(content, program, dialect, leaves)


TAYLOR = Method(
    "taylor", "Taylor series by recurrences: order by the tolerance, step by the last two coefficients", 20, "taylor",
    ("A. Jorba, M. Zou, A software package for the numerical integration of ODEs by means of high-order Taylor methods,",
     "Experimental Mathematics 14 (2005) 99-117; F. Biscani, D. Izzo, Revisiting high-order Taylor methods for astrodynamics",
     "and celestial mechanics, Monthly Notices of the Royal Astronomical Society 504 (2021) 2614-2628."),
    own_step=True, gather=_gather, gives_slope=True)
