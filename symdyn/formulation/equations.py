"""Results of every formulation: quantities by name, recorded when requested, printed by expanding their tape."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
import sympy as sp

from symdyn.collector import collector_paused
from symdyn.counting import counted
from symdyn.errors import ArgumentError, SymdynError
from symdyn.facade import EquationsFacade
from symdyn.formulation.names import output_quantity
from symdyn.kinds import flag, text
from symdyn.shown import shown
from symdyn.tape.node import ACCELERATION, Node
from symdyn.tape.recorder import Recorder
from symdyn.tape.sympy_bridge import expand
from symdyn.tape.tape import Tape

# A quantity of more operations is not written out where it is too large for exact algebra.
_UNREADABLE = 50_000

if TYPE_CHECKING:
    from symdyn.report.named import Step


def _derived_again(again: Callable[[], Equations], simplify_seconds: float, candidates: Sequence[Any]) -> Equations:
    return replace(again(), simplify_seconds=simplify_seconds, candidates=candidates)


@dataclass(frozen=True)
class Symbols:
    """The symbols of the equations, in the order of the generated code's arguments, with numbers and units.

    reach   how far from zero a coordinate may sensibly be, where it must stay small: elastic ones
    masses  parameters that stand alone as the mass of a body, with the name of one; point_units: outputs that are points
    """

    coordinates: tuple[sp.Symbol, ...]
    speeds: tuple[sp.Symbol, ...]
    states: tuple[sp.Symbol, ...]
    inputs: tuple[sp.Symbol, ...]
    parameters: tuple[sp.Symbol, ...]
    defaults: Mapping[sp.Symbol, float] = field(default_factory=dict)
    initial: Mapping[sp.Symbol, float] = field(default_factory=dict)
    units: Mapping[sp.Symbol, str] = field(default_factory=dict)
    duration: float = 10.0
    reach: Mapping[sp.Symbol, float] = field(default_factory=dict)
    masses: Mapping[sp.Symbol, str] = field(default_factory=dict)
    point_units: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Equations(EquationsFacade):
    """Equations of motion whose quantities are recorded on one tape when they are requested.

    name         of the mechanism; formulation: how it was derived
    leaves       symbol -> leaf of the tape
    quantities   name -> function that records it; planar: 3 rows a body instead of 6
    notes        what the formulation left out, and why
    implicit_loads   labels of loads that depend on accelerations, multipliers or reactions; of_reactions: outputs and rates of
                     states that depend on multipliers or reactions, in words
    unit_groups  coordinates that form a unit vector (Euler parameters)
    charts       of Euler angles: joint, sequence, kind of speeds, coordinate of the second angle
    again        derives the same equations on a new tape, so that files do not depend on what was recorded before
    frames       axes that quantities are formed in: "body", or "parallel" where links keep those of the link before
    candidates   what this formulation was chosen from, if it was chosen (symdyn.choice)
    constraints  names of the constraint rows; holonomic: whether each holds positions; bodies: names
    joints       of those in `reactions`: name, parent, child, kind
    singular_fallback   the same on the same tape for states where what the quantities divide by vanishes (dependent constraints)
    drawn        what bodies look like, as plain data; None stands in it for the entries of the quantity drawn_lengths, in order
    surroundings what contacts touch and how mooring lines hang, likewise: their entries come after those of `drawn`
    down         direction of gravity, zero where there is none
    connections  loads along the line between two points: name, the two bodies, kind (spring, damper, both, force, line, rope)
    acting       forces and torques of loads on bodies, in the order of the quantity applied_loads: name, body, kind
    flexible     how flexible bodies bend, as plain data
    validity_checks   gives ranges of validity of loads, in the order of the quantity validity_checks
    events       what is looked for along a motion (see model.event), in the order of the quantity events
    contacts     rigid ones, place by place (see model.contacts.lowering); compliant: likewise
    contact_groups   those whose pairs are found along a motion
    identification   what records regressors and base parameters; None without bodies
    provenance       what records contributions of bodies (see formulation.provenance); None where there are none

    >>> equations = sd.systems.pendulum().embedding()
    >>> equations.name, equations.formulation
    ('pendulum', 'embedding')
    >>> equations.M_tilde
    Matrix([[l**2*m]])
    """

    name: str
    formulation: str
    planar: bool
    symbols: Symbols
    recorder: Recorder
    leaves: Mapping[sp.Basic, Any]
    quantities: Mapping[str, Callable[[], Any]]
    notes: tuple[str, ...] = ()
    unit_groups: tuple[tuple[sp.Symbol, ...], ...] = ()
    charts: tuple[tuple[str, str, str, str], ...] = field(default=(), kw_only=True)
    implicit_loads: tuple[str, ...] = field(default=(), kw_only=True)
    of_reactions: tuple[str, ...] = field(default=(), kw_only=True)
    again: Callable[[], Equations] | None = None
    simplify_seconds: float = 10.0
    frames: str = "body"
    candidates: Sequence[Any] = ()
    constraints: tuple[str, ...] = ()
    holonomic: tuple[bool, ...] = ()
    bodies: tuple[str, ...] = ()
    joints: tuple[tuple[str, str, str, str], ...] = ()
    singular_fallback: Equations | None = None
    drawn: tuple[Mapping[str, Any], ...] = ()
    surroundings: tuple[Mapping[str, Any], ...] = ()
    flexible: tuple[Mapping[str, Any], ...] = ()
    connections: tuple[tuple[str, str, str, str], ...] = ()
    acting: tuple[tuple[str, str, str], ...] = ()
    down: tuple[float, float, float] = (0.0, 0.0, 0.0)
    validity_checks: Callable[[], Sequence[Any]] = tuple
    events: tuple[Any, ...] = ()
    contacts: tuple[Any, ...] = ()
    compliant: tuple[Any, ...] = ()
    contact_groups: tuple[Any, ...] = ()
    identification: Any = None
    provenance: Any = None
    _recorded: dict[str, np.ndarray] = field(default_factory=dict)
    _printed: dict[tuple[str, str], Any] = field(default_factory=dict)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled, and copied, by what they are derived from: the copy is derived again on a tape of its own."""
        if self.again is None:
            raise SymdynError(f"{self.name}: these equations were put together by hand, without what they are derived from, and "
                              "cannot be pickled or copied; pickle the description and derive them there")
        return _derived_again, (self.again, self.simplify_seconds, tuple(self.candidates))

    def quantity(self, name: str) -> np.ndarray:
        """A quantity, or a named output, as an array of nodes and numbers; recorded on first use.

        Besides `quantities` there are those of symdyn.analytic.lagrange.QUANTITIES, such as "T", "V", "momenta".

        >>> equations = sd.systems.pendulum().embedding()
        >>> equations.quantity("M_tilde").shape
        (1, 1)
        """
        text(name, "the name of a quantity", "M_tilde")
        if name not in self.quantities and output_quantity(name) in self.quantities:
            name = output_quantity(name)
        if name not in self._recorded and name not in self.quantities:
            from symdyn.analytic.lagrange import QUANTITIES, recorded

            if name in QUANTITIES:
                self._recorded[name] = np.asarray(recorded(self, name), dtype=object)
        if name not in self._recorded:
            if name not in self.quantities:
                reason = "".join(f": {note}" for note in self.notes
                                 if note.startswith("no ") and name.partition("_")[0].lower() in note.lower())
                raise SymdynError(f"{self.name} ({self.formulation}) has no quantity {shown(name)}{reason}; it has "
                                  f"{', '.join((*self.quantities, *QUANTITIES))}")
            self._recorded[name] = np.asarray(self.quantities[name](), dtype=object)
        return self._recorded[name]

    def tape(self, *names: str) -> Tape:
        """A tape with the named quantities as outputs.

        >>> equations = sd.systems.pendulum().embedding()
        >>> equations.tape("M_tilde").operations
        0
        """
        return Tape.of(self.recorder, **{name: self.quantity(name) for name in names})

    @overload
    def explicit(self, name: str, simplify: bool = True, form: str = "shortest", intermediates: Literal[False] = False,
                 on_constraints: bool = False) -> sp.Matrix | sp.Expr: ...

    @overload
    def explicit(self, name: str, simplify: bool = True, form: str = "shortest", *, intermediates: Literal[True],
                 on_constraints: bool = False) -> tuple[sp.Matrix | sp.Expr, list[Step]]: ...

    def explicit(self, name: str, simplify: bool = True, form: str = "shortest", intermediates: bool = False,
                 on_constraints: bool = False) -> sp.Matrix | sp.Expr | tuple[sp.Matrix | sp.Expr, list[Step]]:
        """The quantity as explicit SymPy in its shortest form, by exact algebra (symdyn.exact).

        simplify   False: as it was derived, in any time that this takes
        form       "shortest": of all others, entry by entry; "polynomial" in sines and cosines; "fourier": sums of sines and
                   cosines of sums of angles; "factored"; "speeds", "parameters", "angles": gathered by these; "nested"
        intermediates   True: the quantity in named intermediates, and the list of these: (symbol, expression, meaning, unit),
                   constants of the mechanism first, then sines and cosines, then what stands in several places
        on_constraints  True: made shorter by C = 0 and its rate; it equals the quantity where these hold
        A quantity too large for exact algebra as a whole is written entry by entry, entries too large alone as they were
        derived; nothing depends on time. Raises SymdynError for an unknown form, for one that is too large, and for a quantity
        that is too large to be read; ArgumentError for a form of what has none, and for constraints where there are none.

        >>> equations = sd.systems.pendulum().embedding()
        >>> equations.explicit("k_tilde", form="polynomial")
        Matrix([[0]])
        """
        text(name, "the name of a quantity", "M_tilde")
        flag(intermediates, "intermediates"), flag(simplify, "simplify"), flag(on_constraints, "on_constraints")
        asked = [what for what, wanted in (("intermediates=True", intermediates), ("simplify=False", not simplify),
                                           ("on_constraints=True", on_constraints)) if wanted]
        if text(form, "the form", "fourier") != "shortest" and asked:
            raise ArgumentError(f"{self.name}: the form {form!r} of {name} was asked for, together with {asked[0]}; take one "
                                "of them")
        if on_constraints and len(asked) > 1:
            raise ArgumentError(f"{self.name}: {name} was asked for on the constraints, together with {asked[0]}; take one of "
                                "them")
        if intermediates:
            return self._in_intermediates(name)
        if not simplify:
            return expand(self.tape(name).outputs[name], self.printed_leaves())
        key = (name, "on constraints" if on_constraints else form)
        if key not in self._printed:
            from symdyn.exact.ring import TooLarge
            from symdyn.exact.shortest import apart, explicit, written_out

            output = self.tape(name).outputs[name]
            zeros = self._vanishing() if on_constraints else ()
            try:
                with collector_paused():
                    units = [[self.leaves[p] for p in group] for group in self.unit_groups]
                    self._printed[key] = explicit(output, self.printed_leaves(), form, zeros, units)
            except (TooLarge, ZeroDivisionError) as error:
                if form != "shortest":
                    raise SymdynError(f"{self.name}: {name} is too large for the form {shown(form)}: {error}; print its steps "
                                      f"with latex({name!r}, intermediates=True), or as derived with explicit({name!r}, "
                                      "simplify=False)") from None
                sizes = written_out(output.entries)
                operations = sum(sizes.get(e, 0) for e in output.entries if isinstance(e, Node))
                if operations > _UNREADABLE:
                    raise SymdynError(
                        f"{self.name}: {name} is too large to be read: {error}, and {operations:,} operations as it was derived; "
                        f"ask for named intermediates with explicit({name!r}, intermediates=True), print its steps with "
                        f"latex({name!r}, intermediates=True), evaluate it with lambdify({name!r}), or take it as derived with "
                        f"explicit({name!r}, simplify=False)") from None
                self._printed[key] = apart(output, self.printed_leaves(), zeros)
        return self._printed[key]

    def _vanishing(self) -> list[Any]:
        """Quantities that are zero where the constraints hold: C, its rate, the norm of Euler parameters less one."""
        if not self.constraints:
            raise ArgumentError(f"{self.name} ({self.formulation}) has no constraints that a quantity could be written on; leave "
                                "out on_constraints")
        units = [sum((self.leaves[p] * self.leaves[p] for p in group), -1) for group in self.unit_groups]
        positions = [e for e, holonomic in zip(self.quantity("C"), self.holonomic, strict=True) if holonomic]
        return [e for e in (*positions, *self.quantity("C_dot"), *units) if isinstance(e, Node)]

    def _in_intermediates(self, name: str) -> Any:
        """The quantity in named intermediates, and these."""
        from symdyn.analytic.lagrange import by_steps
        from symdyn.analytic.units import symbol_units
        from symdyn.exact.ring import TooLarge
        from symdyn.report.named import with_intermediates
        from symdyn.tape.tape import Output

        key = (name, "intermediates")
        if key not in self._printed:
            factored = by_steps(self, name)
            output = self.tape(name).outputs[name] if factored is None else Output.of(name, factored)
            try:
                self._printed[key] = with_intermediates(output, self.printed_leaves(), self.recorder.names,
                                                        self._base(), symbol_units(self))
            except (TooLarge, ZeroDivisionError) as error:
                raise SymdynError(f"{self.name}: {name} is too large for named intermediates: {error}; print its steps with "
                                  f"latex({name!r}, intermediates=True)") from None
        return self._printed[key]

    def _base(self) -> dict[str, Any]:
        """Base parameters by name, nodes and numbers; none where there are no rigid bodies."""
        if self.identification is None or "base_parameters" not in self.quantities:
            return {}
        return dict(zip(self.identification.base.names, self.quantity("base_parameters").tolist(), strict=True))

    def printed_leaves(self) -> dict[Node, sp.Basic]:
        """Leaf of the tape -> the symbol it is printed as: its own, where others stand for the same value.

        A speed u with a name of its own is the derivative of its coordinate, too, and is printed as u.

        >>> equations = sd.systems.pendulum().embedding()
        >>> len(equations.printed_leaves())
        8
        """
        from symdyn.analytic.lagrange import momentum_leaves

        printed: dict[Node, sp.Basic] = {}
        for symbol, leaf in self.leaves.items():
            if isinstance(leaf, Node) and leaf.op == "leaf" and (leaf not in printed or symbol.name == leaf.args[1]):
                printed[leaf] = symbol
        for u in self.symbols.speeds:
            printed.setdefault(self.recorder.leaf(f"{u.name}_dot", ACCELERATION), u.dot)
        return {**printed, **momentum_leaves(self)}

    @property
    def accelerations(self) -> sp.Matrix:
        """Symbols of the derivatives of the speeds, (n_u, 1).

        >>> equations = sd.systems.pendulum().embedding()
        >>> equations.accelerations
        Matrix([[q1_ddot]])
        """
        return sp.Matrix(len(self.symbols.speeds), 1, [u.dot for u in self.symbols.speeds])

    def __repr__(self) -> str:
        s = self.symbols
        rows = f", {counted(len(self.constraints), 'constraint')}" if self.constraints else ""
        return (f"<{self.formulation} equations of {self.name}: {counted(len(s.coordinates), 'coordinate')}, "
                f"{counted(len(s.speeds), 'speed')}{rows}>")
