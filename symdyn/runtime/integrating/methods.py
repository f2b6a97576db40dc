"""The compiled methods of integration by name, what each needs and does not do, and the units that hold them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeGuard

from symdyn.backend.methods import METHODS
from symdyn.backend.right_side import METHOD
from symdyn.errors import ArgumentError
from symdyn.runtime.inputs.inputs import Inputs
from symdyn.runtime.integrating.outcome import Request
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

DEFAULT, SERIES = METHOD, "taylor"
# Tolerances are no smaller than doubles resolve: with less, no step would ever be good enough.
SMALLEST_RTOL = 1e-15
# Bytes of the matrices of an implicit method beyond which a factorization takes minutes.
LARGEST_MATRICES = 2**29


@dataclass(frozen=True)
class CompiledMethod:
    """A method of the C backend.

    unfit    why it does not take a module or inputs, with what to use instead; empty if it does
    kinked   what tolerances are multiplied by where functions of inputs may have kinks, which its estimate of errors underrates
    """

    name: str
    unfit: Callable[[Module, Inputs | None], str] = lambda module, inputs: ""
    kinked: float = 1.0

    @property
    def needs(self) -> tuple[str, ...]:
        """Functions that the module must have."""
        return METHODS[self.name].needs


def _constrained(module: Module) -> str:
    """Steps that are projected onto constraints are not symmetric: energy would drift as with any other method."""
    names = module.metadata.constraints
    if not names:
        return ""
    return (f"it keeps energy by its symmetry, which corrections back onto constraints ({', '.join(names[:3])}"
            f"{', ...' if len(names) > 3 else ''}) take away; use method='dop853', which is projected, with a tight rtol, or "
            "coordinates that need no constraints")


def _switching(module: Module, so: str) -> str:
    """Why steps of high order go wrong without a sign of it, and what follows, `so`; empty if the right-hand side is smooth."""
    reason = module.metadata.not_smooth
    return f"{reason}, {so}; use method='{DEFAULT}'" if reason else ""


def _not_expanded(module: Module, inputs: Inputs | None) -> str:
    """Recurrences need a right-hand side, and inputs, that are smooth along a step."""
    if inputs is not None and (inputs.function is not None or inputs.pieces is not None):
        return f"inputs that vary have no Taylor series; use method='{DEFAULT}', or write them as expressions of the time t"
    return _switching(module, "and has no Taylor series there")


def _not_collocated(module: Module, inputs: Inputs | None) -> str:
    """Constant steps do not end at kinks and see few of them; tables have kinks at their times, functions are smooth if they are
    declared to be."""
    if inputs is not None and inputs.has_kinks:
        return (f"inputs by a table have a kink at each of its times, which constant steps go across; use method='{DEFAULT}', "
                "a smooth function of t and x, sd.Smooth(function), or expressions of the time t")
    if inputs is not None and inputs.may_have_kinks:
        return (f"an input by a function may jump or have kinks, which constant steps go across; use method='{DEFAULT}', 'bs54', "
                "'radau' or 'radau5', whose steps get shorter there, or declare a function that is smooth along the motion: "
                "sd.Smooth(function)")
    return _constrained(module) or _switching(module, "where it may have kinks, which constant steps go across")


def _implicit(stages: int) -> Callable[[Module, Inputs | None], str]:
    """Whether the matrices of a compiled implicit method are too large: that of the derivative, and a real and an imaginary part
    for each two stages."""

    def unfit(module: Module, inputs: Inputs | None) -> str:
        n = module.metadata.sizes.x
        size = 8 * n**2 * (stages + 2)
        if size <= LARGEST_MATRICES:
            return ""
        there = module.jacobian_indices()
        if there is not None and there.band.pays:
            size = 8 * (there.band.factors * (stages + 1) + len(there.rows))
            if size <= LARGEST_MATRICES:
                return ""
        instead = ("'Radau' of SciPy, whose factors have few entries here" if there is not None and there.sparse else
                   f"'{DEFAULT}', or masses joined by springs and dampers alone, which have banded matrices, in place of joints")
        return f"its matrices of {n} states take {size / 2**30:.1f} GiB; use method={instead}"

    return unfit


# Those that do not take every module or input, or need tighter tolerances.
_PARTICULAR = (
    CompiledMethod("gauss", _not_collocated), CompiledMethod(SERIES, _not_expanded),
    # Only 10 r^(1/4) of its estimate counts, r as rtol: at kinks errors were up to 25 times those of DEFAULT, with r/100 not.
    CompiledMethod("radau", _implicit(5), kinked=0.01), CompiledMethod("radau5", _implicit(3), kinked=0.01),
)
COMPILED = {name: CompiledMethod(name) for name in METHODS} | {m.name: m for m in _PARTICULAR}


def with_own_tolerances(request: Request, method: str) -> Request:
    """The request with the tolerances that a compiled method needs for its inputs."""
    part = COMPILED[method].kinked if request.inputs.may_have_kinks else 1.0
    return request if part == 1.0 else replace(request, rtol=max(part * request.rtol, SMALLEST_RTOL), atol=part * request.atol)


def unfit(module: Module, method: str, inputs: Inputs | None) -> str:
    """Why a compiled method does not take a module, or inputs (None: constants), with what to use instead; "" if it does."""
    record = COMPILED[method]
    missing = [n for n in record.needs if n not in module.metadata.functions]
    return f"its equations have no {', '.join(missing)}; use method='{DEFAULT}'" if missing else record.unfit(module, inputs)


def factors_of(module: Module, method: object, way: str) -> str:
    """Factorization of the matrices of an implicit method, in words; "" for other methods.

    way   of stabilization: Baumgarte's changes the derivative
    """
    compiled = is_compiled(method) and "jacobian_x" in COMPILED[method].needs
    if not compiled and not (isinstance(method, str) and method in ("Radau", "BDF")):
        return ""
    there = module.jacobian_indices() if way != "baumgarte" else None
    if there is not None and compiled and there.band.pays:
        band = there.band
        return f"banded: {band.size} of {there.n} states, {band.lower} diagonals below and {band.upper} above the main one"
    if there is not None and not compiled and there.sparse:
        return f"sparse: {there.n} states, {len(there.rows)} entries of the derivative"
    return f"dense: {module.metadata.sizes.x} states"


def is_compiled(method: object) -> TypeGuard[str]:
    return isinstance(method, str) and method in COMPILED


def check_compiled(module: Module, inputs: Inputs | None, method: str) -> None:
    """Raises ArgumentError where a compiled method does not fit, with the reason and what to use instead."""
    if module.backend != "c":
        instead = "'Radau'" if method.startswith("radau") else "'DOP853'"
        raise ArgumentError(f"{module.name}: the compiled integrator {shown(method)} needs the C backend; this module "
                            f"runs on {module.backend}. Use method={instead} of SciPy, or compile(backend='c')")
    why = unfit(module, method, inputs)
    if why:
        raise ArgumentError(f"{module.name}: method {shown(method)} does not fit: {why}")
