"""Taylor series of the solution, of an order that follows the tolerance."""

from symdyn.backend.methods.record import Method
from symdyn.backend.series import gather_series

TAYLOR = Method(
    "taylor", "Taylor series by recurrences: order by the tolerance, step by the last two coefficients", 20, "taylor",
    ("A. Jorba, M. Zou, A software package for the numerical integration of ODEs by means of high-order Taylor methods,",
     "Experimental Mathematics 14 (2005) 99-117; F. Biscani, D. Izzo, Revisiting high-order Taylor methods for astrodynamics",
     "and celestial mechanics, Monthly Notices of the Royal Astronomical Society 504 (2021) 2614-2628."),
    own_step=True, gather=gather_series, gives_slope=True)
