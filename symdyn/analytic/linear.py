"""Linear equations about a state of rest or a steady motion, explicit in the parameters.

M eta_ddot + C eta_dot + K eta = F_in in', with eta the changes of independent coordinates from the state: derivatives of what the
equations make zero, r = M_tilde u_dot + k_tilde - F_tilde + C_r^T lam, on the tape, by exact rules. The state is an equilibrium
or steady motion where the conditions hold; M, C, K are those of a linearization where they do. Constraints are reduced:
multipliers come from the rows of dependent speeds, and K holds the change of C_r^T lam. Constraints of velocities leave fewer
speeds zeta than displacements eta: M zeta_dot + C zeta + K eta = F_in in', eta_dot = E zeta + W eta; see
symdyn.analytic.reduced.
Source: Meirovitch, Methods of Analytical Dynamics, chapters 6 and 7.
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
from symdyn.analytic.reduced import DIGITS, Reduced, reduced, unconstrained
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

# Terms that a product may have in an entry, seconds in which a matrix is written.
BOUND, SECONDS = 200_000, 10.0
# Operations with kinks or jumps; slopes on both sides that differ by more than this, of their size, make one.
_ROUGH = {"abs", "sign", "min", "max", "select", "floor", "ceil"}
KINK = 1e-6
# Numbers below this are zero where decimal numbers were inserted.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class Linearized:
    """M eta_ddot + C eta_dot + K eta = F_in in', explicit; x'_dot = A x' + B in' of x' = [eta; zeta; z'], zeta = eta_dot.

    With constraints of velocities: M zeta_dot + C zeta + K eta = F_in in', eta_dot = E zeta + W eta

    coordinates   what eta is the change of, (n_d,): coordinates, quasi-velocities for turning about their axes
    speeds        what zeta is the change of, (n_s,); rated: which of the coordinates each of them is the rate of
    inputs        of the columns of F_in and B; states: extra ones, z
    about         what was inserted: symbol -> value; what is not in it is zero, or drifts in a steady motion
    conditions    equations in the parameters that make the state an equilibrium or steady motion; () where it always is one
    nodes         matrices and conditions on the tape; symbols: leaf -> symbol of a parameter
    """

    name: str
    coordinates: tuple[sp.Symbol, ...]
    speeds: tuple[sp.Symbol, ...]
    rated: tuple[int, ...]
    inputs: tuple[sp.Symbol, ...]
    states: tuple[sp.Symbol, ...]
    about: Mapping[sp.Symbol, sp.Expr]
    nodes: Mapping[str, np.ndarray]
    symbols: Mapping[Node, sp.Symbol]
    _written: dict[str, Any] = field(default_factory=dict)

    @property
    def M(self) -> sp.Matrix:
        """(n_s, n_s) mass matrix."""
        return self._matrix("M")

    @property
    def C(self) -> sp.Matrix:
        """(n_s, n_s) damping and gyroscopic terms."""
        return self._matrix("C")

    @property
    def K(self) -> sp.Matrix:
        """(n_s, n_d) stiffness."""
        return self._matrix("K")

    @property
    def F_in(self) -> sp.Matrix:
        """(n_s, n_in) forces by the inputs."""
        return self._matrix("F_in")

    @property
    def E(self) -> sp.Matrix:
        """(n_d, n_s) of eta_dot = E zeta + W eta; one without constraints of velocities."""
        return self._matrix("E")

    @property
    def W(self) -> sp.Matrix:
        """(n_d, n_d) of eta_dot = E zeta + W eta; zero at rest, and without constraints of velocities."""
        return self._matrix("W")

    @property
    def holonomic(self) -> bool:
        """Whether zeta is eta_dot: no constraints of velocities."""
        return len(self.speeds) == len(self.coordinates)

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
        result = written(entries, self.symbols, bound=BOUND)
        if any(value.has(sp.acos, sp.asin, sp.atan, sp.atan2) for value in self.about.values()):
            # Expressions with sines of these angles are combined.
            nodes, symbols = recorded([sp.expand_trig(e) for e in result])
            result = written(nodes, symbols, bound=BOUND)
        return result

    @property
    def conditions(self) -> tuple[sp.Eq, ...]:
        """Equations that must hold."""
        if "conditions" not in self._written:
            result = [e for e in self.write(self.nodes["conditions"]) if e != 0 and not _is_rounding(e)]
            never = [e for e in result if e.is_number]
            if never:
                raise SymdynError(f"{self.name}: the state is no equilibrium: {shown(never[0])} would have to be zero; "
                                  "take one of eq.equilibria() or module.equilibria()")
            self._written["conditions"] = tuple(sp.Eq(e, 0, evaluate=False) for e in dict.fromkeys(result))
        return self._written["conditions"]

    @cached_property
    def _state_space(self) -> tuple[np.ndarray, np.ndarray]:
        n, n_z, get = len(self.coordinates), len(self.states), self.nodes
        forces = np.hstack([-get["K"], -get["C"], -get["R_z"], get["F_in"]])
        by_mass = solve(get["M"], forces)
        m = n + len(self.speeds) + n_z
        top = np.hstack([get["W"], get["E"], zeros(n, n_z + forces.shape[1] - m)])
        bottom = np.hstack([get["Z_q"], get["Z_u"], get["Z_z"], get["Z_in"]])
        whole = np.vstack([top, by_mass, bottom])
        return whole[:, :m], whole[:, m:]

    @property
    def A(self) -> sp.Matrix:
        """(m, m), m = n_d + n_s + n_z, with the inverse of M by Cramer's rule. Raises SymdynError for what is too large."""
        return self._of_space("A", 0)

    @property
    def B(self) -> sp.Matrix:
        """(m, n_in). Raises SymdynError for what is too large."""
        return self._of_space("B", 1)

    def _of_space(self, name: str, k: int) -> sp.Matrix:
        if name not in self._written:
            value = self._state_space[k]
            self._written[name] = sp.Matrix(*value.shape, self.write(value.ravel()))
        return self._written[name]

    def characteristic(self) -> Characteristic:
        """det(M s^2 + C s + K), with its coefficients, and the conditions of Routh and Hurwitz; see symdyn.analytic.stability."""
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
        changes = "" if self.holonomic else f", with changes zeta of {', '.join(map(str, self.speeds))}"
        if self.states:  # coupled with the coordinates: the matrices of second order are not all
            names = ["A", *["B"] * bool(self.inputs)]
            lines.append(f"  x'_dot = A x'{' + B in' if self.inputs else ''} of x' = "
                         f"[eta; {'eta_dot' if self.holonomic else 'zeta'}; {'; '.join(map(str, self.states))}]{changes}")
        elif not self.holonomic:
            names = ["M", "C", "K", "E", "W", *["F_in"] * bool(self.inputs)]
            lines.append(f"  M zeta_dot + C zeta + K eta = {'F_in in' if self.inputs else '0'}, "
                         f"eta_dot = E zeta + W eta{changes}")
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
        speeds = r"\dot{\eta}" if self.holonomic else r"\zeta"
        rows = []
        if self.states:
            state = rf"\begin{{bmatrix}} \eta \\ {speeds} \\ " + r" \\ ".join(map(sp.latex, self.states)) + r" \end{bmatrix}"
            right = f"{sp.latex(self.A)} {state}" + (f" + {sp.latex(self.B)} {inputs}'" if inputs else "")
            rows = [rf"\frac{{d}}{{dt}} {state} &= {right}"]
        else:
            rates = r"\ddot{\eta}" if self.holonomic else r"\dot{\zeta}"
            accents = (("M", rates), ("C", speeds), ("K", r"\eta"))
            left = " + ".join(f"{sp.latex(self._matrix(name))} {eta}" for name, eta in accents)
            rows = [f"{left} &= " + (f"{sp.latex(self.F_in)} {inputs}'" if inputs else "0")]
            if not self.holonomic:
                moved = "" if self.W.is_zero_matrix else rf" + {sp.latex(self.W)} \eta"
                rows.append(rf"\dot{{\eta}} &= {sp.latex(self.E)} \zeta{moved}")
        if not self.holonomic:
            rows.append(rf"\zeta &= {sp.latex(sp.Matrix(self.speeds))}'")
        rows += [rf"{sp.latex(e.lhs)} &= 0 && \text{{condition}}" for e in self.conditions]
        return "$\\displaystyle \\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}$"


class _Values:
    """Values that stand for coordinates: expressions in parameters, of the mechanism or new ones, on the tape."""

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


def linearized(equations: Equations, about: Mapping[Any, Any] | None = None, hold: Any = (), coordinates: Any = (),
               ) -> Linearized:
    """The linear equations about a state.

    about   symbol or name of coordinates, speeds, extra states, inputs -> number or expression in parameters, which may be new
            symbols; what is left out is zero. Speeds make it a steady motion: their coordinates must not stand in the result
    hold    coordinates or speeds that are held, by symbol or name: their rows and columns are left out
    coordinates   those that are to be independent under constraints, by symbol or name; default: the first ones that are
    Raises ArgumentError for unknown names, values that move and coordinates that depend on others, SymdynError for what has no
    constant linear equations: where time appears, where what drifts appears, steady motion in quasi-velocities.
    """
    try:
        state = State(equations, about, hold)
        return _Linearization(state, state.indices(coordinates, "coordinates")).result()
    except EvaluationError as error:
        raise SymdynError(f"{equations.name}: linear equations were requested at a state where an expression divides by zero "
                          f"({error}); what about leaves out is zero: give another state") from None


class State:
    """Values inserted for coordinates, speeds, extra states and inputs of equations, on their tape.

    about      symbol -> value; values: leaf -> node, of what is given; symbols: leaf -> symbol of a parameter
    drifting   coordinates whose speed is not zero; held: indices of speeds that are held; multipliers: leaves of them
    """

    def __init__(self, equations: Equations, about: Any, hold: Any, parameters: Mapping[Any, Any] | None = None,
                 what: str = "about") -> None:
        """parameters: values for them, by symbol or name; what: the name of `about` in errors. Raises ArgumentError, and
        SymdynError for a steady motion in quasi-velocities, and for loads that depend on multipliers."""
        self.equations, self.m = equations, Mechanics(equations)
        if equations.constraints and equations.implicit_loads:
            raise SymdynError(f"{equations.name}: its state was requested in symbols, but {', '.join(equations.implicit_loads)} "
                              "depends on accelerations, multipliers or reactions under constraints; use module.linearize(at) "
                              "or module.equilibrium()")
        self.symbols: dict[Node, Any] = {leaf: s for leaf, s in equations.printed_leaves().items() if leaf.mask == PARAMETER}
        self.about = self._taken(about, what)
        self.held = self.indices(hold, "hold")
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
        if moving and not m.plain:
            raise SymdynError(f"{equations.name}: a steady motion was requested in symbols, but its quasi-velocities take part "
                              "in it; use module.linearize(at), or coordinates that need none")
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

    def indices(self, names: Any, what: str) -> list[int]:
        """Indices of speeds, by symbol or name of these or of coordinates; what: the argument's name in errors."""
        s = self.equations.symbols
        result = [name_of(h) for h in (names if isinstance(names, (list, tuple, set, sp.MatrixBase)) else [names])]
        known = {u.name: k for k, u in enumerate(s.speeds)}
        if self.m.plain:
            known |= {q.name: k for k, q in enumerate(s.coordinates)}
        wrong = [n for n in result if n not in known]
        if wrong:
            raise ArgumentError(f"{self.equations.name}: {what} is {', '.join(wrong)}; it takes {', '.join(known)}")
        return sorted({known[n] for n in result})


class _Linearization:
    def __init__(self, state: State, wanted: Sequence[int]) -> None:
        self.wanted = wanted
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
        free = [k for k in range(len(m.u)) if k not in self.held]
        N = m.at(equations.quantity("N"), self.values)
        if not m.plain:
            self._demand_rest()
        by, found = self._constrained(r, N, free) if self.state.multipliers else (unconstrained(len(m.u), free), [])
        # C stays where C_dot is zero, which is a condition, too: what drifts counts with its first value.
        first = {leaf: self.values.get(leaf, 0) for leaf in m.q}
        conditions = [*found, *m.at(C, {**self.values, **first}), *z_dot]
        Z, Z_w, moved = by.Z_u, by.Z_w, N @ by.Z_v
        damping, drag = self._by(z_dot, m.u), self._by(r, m.u)
        M = Z.T @ m.at(self._by(r, m.ud), self.values)
        n, n_s, n_z = len(by.displacements), len(by.speeds), len(m.z)
        nodes = {"M": M @ Z, "C": Z.T @ drag @ Z + M @ Z_w @ by.E,
                 "K": Z.T @ (self._by(r, m.q) @ moved + drag @ Z_w) + M @ Z_w @ by.W,
                 "E": by.E, "W": by.W, "R_z": Z.T @ self._by(r, m.z), "F_in": -(Z.T @ self._by(r, m.inputs)),
                 "Z_q": self._by(z_dot, m.q) @ moved + damping @ Z_w, "Z_u": damping @ Z, "Z_z": self._by(z_dot, m.z),
                 "Z_in": self._by(z_dot, m.inputs), "conditions": vector(*(Z.T @ r), *conditions)}
        shapes = {"M": (n_s, n_s), "C": (n_s, n_s), "K": (n_s, n), "E": (n, n_s), "W": (n, n), "R_z": (n_s, n_z),
                  "F_in": (n_s, len(m.inputs)), "Z_q": (n_z, n), "Z_u": (n_z, n_s), "Z_z": (n_z, n_z),
                  "Z_in": (n_z, len(m.inputs))}
        nodes = {name: m.at(value, self.values).reshape(shapes.get(name, (-1,))) for name, value in nodes.items()}
        self._demand_constant({**nodes, "what the constraints determine": m.at([*Z.ravel(), *Z_w.ravel()], self.values)})
        s = equations.symbols
        names = s.coordinates if m.plain else s.speeds
        about = {key: sp.sympify(value, strict=True) for key, value in self.about.items()}
        return Linearized(equations.name, tuple(names[k] for k in by.displacements), tuple(s.speeds[k] for k in by.speeds),
                          tuple(map(by.displacements.index, by.speeds)), s.inputs, s.states, about, nodes, self.symbols)

    def _by(self, entries: Any, leaves: Sequence[Node]) -> np.ndarray:
        columns = [self.m.by(entries, leaf) for leaf in leaves]
        return np.array(columns, dtype=object).T.reshape(len(entries), len(leaves)) if columns else zeros(len(entries), 0)

    def _constrained(self, r: np.ndarray, N: np.ndarray, free: Sequence[int]) -> tuple[Reduced, list[Any]]:
        """Freedoms that the constraints leave, and conditions for speeds that fulfil them and stay; the multipliers become
        values."""
        m, equations, lam = self.m, self.equations, self.state.multipliers
        rates, second = m.constraint_rates()
        C = m.statics()[1]
        if not all(map(is_zero, self._by([*C, *rates], m.inputs).ravel())):
            raise SymdynError(f"{equations.name}: linear equations in symbols were requested, but inputs stand in its "
                              "constraints; use module.linearize(at)")
        A, A_q = (m.at(self._by(rates, leaves), self.values) for leaves in (m.u, m.q))
        by = reduced(equations, A, A_q, N, free, self.symbols, self.wanted)
        d = list(by.dependent)
        unloaded = m.at(r, {**self.values, **dict.fromkeys(lam, 0)})
        self.values.update(zip(lam, -solve(A[:, d].T, unloaded[d]), strict=True))
        return by, [*rates, *second]

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
                    drifts, holder = symbol in self.drifting, "a condition of it" if name == "conditions" else name
                    what = (f"{symbol} goes on at the speed {self.about[symbol.dot]}, and {holder} holds it" if drifts
                            else f"{holder} holds {symbol}")
                    raise SymdynError(f"{equations.name}: the linear equations are not constant: {what}; "
                                      + (f"give about a steady motion, in which only cyclic coordinates move, or hold {symbol}"
                                         if drifts else "use module.linearize(at, t=...)"))
            put = dict.fromkeys(left, 0)
            if put:
                nodes[name][...] = self.m.at(value, put)
