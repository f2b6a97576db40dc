"""Methods of integration that the C templates know: one record each, a tableau as data."""

from symdyn.backend.methods.bs54 import BS54
from symdyn.backend.methods.dop853 import DOP853
from symdyn.backend.methods.gauss import GAUSS
from symdyn.backend.methods.radau import RADAU, RADAU5
from symdyn.backend.methods.record import Method, Tableau
from symdyn.backend.methods.taylor import TAYLOR
from symdyn.backend.packed import NAME as PACKED
from symdyn.errors import SymdynError
from symdyn.shown import shown

METHODS = {method.name: method for method in (DOP853, BS54, GAUSS, TAYLOR, RADAU, RADAU5)}

__all__ = ["METHODS", "Method", "Tableau", "method_of", "needs_of"]


def method_of(name: str) -> Method:
    """The method of this name; raises SymdynError for one that there is not."""
    if not isinstance(name, str) or name not in METHODS:
        raise SymdynError(f"there is no compiled method {shown(name)}; there are {', '.join(METHODS)}")
    return METHODS[name]


def needs_of(method: Method, banded: bool) -> tuple[str, ...]:
    """The functions besides rhs that a method needs; of a banded derivative the entries that may differ from zero."""
    return tuple(PACKED if banded and name == "jacobian_x" else name for name in method.needs)
