"""Sizes, switches and functions of a mechanism for the parts of the runtime in C."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from symdyn import thresholds as limits
from symdyn.backend import thresholds
from symdyn.backend.band import Band
from symdyn.backend.gathered import Gathered
from symdyn.backend.metadata import EventRecord
from symdyn.backend.methods import Method

# The functions that a projection calls, besides those that a method needs.
OF_PROJECTION = ("position_correction", "velocity_correction", "violation")
OF_EVENTS = ("events", "event_resets", "reset_directions")
# Functions of a run backwards, with weights in the place of ud.
OF_ADJOINT = ("rhs_weights", "corrected_weights")
# Functions of sensitivities: their part of a projection, the derivatives of events.
OF_COLUMNS = ("corrected_columns", "event_columns", "event_reset_columns")
# A function with the speeds after resets in the place of ud, behind the bounds that there are.
OF_CARRYING = ("carried_columns",)
# Functions of bounds, six of each leaf in the place of ud.
OF_BOUNDS = ("event_ranges", "event_bounds")
# From so many stages of a step on, its control takes hardly any of the time.
MANY_STAGES = 12


@dataclass(frozen=True)
class Integrated:
    """A function that the integrator calls: its name there, its own, its arguments; whether it reads inputs.

    bounded   whether it is called for bounds, at t and x else
    weighted  whether it is called at t and x with weights besides
    """

    called: str
    name: str
    call: str
    inputs: bool
    bounded: bool = False
    weighted: bool = False

    @property
    def signature(self) -> str:
        at = "const double *ud" if self.bounded else "double t, const double *x" + ", const double *ud" * self.weighted
        return f"int symdyn_{self.called}(const symdyn_problem *problem, {at}, double *out)"


@dataclass(frozen=True)
class Shape:
    """The facts that decide the text of an integrator besides its method.

    sizes      of the groups q, u, z, inputs
    n_rows     rows of the constraints, 0 without a projection
    events     see EventRecord
    leaves     what values at events are bounded by: 0 for t, then come x and the inputs
    directed   whether there are directions in which the constraints let entries of [q; u] be reset
    columns    of sensitivities, each as long as the state, which are the last entries of x
    carried    how many weights are carried back besides those of the state; None: there is no way back
    """

    sizes: Mapping[str, int]
    n_rows: int
    unit_groups: Sequence[Sequence[int]]
    events: Sequence[EventRecord]
    leaves: Sequence[int] = ()
    directed: bool = False
    columns: int = 0
    carried: int | None = None

    @property
    def n_x(self) -> int:
        return self.sizes["q"] + self.sizes["u"] + self.sizes["z"]

    @property
    def projects(self) -> bool:
        return self.n_rows > 0 or bool(self.unit_groups)

    @property
    def resets(self) -> list[int]:
        """The entries of x that events reset, of one event after the other."""
        return [index for event in self.events for index in event.reset]

    @property
    def most_events(self) -> int:
        """Number of events that may wait until they are taken."""
        return limits.most_events(len(self.events))

    @property
    def held(self) -> list[int]:
        """The entries of [q; u] that events reset and that stay when constraints are met, in order."""
        middle = self.sizes["q"] + self.sizes["u"]
        return sorted({index for index in self.resets if index < middle}) if self.n_rows and self.directed else []


def functions(needs: Sequence[str], arguments_of: Mapping[str, Sequence[str]], call: Callable[[str, str], str], n_in: int,
              projects: bool) -> list[Integrated]:
    """The functions that an integrator calls, of those that there are.

    needs   those that its method needs besides rhs
    call    (name, result) -> arguments of a call at t and x
    """
    names = ("rhs", *needs, *OF_EVENTS, *OF_COLUMNS, *(OF_PROJECTION if projects else ()))
    at = [Integrated("field" if name == "rhs" else f"{name}_at", name, call(name, "out"),
                     n_in > 0 and (name == "rhs" or "inputs" in arguments_of[name]))
          for name in names if name in arguments_of]
    at += [Integrated(f"{name}_at", name, call(name, "out"), n_in > 0 and "inputs" in arguments_of[name], False, True)
           for name in (*OF_ADJOINT, *OF_CARRYING) if name in arguments_of]
    return at + [Integrated(f"{name}_of", name, call(name, "out"), False, True) for name in OF_BOUNDS if name in arguments_of]


def sizes(method: Method, shape: Shape, gathered: Gathered) -> list[tuple[str, float]]:
    """Macros of the sizes and thresholds that the parts read, and of switches that they read as numbers.

    gathered   what the method's template gets besides
    """
    result: list[tuple[str, float]] = [("SYMDYN_NX", shape.n_x), ("SYMDYN_NQ", shape.sizes["q"]), ("SYMDYN_NU", shape.sizes["u"]),
              ("SYMDYN_NIN", shape.sizes["inputs"]), ("SYMDYN_ORDER", method.order),
              ("SYMDYN_SLOPE_AT_END", int(method.slope_at_end))]
    if method.tableau is not None:
        result.append(("SYMDYN_SECOND_ERROR", int(method.tableau.second is not None)))
    if gathered.second_order is not None:
        result.append(("SYMDYN_SECOND_ORDER", int(gathered.second_order)))
    if shape.columns:
        result.append(("SYMDYN_COLUMNS", shape.columns))
    if shape.carried is not None:
        result.append(("SYMDYN_CARRIED", shape.carried))
    if shape.columns and shape.held:
        result.append(("SYMDYN_BOUNDS", 6 * len(shape.leaves)))
    state = shape.n_x // (1 + shape.columns)
    if shape.columns or method.template == "radau":
        result.append(("SYMDYN_STATE", state))
    if method.template == "radau":
        result += _of_matrices(state, gathered.band)
    if shape.n_rows:
        result.append(("SYMDYN_ROWS", shape.n_rows))
    if shape.unit_groups:
        result += [("SYMDYN_UNIT_GROUPS", len(shape.unit_groups)), ("SYMDYN_UNIT_SIZE", max(map(len, shape.unit_groups)))]
    if shape.events:
        result += [("SYMDYN_N_EVENTS", len(shape.events)), ("SYMDYN_WAITING", limits.WAITING),
                   ("SYMDYN_NOTES", shape.most_events)]
    for name, entries in (("SYMDYN_RESETS", shape.resets), ("SYMDYN_HELD", shape.held), ("SYMDYN_LEAVES", shape.leaves)):
        if entries:
            result.append((name, len(entries)))
    result += thresholds.MOVES if shape.projects else ()
    result += thresholds.PROJECTIONS if shape.n_rows else ()
    result += thresholds.EVENTS if shape.events else ()
    result += thresholds.RESETS if shape.held else ()
    result += thresholds.PIVOTS if shape.events and (shape.held or shape.columns) else ()
    return result


def level_of_control(method: Method, shape: Shape) -> str:
    """Option of optimization for the unit that controls steps, the lowest at which runs are as fast; "": the usual one.

    With -O1 in place of -O2, runs of dop853 take at most 1.01 of their time, those of bs54, whose steps are shorter, 1.02, and
    those that look for events up to 1.1. Columns of sensitivities are long states, whose loops count.
    """
    if method.tableau is None:
        return ""
    plain = not shape.events and not shape.columns
    return "-O1" if method.tableau.n_stages >= MANY_STAGES and plain else "-O2"


def _of_matrices(state: int, band: Band | None) -> list[tuple[str, int]]:
    """Entries of the derivative of a state, rows that are eliminated with exchanges, numbers of their factors."""
    if band is None:
        return [("SYMDYN_ENTRIES", state**2), ("SYMDYN_BAND", state), ("SYMDYN_FACTORS", state**2)]
    return [("SYMDYN_ENTRIES", len(band.columns)), ("SYMDYN_BAND", band.size), ("SYMDYN_FACTORS", band.factors),
            ("SYMDYN_REDUCED", band.reduced), ("SYMDYN_LOWER", band.lower), ("SYMDYN_UPPER", band.upper)]


def switches(method: Method, shape: Shape, gathered: Gathered, threads: bool, single: bool = False) -> dict[str, bool]:
    """Macros by which parts are left out.

    gathered   what the method's template gets besides
    threads    whether there is a kernel that integrates many motions by a thread each
    single     whether the text becomes one of single precision
    """
    tableau = method.tableau
    return {"SYMDYN_EXPLICIT": tableau is not None, "SYMDYN_RADAU": method.template == "radau",
            "SYMDYN_BANDED": gathered.band is not None,
            "SYMDYN_GAUSS": method.template == "gauss", "SYMDYN_TAYLOR": method.template == "taylor",
            "SYMDYN_OWN_STEP": method.own_step, "SYMDYN_SLOPE_AT_END": method.slope_at_end,
            "SYMDYN_ORDER_8": method.order == 8,
            "SYMDYN_SECOND_ERROR": tableau is not None and tableau.second is not None,
            "SYMDYN_DENSE_STAGES": tableau is not None and bool(tableau.dense_stages),
            "SYMDYN_SECOND_ORDER": bool(gathered.second_order), "SYMDYN_UNROLLED": gathered.unrolled,
            "SYMDYN_CROSSES": method.crosses and shape.projects, "SYMDYN_PROJECTS": shape.projects,
            "SYMDYN_SENSITIVE": shape.columns > 0, "SYMDYN_BACKWARD": shape.carried is not None,
            "SYMDYN_HAS_CONSTRAINTS": shape.n_rows > 0, "SYMDYN_HAS_UNIT_GROUPS": bool(shape.unit_groups),
            "SYMDYN_HAS_INPUTS": shape.sizes["inputs"] > 0, "SYMDYN_EVENTS": bool(shape.events),
            "SYMDYN_HAS_RESETS": bool(shape.resets), "SYMDYN_KEEPS_RESETS": bool(shape.held),
            "SYMDYN_HAS_BOUNDS": bool(shape.leaves), "SYMDYN_BOUNDED_INPUTS": any(k > shape.n_x for k in shape.leaves),
            "SYMDYN_THREADS": threads, "SYMDYN_SINGLE": single}
