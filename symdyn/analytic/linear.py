"""Linear equations about a state of rest or a steady motion, explicit in the parameters.

M eta_ddot + C eta_dot + K eta = F_in in', with eta the changes of independent coordinates from the state: derivatives of what the
equations make zero, r = M_tilde u_dot + k_tilde - F_tilde + C_r^T lam, on the tape, by exact rules. The state is an equilibrium
where the conditions hold; M, C, K are those of a linearization where they do. Constraints C(q) = 0 are reduced at states of rest:
eta' = Z eta with C_r Z = 0, multipliers from the rows of dependent speeds, and K holds the change of C_r^T lam.
Source: Meirovitch, Methods of Analytical Dynamics, chapters 6 and 7; for the reduction Bauchau, Flexible Multibody Dynamics, 11.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import mpmath
import numpy as np
import sympy as sp

from symdyn.analytic.lagrange import Mechanics
from symdyn.analytic.minors import solve
from symdyn.errors import ArgumentError, EvaluationError, SymdynError
from symdyn.exact.prove import decide, drawn_state
from symdyn.exact.ring import TooLarge
from symdyn.exact.shortest import written
from symdyn.exact.taken import in_range, recorded
from symdyn.formulation.linearization import multiplier_names
from symdyn.model.symbols import Timed, symbols_of, time
from symdyn.report.limit import TimeUp, within
from symdyn.shown import name_of, shown
from symdyn.spatial.vectors import vector, zeros
from symdyn.tape.evaluate import evaluate
from symdyn.tape.node import ACCELERATION, PARAMETER, Node, exact, is_zero
from symdyn.tape.passes import substitute
from symdyn.tape.sympy_bridge import record_expression
from symdyn.tape.tape import Tape, reachable

if TYPE_CHECKING:
    from symdyn.analytic.stability import Characteristic
    from symdyn.formulation.equations import Equations
    from symdyn.given import Named, Scalar

# Terms that a product may have in an entry, seconds in which a matrix is written; digits of the numbers by which dependent speeds
# are chosen.
BOUND, SECONDS, DIGITS = 200_000, 10.0, 30
# Operations with kinks or jumps; slopes on both sides that differ by more than this, of their size, make one.
_ROUGH = {"abs", "sign", "min", "max", "select", "floor", "ceil"}
KINK = 1e-6
# Numbers below this are zero where decimal numbers were inserted.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class Linearized:
    """M eta_ddot + C eta_dot + K eta = F_in in', explicit; x'_dot = A x' + B in' of x' = [eta; eta_dot; z'].

    coordinates   what eta is the change of, (n,): coordinates, quasi-velocities for turning about their axes
    inputs        of the columns of F_in and B; states: extra ones, z
    about         what was inserted: symbol -> value; what is not in it is zero, or drifts in a steady motion
    conditions    equations in the parameters that make the state an equilibrium or steady motion; () where it always is one
    nodes         matrices and conditions on the tape; symbols: leaf -> symbol of a parameter
    """

    name: str
    coordinates: tuple[sp.Symbol, ...]
    inputs: tuple[sp.Symbol, ...]
    states: tuple[sp.Symbol, ...]
    about: Mapping[sp.Symbol, sp.Expr]
    nodes: Mapping[str, np.ndarray]
    symbols: Mapping[Node, sp.Symbol]
    _written: dict[str, Any] = field(default_factory=dict)

    @property
    def M(self) -> sp.Matrix:
        """(n, n) mass matrix."""
        return self._matrix("M")

    @property
    def C(self) -> sp.Matrix:
        """(n, n) damping and gyroscopic terms."""
        return self._matrix("C")

    @property
    def K(self) -> sp.Matrix:
        """(n, n) stiffness."""
        return self._matrix("K")

    @property
    def F_in(self) -> sp.Matrix:
        """(n, n_in) forces by the inputs."""
        return self._matrix("F_in")

    def _matrix(self, name: str) -> sp.Matrix:
        """Each entry in its shortest form. Raises SymdynError for what is too large."""
        if name not in self._written:
            value = self.nodes[name]
            self._written[name] = sp.Matrix(*value.shape, self.write(value.ravel()))
        return self._written[name]

    def write(self, entries: Iterable[Any]) -> list[sp.Expr]:
        """Nodes as SymPy. Raises SymdynError for what is too large, or takes too long."""
        try:
            return within(SECONDS, lambda: self._shortest(list(entries)))
        except (TooLarge, TimeUp) as error:
            reason = str(error) or f"it is not written out within {SECONDS:g} s"
            raise SymdynError(f"{self.name}: {reason}; put numbers in place of parameters with linear.with_values, or hold "
                              "coordinates") from None

    def _shortest(self, entries: list[Any]) -> list[sp.Expr]:
        found = written(entries, self.symbols, bound=BOUND)
        if any(value.has(sp.acos, sp.asin, sp.atan, sp.atan2) for value in self.about.values()):
            # What became of sines of these angles is combined.
            nodes, symbols = recorded([sp.expand_trig(e) for e in found])
            found = written(nodes, symbols, bound=BOUND)
        return found

    @property
    def conditions(self) -> tuple[sp.Eq, ...]:
        """Equations that must hold."""
        if "conditions" not in self._written:
            found = [e for e in self.write(self.nodes["conditions"]) if e != 0 and not _is_rounding(e)]
            never = [e for e in found if e.is_number]
            if never:
                raise SymdynError(f"{self.name}: the state is no equilibrium: {shown(never[0])} would have to be zero; "
                                  "take one of eq.equilibria() or module.equilibria()")
            self._written["conditions"] = tuple(sp.Eq(e, 0, evaluate=False) for e in dict.fromkeys(found))
        return self._written["conditions"]

    @cached_property
    def _state_space(self) -> tuple[np.ndarray, np.ndarray]:
        n, n_z, get = len(self.coordinates), len(self.states), self.nodes
        forces = np.hstack([-get["K"], -get["C"], -get["R_z"], get["F_in"]])
        by_mass = solve(get["M"], forces)
        m = 2 * n + n_z
        top = np.hstack([zeros(n, n), np.eye(n, dtype=int).astype(object), zeros(n, n_z + forces.shape[1] - m)])
        bottom = np.hstack([get["Z_q"], get["Z_u"], get["Z_z"], get["Z_in"]])
        whole = np.vstack([top, by_mass, bottom])
        return whole[:, :m], whole[:, m:]

    @property
    def A(self) -> sp.Matrix:
        """(2 n + n_z, 2 n + n_z), with the inverse of M by Cramer's rule. Raises SymdynError for what is too large."""
        return self._of_space("A", 0)

    @property
    def B(self) -> sp.Matrix:
        """(2 n + n_z, n_in). Raises SymdynError for what is too large."""
        return self._of_space("B", 1)

    def _of_space(self, name: str, k: int) -> sp.Matrix:
        if name not in self._written:
            value = self._state_space[k]
            self._written[name] = sp.Matrix(*value.shape, self.write(value.ravel()))
        return self._written[name]

    def characteristic(self) -> Characteristic:
        """det(M s^2 + C s + K) with its coefficients, and the conditions of Routh and Hurwitz; see symdyn.analytic.stability."""
        from symdyn.analytic.stability import characteristic

        return characteristic(self)

    def with_values(self, values: Named[Scalar]) -> Linearized:
        """The same with numbers, or expressions in other parameters, for parameters by symbol or name.

        Raises ArgumentError for what is no parameter of it and for values that are no expressions."""
        if not isinstance(values, Mapping):
            raise ArgumentError(f"{self.name}: values is {shown(values)}; pass a dict such as {{m: 1.5}}")
        known = {symbol.name: leaf for leaf, symbol in self.symbols.items()}
        wrong = [name_of(key) for key in values if name_of(key) not in known]
        if wrong:
            raise ArgumentError(f"{self.name}: {', '.join(wrong)} is no parameter of the linearization; it has "
                                f"{', '.join(known)}")
        recorder = next(iter(self.symbols)).recorder
        more = _Values(self.name, recorder, dict(self.symbols))
        put = {known[name_of(key)]: more.node(name_of(key), value) for key, value in values.items()}
        flat = [e for value in self.nodes.values() for e in value.ravel()]
        done = iter(substitute(tuple(flat), put, recorder))
        nodes = {name: vector(*[next(done) for _ in range(value.size)]).reshape(value.shape)
                 for name, value in self.nodes.items()}
        about = {key: sp.sympify(value, strict=True).subs({self.symbols[known[name_of(k)]]: v for k, v in values.items()})
                 for key, value in self.about.items()}
        return replace(self, nodes=nodes, about=about, symbols=more.symbols, _written={})

    def __str__(self) -> str:
        lines = [f"{self.name}: linear equations in {', '.join(map(str, self.coordinates))}"]
        if self.states:  # coupled with the coordinates: the matrices of second order are not all
            names = ["A", *["B"] * bool(self.inputs)]
            lines.append(f"  x'_dot = A x'{' + B in' if self.inputs else ''} of x' = [eta; eta_dot; "
                         f"{'; '.join(map(str, self.states))}]")
        else:
            names = ["M", "C", "K", *["F_in"] * bool(self.inputs)]
        lines += [f"  {name} = {self._shown(name).tolist()}" for name in names]
        lines += [f"  where {e.lhs} = 0" for e in self.conditions]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)

    def _shown(self, name: str) -> sp.Matrix:
        return self._matrix(name) if name in self.nodes else getattr(self, name)

    def _repr_latex_(self) -> str:
        inputs = sp.latex(sp.Matrix(self.inputs)) if self.inputs else ""
        if self.states:
            state = r"\begin{bmatrix} \eta \\ \dot{\eta} \\ " + r" \\ ".join(map(sp.latex, self.states)) + r" \end{bmatrix}"
            right = f"{sp.latex(self.A)} {state}" + (f" + {sp.latex(self.B)} {inputs}'" if inputs else "")
            rows = [rf"\frac{{d}}{{dt}} {state} &= {right}"]
        else:
            accents = (("M", r"\ddot{\eta}"), ("C", r"\dot{\eta}"), ("K", r"\eta"))
            left = " + ".join(f"{sp.latex(self._matrix(name))} {eta}" for name, eta in accents)
            rows = [f"{left} &= " + (f"{sp.latex(self.F_in)} {inputs}'" if inputs else "0")]
        rows += [rf"{sp.latex(e.lhs)} &= 0 && \text{{condition}}" for e in self.conditions]
        return "$\\displaystyle \\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}$"


class _Values:
    """What stands for coordinates: expressions in parameters, of the mechanism or new ones, on the tape."""

    def __init__(self, name: str, recorder: Any, symbols: dict[Node, sp.Symbol]) -> None:
        self.name, self.recorder, self.symbols = name, recorder, symbols

    def node(self, what: str, value: Any) -> Any:
        """Raises ArgumentError for what is no expression in parameters, and for decimal numbers beyond the range of floats."""
        try:
            e = in_range(sp.sympify(value, strict=True))
        except (sp.SympifyError, TypeError):
            e = None
        if not isinstance(e, sp.Expr) or e.has(sp.nan, sp.zoo, sp.oo):
            raise ArgumentError(f"{self.name}: {what} is {shown(value)}; pass a finite number or an expression in parameters")
        moving = [s for s in symbols_of(e) if isinstance(s, Timed) or s == time]
        if moving:
            raise ArgumentError(f"{self.name}: {what} is {shown(value)}, which holds {', '.join(map(str, moving))}; pass a "
                                "number or an expression in parameters")
        leaves = {}
        for s in symbols_of(e):
            leaves[s] = self.recorder.leaf(s.name, PARAMETER)
            self.symbols.setdefault(leaves[s], s)
        return record_expression(self.recorder, e, leaves, {})


def _is_rounding(e: sp.Expr) -> bool:
    """Whether a number with decimals is zero but for their rounding."""
    return bool(e.is_number) and bool(e.has(sp.Float)) and abs(complex(e)) < ROUNDING


def linearized(equations: Equations, about: Mapping[Any, Any] | None = None, hold: Any = ()) -> Linearized:
    """The linear equations about a state.

    about   symbol or name of coordinates, speeds, extra states, inputs -> number or expression in parameters, which may be new
            symbols; what is left out is zero. Speeds make it a steady motion: their coordinates must not stand in the result
    hold    coordinates or speeds that are held, by symbol or name: their rows and columns are left out
    Raises ArgumentError for unknown names and values that move, SymdynError for what has no constant linear equations: where
    time appears, where what drifts appears, velocity constraints, steady motion under constraints or in quasi-velocities.
    """
    try:
        return _Linearization(State(equations, about, hold)).result()
    except EvaluationError as error:
        raise SymdynError(f"{equations.name}: linear equations were requested at a state where an expression divides by zero "
                          f"({error}); what about leaves out is zero: give another state") from None


class State:
    """What is inserted for coordinates, speeds, extra states and inputs of equations, on their tape.

    about      symbol -> value; values: leaf -> node, of what is given; symbols: leaf -> symbol of a parameter
    drifting   coordinates whose speed is not zero; held: indices of speeds that are held; multipliers: leaves of them
    """

    def __init__(self, equations: Equations, about: Any, hold: Any, parameters: Mapping[Any, Any] | None = None,
                 what: str = "about") -> None:
        """parameters: values for them, by symbol or name; what: the name of `about` in errors. Raises ArgumentError, and
        SymdynError for a steady motion under constraints or in quasi-velocities, and for loads that depend on multipliers."""
        self.equations, self.m = equations, Mechanics(equations)
        if equations.constraints and equations.implicit_loads:
            raise SymdynError(f"{equations.name}: its state was requested in symbols, but {', '.join(equations.implicit_loads)} "
                              "depends on accelerations, multipliers or reactions under constraints; use module.linearize(at) "
                              "or module.equilibrium()")
        self.symbols: dict[Node, Any] = {leaf: s for leaf, s in equations.printed_leaves().items() if leaf.mask == PARAMETER}
        self.about = self._taken(about, what)
        self.held = self._held(hold)
        m, s = self.m, equations.symbols
        taken = _Values(equations.name, m.recorder, self.symbols)
        self.values = {equations.leaves[key]: taken.node(f"{what}: {key}", value) for key, value in self.about.items()}
        known = {p.name: equations.leaves[p] for p in s.parameters}
        wrong = [name_of(key) for key in parameters or {} if name_of(key) not in known]
        if wrong:
            raise ArgumentError(f"{equations.name}: values has {', '.join(wrong)}; its parameters are {', '.join(known)}")
        self.parameters = {known[name_of(key)]: taken.node(name_of(key), value) for key, value in (parameters or {}).items()}
        self.multipliers = [m.recorder.leaf(name, ACCELERATION) for name in multiplier_names(len(equations.constraints))]
        moving = [k for k, u in enumerate(m.u) if not is_zero(self.values.get(u, 0))]
        if moving and (equations.constraints or not m.plain):
            why = "its constraints" if equations.constraints else "its quasi-velocities"
            raise SymdynError(f"{equations.name}: a steady motion was requested in symbols, but {why} take part in it; use "
                              "module.linearize(at), or coordinates that need none")
        self.drifting = [s.coordinates[k] for k in moving]

    def put(self) -> dict[Node, Any]:
        """Values of what is given, with speeds, accelerations and inputs that are left out at zero."""
        m = self.m
        return {**dict.fromkeys((*m.u, *m.ud, *m.inputs), 0), **self.values, **self.parameters}

    def _taken(self, about: Any, what: str) -> dict[sp.Symbol, Any]:
        """Symbol -> value."""
        s = self.equations.symbols
        if about is not None and not isinstance(about, Mapping):
            raise ArgumentError(f"{self.equations.name}: {what} is {shown(about)}; pass a dict such as {{theta: 0}}, or None")
        known = {symbol.name: symbol for symbol in (*s.coordinates, *s.speeds, *s.states, *s.inputs)}
        wrong = [name_of(key) for key in about or {} if name_of(key) not in known]
        if wrong:
            raise ArgumentError(f"{self.equations.name}: {what} has {', '.join(wrong)}; it takes {', '.join(known)}")
        return {known[name_of(key)]: value for key, value in (about or {}).items()}

    def _held(self, hold: Any) -> list[int]:
        """Indices of speeds that are held."""
        s = self.equations.symbols
        names = [name_of(h) for h in (hold if isinstance(hold, (list, tuple, set, sp.MatrixBase)) else [hold])]
        known = {u.name: k for k, u in enumerate(s.speeds)}
        if self.m.plain:
            known |= {q.name: k for k, q in enumerate(s.coordinates)}
        wrong = [n for n in names if n not in known]
        if wrong:
            raise ArgumentError(f"{self.equations.name}: hold is {', '.join(wrong)}; it takes {', '.join(known)}")
        return sorted({known[n] for n in names})


class _Linearization:
    dependent: Sequence[int] = ()

    def __init__(self, state: State) -> None:
        self.state, self.equations, self.m = state, state.equations, state.m
        self.symbols, self.about, self.held, self.drifting = state.symbols, state.about, state.held, state.drifting
        s, leaves = self.equations.symbols, self.equations.leaves
        self.values = state.put()
        for group in self.equations.unit_groups:  # Euler parameters: what is left out is upright
            if not any(p in self.about for p in group):
                self.values.update({leaves[p]: exact(s.initial.get(p, 0)) for p in group})
        still = [q for q, symbol in zip(self.m.q, s.coordinates, strict=True) if symbol not in self.drifting]
        self.values = {**dict.fromkeys((*still, *self.m.z), 0), **self.values}

    def result(self) -> Linearized:
        m, equations = self.m, self.equations
        r, C, z_dot = m.statics()
        self._demand_smooth([*r, *C, *z_dot])
        lam = self.state.multipliers
        free = [k for k in range(len(m.u)) if k not in self.held]
        Z, conditions = self._unconstrained(free) if not lam else self._constrained(r, C, lam, free)
        conditions = [*conditions, *z_dot]
        N = equations.quantity("N")
        if not m.plain:
            self._demand_rest()
        moved = N @ Z
        n, n_z = Z.shape[1], len(m.z)
        nodes = {"M": Z.T @ self._by(r, m.ud) @ Z, "C": Z.T @ self._by(r, m.u) @ Z, "K": Z.T @ self._by(r, m.q) @ moved,
                 "R_z": Z.T @ self._by(r, m.z), "F_in": -(Z.T @ self._by(r, m.inputs)),
                 "Z_q": self._by(z_dot, m.q) @ moved, "Z_u": self._by(z_dot, m.u) @ Z, "Z_z": self._by(z_dot, m.z),
                 "Z_in": self._by(z_dot, m.inputs), "conditions": vector(*(Z.T @ r), *conditions)}
        shapes = {"M": (n, n), "C": (n, n), "K": (n, n), "R_z": (n, n_z), "F_in": (n, len(m.inputs)), "Z_q": (n_z, n),
                  "Z_u": (n_z, n), "Z_z": (n_z, n_z), "Z_in": (n_z, len(m.inputs))}
        nodes = {name: m.at(value, self.values).reshape(shapes.get(name, (-1,))) for name, value in nodes.items()}
        self._demand_constant(nodes)
        s = equations.symbols
        names = s.coordinates if m.plain else s.speeds
        independent = [k for k in free if k not in self.dependent]
        about = {key: sp.sympify(value, strict=True) for key, value in self.about.items()}
        return Linearized(equations.name, tuple(names[k] for k in independent), s.inputs, s.states, about, nodes, self.symbols)

    def _by(self, entries: Any, leaves: Sequence[Node]) -> np.ndarray:
        columns = [self.m.by(entries, leaf) for leaf in leaves]
        return np.array(columns, dtype=object).T.reshape(len(entries), len(leaves)) if columns else zeros(len(entries), 0)

    def _unconstrained(self, free: Sequence[int]) -> tuple[np.ndarray, list[Any]]:
        Z = zeros(len(self.m.u), len(free))
        for j, k in enumerate(free):
            Z[k, j] = 1
        return Z, []

    def _constrained(self, r: np.ndarray, C: np.ndarray, lam: Sequence[Node], free: Sequence[int],
                     ) -> tuple[np.ndarray, list[Any]]:
        """Z with C_r Z = 0 and the constraints; the multipliers become values."""
        m, equations = self.m, self.equations
        if not all(equations.holonomic):
            names = [n for n, holonomic in zip(equations.constraints, equations.holonomic, strict=True) if not holonomic]
            verb = "constrains" if len(names) == 1 else "constrain"
            raise SymdynError(f"{equations.name}: linear equations in symbols were requested, but {', '.join(names)} {verb} "
                              "velocities and no positions, so that more displacements are free than speeds, and there is no "
                              "M eta_ddot + C eta_dot + K eta; use module.linearize(at), whose A and B hold displacements and "
                              "speeds of their own number")
        if not all(map(is_zero, self._by(C, m.inputs).ravel())):
            raise SymdynError(f"{equations.name}: linear equations in symbols were requested, but inputs stand in its "
                              "constraints; use module.linearize(at)")
        C_r = m.at(equations.quantity("C_r"), self.values)
        self.dependent = self._dependent(C_r, free)
        d, i = list(self.dependent), [k for k in free if k not in self.dependent]
        Z = zeros(len(m.u), len(i))
        if d:
            Z[d] = -solve(C_r[:, d], C_r[:, i])
        for j, k in enumerate(i):
            Z[k, j] = 1
        unloaded = m.at(r, {**self.values, **dict.fromkeys(lam, 0)})
        self.values.update(zip(lam, -solve(C_r[:, d].T, unloaded[d]), strict=True))
        return Z, list(C)

    def _dependent(self, C_r: np.ndarray, free: Sequence[int]) -> list[int]:
        """Speeds, the last ones first, whose columns are independent for parameters in general."""
        tape = Tape.of(self.m.recorder, C_r=C_r)
        values = drawn_state(random.Random(5), tape.inputs, 0.2, self.symbols)
        numbers = evaluate(tape, {leaf.args[1]: value for leaf, value in values.items()}, DIGITS)["C_r"].astype(float)
        chosen: list[int] = []
        for k in reversed(free):
            if np.linalg.matrix_rank(numbers[:, [*chosen, k]], tol=1e-9) > len(chosen):
                chosen.append(k)
        if len(chosen) < len(C_r):
            raise SymdynError(f"{self.equations.name}: its {len(C_r)} constraints have rank {len(chosen)} at the state, so that "
                              "the multipliers are not unique; leave out those that others imply (system.diagnose() names them), "
                              "or use module.linearize(at)")
        return sorted(chosen)

    def _demand_smooth(self, entries: Sequence[Any]) -> None:
        """Raises SymdynError where the equations have a kink or jump at the state: their changes on both sides differ.

        Decided by differences with many digits, with numbers for the parameters, along each coordinate, speed, state and input.
        """
        m, name = self.m, self.equations.name
        rough = [n for n in reachable(entries) if n.op in _ROUGH and n.mask & ~PARAMETER]
        if not rough:
            return
        varied = [*m.q, *m.u, *m.z, *m.inputs]
        away = [m.recorder.leaf(f"(away {k})", ACCELERATION) for k in range(len(varied))]
        around = {leaf: m.recorder.add(self.values.get(leaf, 0), a) for leaf, a in zip(varied, away, strict=True)}
        lam = dict.fromkeys(self.state.multipliers, 0)
        tape = Tape.of(m.recorder, r=m.at(entries, {**self.values, **lam, **around}))
        drawn = drawn_state(random.Random(3), [leaf for leaf in tape.inputs if leaf not in away], 0.2, self.symbols)
        numbers = {leaf.args[1]: value for leaf, value in drawn.items()}

        def at(k: int, step: Any) -> np.ndarray:
            moved = {a.args[1]: step if k == j else 0 for j, a in enumerate(away)}
            return evaluate(tape, {**numbers, **moved}, DIGITS)["r"]

        steps = [sign * mpmath.mpf(10) ** -digits for digits in (10, 12) for sign in (1, -1)]  # a jump has no slope
        middle = at(-1, 0)
        symbols = self.equations.printed_leaves()
        for k, leaf in enumerate(varied):
            slopes = zip(*[(at(k, step) - middle) / step for step in steps], strict=True)
            if any(not max(s) - min(s) <= KINK * (1 + max(map(abs, s))) for s in slopes):
                raise SymdynError(f"{name}: the equations have a kink or a jump at this state, where {symbols.get(leaf, leaf)} "
                                  f"passes its value (in {', '.join(sorted({n.op for n in rough}))}), so that there are no "
                                  "linear ones; take another state, or a smooth law such as tanh(x/eps) in place of sign(x)")

    def _demand_rest(self) -> None:
        """Raises SymdynError where coordinates move at zero speeds."""
        rates = self.m.at(self.equations.quantity("rates").ravel(), self.values)
        if not decide(self.m.recorder, [(e, 0) for e in rates], self.symbols).proved:
            raise SymdynError(f"{self.equations.name}: linear equations were requested at a state where coordinates move by a "
                              "given motion; use module.linearize(at)")

    def _demand_constant(self, nodes: Mapping[str, np.ndarray]) -> None:
        """Raises SymdynError where time, or a coordinate that drifts, stands in the result."""
        equations = self.equations
        for name, value in nodes.items():
            left = [n for n in reachable([e for e in value.ravel() if isinstance(e, Node)])
                    if n.op == "leaf" and n.mask != PARAMETER]
            for leaf in left:
                slopes = [(e, 0) for e in self.m.by(value.ravel(), leaf) if isinstance(e, Node) or e]
                if slopes and not decide(equations.recorder, slopes, self.symbols).proved:
                    symbol = equations.printed_leaves().get(leaf, leaf.args[1])
                    drifts = symbol in self.drifting
                    what = (f"{symbol} goes on at the speed {self.about[symbol.dot]}, and {name} holds it" if drifts
                            else f"{name} holds {symbol}")
                    raise SymdynError(f"{equations.name}: the linear equations are not constant: {what}; "
                                      + (f"give about a steady motion, in which only cyclic coordinates move, or hold {symbol}"
                                         if drifts else "use module.linearize(at, t=...)"))
            put = dict.fromkeys(left, 0)
            if put:
                nodes[name][...] = self.m.at(value, put)
