"""States of rest, or of steady motion, in closed form, where their conditions are polynomials that can be solved in turn.

Conditions are polynomials in coordinates outside of angles and in sine and cosine of base angles, with s^2 + c^2 = 1. They are
split into factors, each of which is a case; equations for a single unknown are solved: a s + b c + d = 0 by
q = atan2(a, b) +- acos(-d / r) with r^2 = a^2 + b^2, those in one cosine by their roots, with numbers of any degree by
resultants; what stands linearly is eliminated. Equations with numbers that stay coupled become triangular by a Groebner basis.
A case that none of this solves is an error: a result holds all equilibria for parameters at which the quantities assumed not to
be zero are not. Source: Cox, Little, O'Shea, Ideals, Varieties, and Algorithms, chapters 3 and 6.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import combinations
from typing import TYPE_CHECKING, Any

import sympy as sp
from flint import fmpq, fmpq_mpoly_ctx

from symdyn.analytic.linear import State
from symdyn.errors import ArgumentError, SymdynError
from symdyn.exact.prove import prove, with_known_angles
from symdyn.exact.represent import plain
from symdyn.exact.shortest import Writer, not_negative, written
from symdyn.exact.taken import recorded
from symdyn.exact.walk import Exact
from symdyn.model.symbols import symbols_of, time
from symdyn.real_numbers import NotReal, number
from symdyn.report.limit import TimeUp, within
from symdyn.shown import shown
from symdyn.tape.jumps import description, jumps
from symdyn.tape.node import SPEED, Node, is_zero

if TYPE_CHECKING:
    from symdyn.formulation.equations import Equations

# Cases that are followed; a mechanism of n links has 2^n positions of rest.
CASES = 4096
# Digits of numbers that show whether equations are fulfilled.
DIGITS = 30
# Numbers of 30 digits below this are zero; those of expressions at numbers for parameters, which may cancel.
ZERO, NEAR = 1e-20, 1e-12
# Numbers for parameters that are tried until one meets the conditions.
SAMPLES = 20


@dataclass(frozen=True)
class EquilibriumPoint:
    """A state of rest in closed form.

    values       coordinate (or extra state, or multiplier) -> expression in parameters
    free         coordinates that may have any value, and multipliers, where constraints are singular
    conditions   inequalities between parameters that make the values real
    proved       whether the equations are zero there by exact algebra; where not, by numbers of 30 digits
    """

    values: Mapping[sp.Symbol, sp.Expr]
    free: tuple[sp.Symbol, ...] = ()
    conditions: tuple[sp.Basic, ...] = ()
    proved: bool = True

    def __str__(self) -> str:
        text = ", ".join(f"{q} = {value}" for q, value in self.values.items())
        text += f"{', ' if text and self.free else ''}{', '.join(f'{q} free' for q in self.free)}"
        text = text or "the coordinates that are held are at rest"
        return text + (f"   where {' and '.join(map(str, self.conditions))}" if self.conditions else "")


@dataclass(frozen=True, repr=False)
class EquilibriumPoints:
    """All equilibria, a sequence that prints as a list; angles are between -pi and pi where they are multiples of pi.

    assumed   expressions in parameters that are taken not to be zero: other equilibria may exist where one of them is
    needed    what would have to be zero, where there is no equilibrium
    """

    name: str
    points: tuple[EquilibriumPoint, ...]
    assumed: tuple[sp.Expr, ...] = ()
    needed: tuple[sp.Expr, ...] = ()

    def __len__(self) -> int:
        return len(self.points)

    def __iter__(self) -> Iterator[EquilibriumPoint]:
        return iter(self.points)

    def __getitem__(self, k: int) -> EquilibriumPoint:
        return self.points[k]

    def __str__(self) -> str:
        lines = [f"{self.name}: {len(self)} equilibri{'um' if len(self) == 1 else 'a'}"]
        lines += [f"  {point}" for point in self.points]
        lines += [f"  taken not to be zero: {', '.join(map(str, self.assumed))}"] if self.assumed else []
        lines += [f"  would have to be zero: {', '.join(map(str, self.needed))}"] if self.needed else []
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)

    def _repr_latex_(self) -> str:
        rows = []
        for point in self.points:
            entries = [f"{sp.latex(q)} = {sp.latex(value)}" for q, value in point.values.items()]
            entries += [rf"{sp.latex(q)} \text{{ free}}" for q in point.free]
            entries += [rf"\text{{where }} {sp.latex(c)}" for c in point.conditions]
            rows.append("&" + r",\enspace ".join(entries))
        rows = rows or [r"&\text{no equilibrium}"]
        return "$\\displaystyle \\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}$"


def equilibria(equations: Equations, fixed: Mapping[Any, Any] | None = None, values: Mapping[Any, Any] | None = None,
               seconds: float | None = None) -> EquilibriumPoints:
    """All states of rest.

    fixed    coordinates, which are held there; inputs and extra states; or speeds, of a steady motion: by symbol or name, numbers
             or expressions in parameters. Speeds and inputs that are left out are zero
    values   numbers for parameters, by symbol or name; decimal ones stand for the decimals that they are printed as
    seconds  that the search may take; default: the equations' simplify_seconds
    Raises SymdynError where the conditions are no polynomials, or not solved in closed form or in time: with the reason; and
    ArgumentError for seconds that are no positive number.
    """
    if isinstance(values, Mapping):
        values = {key: _decimal(value) for key, value in values.items()}
    state = State(equations, fixed, (), values, "fixed")
    search = _Search(state)
    limit = max(equations.simplify_seconds, 1.0) if seconds is None else _positive(seconds, equations.name)
    try:
        return within(limit, search.result)
    except TimeUp:
        left = len(equations.symbols.parameters) - len(state.parameters)
        numbers = "pass numbers for parameters with values=..., " if left else ""
        raise SymdynError(f"{equations.name}: equilibria in closed form were not found within {limit:g} s; {numbers}fix "
                          "coordinates, give more time with seconds=..., or use module.equilibria()") from None


def _positive(seconds: Any, name: str) -> float:
    try:
        result = number(seconds)
    except NotReal as error:
        raise ArgumentError(f"{name}: seconds must be a positive number, found {shown(seconds)}: {error}") from None
    if not 0 < result <= threading.TIMEOUT_MAX:
        raise ArgumentError(f"{name}: seconds must be a positive number up to {threading.TIMEOUT_MAX:.3g}, found "
                            f"{shown(seconds)}")
    return result


@dataclass(frozen=True)
class _Case:
    """Equations that remain, and the unknowns found: unknown -> value, with sines and cosines, angles, conditions."""

    left: tuple[sp.Expr, ...]
    found: tuple[tuple[sp.Symbol, sp.Expr], ...] = ()
    angles: tuple[tuple[int, sp.Expr], ...] = ()
    conditions: tuple[sp.Basic, ...] = ()

    def put(self, values: Mapping[sp.Symbol, sp.Expr], angles: Mapping[int, sp.Expr] | None = None,
            conditions: Sequence[sp.Basic] = ()) -> _Case:
        """With values for unknowns."""
        real = [c for c in conditions if c != True]  # noqa: E712
        return _Case(tuple(e.subs(values) for e in self.left),
                     (*[(x, e.subs(values)) for x, e in self.found], *values.items()),
                     (*[(k, e.subs(values)) for k, e in self.angles], *(angles or {}).items()),
                     (*self.conditions, *real))


def _within(point: EquilibriumPoint, other: EquilibriumPoint) -> bool:
    """Whether a point is one of those of another, in which more coordinates are free."""
    if not set(point.free) < set(other.free) or other.conditions:
        return False
    here = {q: value for q, value in point.values.items() if q in other.free}
    return all(sp.sympify(point.values.get(q, q), strict=True) == value.subs(here) for q, value in other.values.items())


class _Search:
    def __init__(self, state: State) -> None:
        self.state, self.equations = state, state.equations
        m = state.m
        if state.drifting and self.equations.constraints:
            raise SymdynError(f"{self.equations.name}: steady motions in closed form were requested, but its constraints take "
                              "part in them; use module.equilibria()")
        if self.equations.unit_groups:
            raise SymdynError(f"{self.equations.name}: equilibria in closed form were requested of Euler parameters; describe "
                              "the orientation by Euler angles, or use module.equilibria()")
        s = self.equations.symbols
        r, C, z_dot = m.statics()
        fixed = {leaf for leaf in state.values if leaf in m.q}
        if fixed and not m.plain:
            raise SymdynError(f"{self.equations.name}: equilibria in closed form were requested with coordinates that are held, "
                              "but its speeds are quasi-velocities; leave speeds='body' out, or use module.equilibria(fixed=...)")
        rows = [e for e, q in zip(r, m.q, strict=True) if q not in fixed] if m.plain else list(r)
        rubbing = [j for j in jumps(m.recorder, rows) if isinstance(j.surface, Node) and j.surface.mask & SPEED]
        if rubbing:
            what = description(rubbing[0], self.equations.printed_leaves())["what"]
            raise SymdynError(f"{self.equations.name}: equilibria in closed form were requested, but {what} jumps where a speed "
                              "passes zero: dry friction holds a whole range of positions; leave it out")
        entries = [e for e in m.at([*rows, *C, *z_dot], state.put()) if not is_zero(e)]
        multipliers = {leaf: sp.Symbol(f"lambda{k + 1}") for k, leaf in enumerate(state.multipliers)}
        self.coordinates = [symbol for q, symbol in zip(m.q, s.coordinates, strict=True)
                            if q not in state.values and symbol not in state.drifting]
        states = [symbol for z, symbol in zip(m.z, s.states, strict=True) if z not in state.values]
        self.multipliers = list(multipliers.values())
        self.unknown: list[sp.Symbol] = [*self.coordinates, *states, *self.multipliers]
        # In their shortest form sums of angles stand as such, so that they become base angles.
        result = written(entries, {**self.equations.printed_leaves(), **state.symbols, **multipliers})
        self.entries = [with_known_angles(e.xreplace({f: _decimal(f) for f in e.atoms(sp.Float)})) for e in result]
        if any(time in symbols_of(e) for e in self.entries):
            raise SymdynError(f"{self.equations.name}: equilibria in closed form were requested, but the time stands in its "
                              "equations, so that a state of rest at one time is none at another; use module.periodic, or "
                              "module.equilibria(t=...)")
        nodes, symbols = recorded(self.entries)
        self.leaves = {symbol: leaf for leaf, symbol in symbols.items()}
        self.unknown_leaves = {leaf for leaf, symbol in symbols.items() if symbol in self.unknown}
        self.exact = exact = Exact(nodes, positive=not_negative(symbols))
        self.writer = Writer(exact, symbols)
        self.assumed: dict[sp.Expr, None] = {}
        self.needed: dict[sp.Expr, None] = {}
        self._split: dict[sp.Expr, list[sp.Expr]] = {}
        self.pairs: dict[int, tuple[sp.Symbol, sp.Symbol]] = {}
        self.letters: dict[int, sp.Expr] = {}
        self._name_letters()
        polynomials = []
        for value in exact.values:
            for k, _ in value.under:
                self._assume(self._polynomial(exact.ring.factors[k]))
            polynomials.append(self._polynomial(value.num))
        self.start = _Case(tuple(polynomials))

    def _name_letters(self) -> None:
        """Name the generators of the ring in the polynomials. Raises SymdynError where unknowns stand elsewhere."""
        exact, name = self.exact, self.equations.name
        used = {k for v in exact.values for p in (v.num, *[exact.ring.factors[f] for f, _ in v.under])
                for k, degree in enumerate(p.degrees()) if degree > 0}  # of zero they are -1
        turning: set[Node] = set()
        unknown = self.unknown_leaves
        for k, (sine, cosine) in enumerate(exact.sines):
            nodes = {node for term in exact.bases[k] for node in term}
            own = unknown & nodes
            if not own and all(n.op == "leaf" or n.op == "pi" for n in nodes):
                continue
            if any(len(term) > 1 and set(term) & own for term in exact.bases[k]) or not own:
                if used & {sine, cosine}:
                    raise SymdynError(f"{name}: equilibria in closed form were requested, but {self.writer.expression(sine)} is "
                                      "no sine of a sum of coordinates; use module.equilibria()")
                continue
            self.pairs[k] = (sp.Dummy(f"s{k}", real=True), sp.Dummy(f"c{k}", real=True))
            self.letters[sine], self.letters[cosine] = self.pairs[k]
            turning |= own
        for k in used:
            if k in self.letters:
                continue
            leaf = exact.leaves.get(k)
            if leaf is not None and leaf in unknown:
                if leaf in turning:
                    raise SymdynError(f"{name}: equilibria in closed form were requested, but {self.writer.expression(k)} stands "
                                      "within angles and outside of them, so that the conditions are no polynomials; use "
                                      "module.equilibria()")
                self.letters[k] = self.writer.expression(k)
                continue
            e = self.writer.expression(k)
            if e.free_symbols & set(self.unknown):
                raise SymdynError(f"{name}: equilibria in closed form were requested, but the conditions hold {shown(e)}, which "
                                  "is no polynomial; use module.equilibria()")
            self.letters[k] = e
        angles = [q for q in self.coordinates if self.leaves.get(q) in turning]
        if len(self.pairs) != len(angles):
            raise SymdynError(f"{name}: equilibria in closed form were requested, but {len(self.pairs)} angles that are no sums "
                              f"of each other depend on {len(angles)} coordinates; put numbers in place of parameters, or use "
                              "module.equilibria()")
        self.turning = angles

    def _polynomial(self, num: Any) -> sp.Expr:
        return sp.Add(*[sp.Mul(_exact(c), *[self.letters[k] ** n for k, n in m]) for m, c in plain(num).items()])

    # -- the search

    def result(self) -> EquilibriumPoints:
        cases, done = [self.start], []
        for _ in range(CASES):
            if not cases:
                break
            case = cases.pop(0)
            following = self._next(case)
            if following is None:
                done.append(case)
            else:
                cases = [*following, *cases]
        else:
            raise SymdynError(f"{self.equations.name}: equilibria in closed form have more than {CASES} cases; fix coordinates")
        points: dict[Any, EquilibriumPoint] = {}
        for case in done:
            point = self._point(case)
            if point is not None:
                points.setdefault((tuple(point.values.items()), point.conditions), point)
        assumed = tuple(e for e in self.assumed if not e.is_nonzero and not e.is_number)
        found = [p for p in points.values() if not any(q is not p and _within(p, q) for q in points.values())]
        return EquilibriumPoints(self.equations.name, tuple(found), assumed, () if points else tuple(self.needed))

    @property
    def _names(self) -> set[sp.Symbol]:
        return {s for pair in self.pairs.values() for s in pair} | set(self.unknown)

    def _reduced(self, e: sp.Expr) -> sp.Expr:
        """Without s^2, multiplied out."""
        e = sp.expand(e)
        for s, c in self.pairs.values():
            if e.has(s):
                p = sp.Poly(e, s)
                e = sp.expand(sum(a * (1 - c**2) ** (k // 2) * s ** (k % 2) for (k,), a in p.terms()))
        return e

    def _next(self, case: _Case) -> list[_Case] | None:
        """The cases that a case falls into; None where nothing is left to be zero."""
        left: list[sp.Expr] = []
        for e in dict.fromkeys(map(self._reduced, case.left)):
            if e == 0 or (not e.free_symbols & self._names and (_proved(e) or _vanishes(e))):
                continue
            if not e.free_symbols & self._names:
                self.needed.setdefault(sp.factor(e))
                return []
            left.append(e)
        if not left:
            return None
        solved = self._forces(case, left)
        if solved is not None:
            return [solved]
        # The simplest first: what it gives makes the others shorter.
        left.sort(key=lambda e: (len(self._unknowns(e)), sp.count_ops(e)))
        for k, e in enumerate(left):
            factors = self._factors(e)
            rest = (*left[:k], *left[k + 1:])
            if len(factors) > 1:
                return [_Case((f, *rest), case.found, case.angles, case.conditions) for f in factors]
            left[k] = e = factors[0]
            case = _Case((e, *rest), case.found, case.angles, case.conditions)
            unknowns = self._unknowns(e)
            result = self._single(case, e, unknowns[0]) if len(unknowns) == 1 else None
            if result is not None:
                return result
            linear = self._linear(case, e)
            if linear is not None:
                return [linear]
        closed = self._closed(case)
        return self._by_basis(case) if closed is None else [closed]

    def _factors(self, e: sp.Expr) -> list[sp.Expr]:
        """Factors that hold unknowns, each once; those in parameters are taken not to be zero."""
        if e not in self._split:
            own = []
            # Linear elimination leaves divisors in parameters, which are taken not to be zero.
            for f, _ in sp.factor_list(sp.fraction(sp.together(e))[0])[1]:
                if f.free_symbols & self._names:
                    own.append(f)
                else:
                    self._assume(f)
            self._split[e] = own
        return self._split[e]

    def _assume(self, e: sp.Expr) -> None:
        """Take an expression in parameters not to be zero."""
        self.assumed.update((f, None) for f, _ in sp.factor_list(e)[1])

    def _unknowns(self, e: sp.Expr) -> list[Any]:
        """Numbers of base angles, and symbols of other unknowns."""
        free = e.free_symbols
        return [*[k for k, pair in self.pairs.items() if free & set(pair)], *[x for x in self.unknown if x in free]]

    def _linear(self, case: _Case, e: sp.Expr) -> _Case | None:
        """An unknown outside of angles eliminated that stands linearly, with a factor in parameters."""
        for x in self._unknowns(e):
            if isinstance(x, sp.Symbol):
                p = sp.Poly(e, x)
                if p.degree() == 1 and not p.coeff_monomial(x).free_symbols & self._names:
                    self._assume(p.coeff_monomial(x))
                    return case.put({x: -p.coeff_monomial(1) / p.coeff_monomial(x)})
        return None

    def _forces(self, case: _Case, left: Sequence[sp.Expr]) -> _Case | None:
        """Multipliers where nothing else is unknown and as many equations as multipliers are left."""
        unknown = [x for x in self.multipliers if any(e.has(x) for e in left)]
        if len(unknown) != len(left) or any(e.free_symbols & (self._names - set(unknown)) for e in left):
            return None
        matrix, right = sp.linear_eq_to_matrix(list(left), unknown)
        below = matrix.det(method="berkowitz")
        if _proved(below) or _vanishes(below):
            return None
        result = matrix.adjugate() * right / below
        return _Case((), case.found, case.angles, case.conditions).put(dict(zip(unknown, result, strict=True)))

    def _closed(self, case: _Case) -> _Case | None:
        """Sine and cosine of an angle eliminated from two equations in which they stand linearly, as where a loop closes:
        a s + b c + d = 0 twice; then s^2 + c^2 = 1 is an equation for what is in d."""
        for k, (s, c) in self.pairs.items():
            rows = [p for p in (sp.Poly(e, s, c) for e in case.left) if p.total_degree() == 1
                    and not any(p.coeff_monomial(x).free_symbols & self._names for x in (s, c))]
            for one, other in combinations(rows, 2):
                matrix = sp.Matrix([[p.coeff_monomial(x) for x in (s, c)] for p in (one, other)])
                regular = sp.factor(matrix.det())
                if regular == 0:
                    continue
                self._assume(regular)
                sine, cosine = (sp.factor(e) for e in matrix.adjugate() * sp.Matrix([-p.coeff_monomial(1) for p in (one, other)])
                                / regular)
                result = case.put({s: sine, c: cosine}, {k: sp.atan2(sine, cosine)})
                return replace(result, left=(*result.left, sine**2 + cosine**2 - 1))
        return None

    def _single(self, case: _Case, e: sp.Expr, unknown: Any) -> list[_Case] | None:
        """An equation in one unknown solved; None where it has no closed form."""
        if isinstance(unknown, sp.Symbol):
            roots = self._roots(e, unknown)
            return None if roots is None else [case.put({unknown: x}, None, conditions) for x, conditions in roots]
        s, c = self.pairs[unknown]
        p = sp.Poly(e, s, c)
        if p.total_degree() == 1:
            return [case.put({s: sine, c: cosine}, {unknown: angle}, conditions)
                    for sine, cosine, angle, conditions in self._circle(*[p.coeff_monomial(k) for k in (s, c, 1)])]
        if p.degree(s) == 0:
            roots = self._roots(e, c)
            if roots is None:
                return None
            return [case.put({s: sine, c: x}, {unknown: angle}, [*conditions, *more]) for x, conditions in roots
                    for sine, _, angle, more in self._circle(sp.S.Zero, sp.S.One, -x)]
        if p.free_symbols_in_domain or not p.domain.is_Numerical:
            return None
        # a(c) + s b(c) = 0: a^2 = (1 - c^2) b^2.
        q = sp.Poly(e, s)
        a, b = q.coeff_monomial(1), q.coeff_monomial(s)
        result = []
        for x in sp.Poly(sp.expand(a**2 - (1 - c**2) * b**2), c).real_roots():
            if sp.Abs(x) > 1:
                continue
            slope = b.subs(c, x)
            sines = [-a.subs(c, x) / slope] if slope != 0 else [sp.sqrt(1 - x**2), -sp.sqrt(1 - x**2)]
            result += [case.put({s: y, c: x}, {unknown: sp.atan2(y, x)}) for y in dict.fromkeys(sines)]
        return result

    def _roots(self, e: sp.Expr, x: sp.Symbol) -> list[tuple[sp.Expr, list[sp.Basic]]] | None:
        """Real roots with the conditions for them; None where they have no closed form."""
        p = sp.Poly(e, x)
        if not p.free_symbols_in_domain and p.domain.is_Numerical:
            return [(root, []) for root in dict.fromkeys(sp.Poly(sp.nsimplify(p.as_expr(), rational=True), x).real_roots())]
        coefficients = p.all_coeffs()
        self._assume(coefficients[0])
        if len(coefficients) == 2:
            return [(-coefficients[1] / coefficients[0], [])]
        if len(coefficients) == 3:
            a, b, d = coefficients
            inside = sp.factor(b**2 - 4 * a * d)
            if inside.is_negative:
                return []
            real = [] if inside.is_nonnegative else [sp.GreaterThan(inside, 0)]
            return [((-b + sign * sp.sqrt(inside)) / (2 * a), real) for sign in (1, -1)]
        return None

    def _circle(self, a: sp.Expr, b: sp.Expr, d: sp.Expr) -> list[tuple[sp.Expr, sp.Expr, sp.Expr, list[sp.Basic]]]:
        """Sine, cosine, angle and conditions with a s + b c + d = 0."""
        if d == 0:
            if b == 0:
                return [(sp.S.Zero, sp.S.One, sp.S.Zero, []), (sp.S.Zero, sp.S.NegativeOne, sp.pi, [])]
            if a == 0:
                return [(sp.S.One, sp.S.Zero, sp.pi / 2, []), (sp.S.NegativeOne, sp.S.Zero, -sp.pi / 2, [])]
        size = sp.factor(a**2 + b**2)
        self._assume(size)
        root = sp.sqrt(size)
        if d == 0:
            return [(sign * b / root, -sign * a / root, sp.atan2(sign * b, -sign * a), []) for sign in (1, -1)]
        if a == 0 or b == 0:
            v = -d / (a + b)
            if v in (1, -1):  # the circle is touched once
                return [(v, sp.S.Zero, v * sp.pi / 2, []) if b == 0 else (sp.S.Zero, v, sp.acos(v), [])]
            inside = sp.Abs(v) <= 1
            if inside == False:  # noqa: E712
                return []
            other = sp.sqrt(1 - v**2)
            if b == 0:
                return [(v, other, sp.asin(v), [inside]), (v, -other, sp.pi - sp.asin(v), [inside])]
            return [(other, v, sp.acos(v), [inside]), (-other, v, -sp.acos(v), [inside])]
        inside = d**2 <= size
        if inside == False:  # noqa: E712
            return []
        w, middle = sp.sqrt(size - d**2), sp.atan2(a, b)
        return [((-a * d + sign * b * w) / size, (-b * d - sign * a * w) / size, middle + sign * sp.acos(-d / root), [inside])
                for sign in (1, -1)]

    def _by_basis(self, case: _Case) -> list[_Case]:
        """Coupled equations with numbers made triangular. Raises SymdynError for others."""
        names = [x for x in (*[s for pair in self.pairs.values() for s in pair], *self.unknown)
                 if any(e.has(x) for e in case.left)]
        coupled = sorted({str(self._angle(x)) for e in case.left for x in self._unknowns(e)})
        problem = (f"{self.equations.name}: the conditions of equilibrium stay coupled in {', '.join(coupled)} and are not "
                "solved in closed form")
        if any(e.atoms(sp.Symbol) - set(names) for e in case.left):
            raise SymdynError(f"{problem}; pass numbers for all parameters with values=..., fix some coordinates, or use "
                              "module.equilibria()")
        result = self._by_resultants(case)
        if result is not None:
            return result
        circles = [s**2 + c**2 - 1 for s, c in self.pairs.values() if s in names or c in names]
        basis = sp.groebner([*case.left, *circles], *names, order="lex")
        if basis.exprs == [1]:
            return []
        polynomials = [e for e in basis.exprs if self._reduced(e) != 0]
        if not any(len(self._unknowns(e)) == 1 for e in polynomials) or set(polynomials) == set(case.left):
            raise SymdynError(f"{problem}: they do not hold at single states; fix some coordinates, or use module.equilibria()")
        return [_Case(tuple(polynomials), case.found, case.angles, case.conditions)]

    def _by_resultants(self, case: _Case) -> list[_Case] | None:
        """Two angles from a loop's closure, linear in sine and cosine of one of them, and from what remains of the balance of
        forces once multipliers are eliminated: a polynomial in the cosine of the other. None where it is not so."""
        pairs = [k for k, pair in self.pairs.items() if any(e.free_symbols & set(pair) for e in case.left)]
        multipliers = [x for x in self.multipliers if any(e.has(x) for e in case.left)]
        loaded = [e for e in case.left if e.free_symbols & set(multipliers)]
        letters = {s for k in pairs for s in self.pairs[k]}
        if len(pairs) != 2 or len(case.left) - len(loaded) != 1 or len(loaded) != len(multipliers) + 1 \
                or any(e.free_symbols - letters - set(multipliers) for e in case.left):
            return None
        closure, = [e for e in case.left if e not in loaded]
        try:
            matrix, right = sp.linear_eq_to_matrix(loaded, multipliers)
        except sp.NonlinearError:
            return None
        balance = sp.expand(matrix.row_join(right).det(method="berkowitz"))
        for first, second in (pairs, pairs[::-1]):
            linear = sp.Poly(closure, *self.pairs[second])
            if linear.total_degree() == 1:
                cosines = _cosines(closure, balance, *self.pairs[second], *self.pairs[first])
                if cosines is not None:
                    points = self._turns(linear, balance, self.pairs[first], cosines)
                    return None if points is None else self._balanced(case, first, second, points, matrix, right)
        return None

    def _turns(self, linear: sp.Poly, balance: sp.Expr, first: tuple[sp.Symbol, sp.Symbol], cosines: Sequence[sp.Expr],
               ) -> list[dict[sp.Symbol, sp.Expr]] | None:
        """Sines and cosines that close the loop and balance it; None where the loop leaves an angle open."""
        s, c = linear.gens
        result = []
        for x in cosines:
            for y in dict.fromkeys([sp.sqrt(1 - x**2), -sp.sqrt(1 - x**2)]):
                a, b, d = (linear.coeff_monomial(k).subs(dict(zip(first, (y, x), strict=True))) for k in (s, c, 1))
                size = a**2 + b**2
                inside = size - d**2
                if _small(size):
                    if _small(d):
                        return None
                    continue
                if _small(inside):
                    inside = sp.S.Zero
                elif _digits(inside) < 0:
                    continue
                for w in dict.fromkeys([sp.sqrt(inside), -sp.sqrt(inside)]):
                    point = {**dict(zip(first, (y, x), strict=True)), s: (b * w - a * d) / size, c: (-a * w - b * d) / size}
                    if _small(balance.subs({letter: _digits(e) for letter, e in point.items()})):
                        result.append(point)
        return result

    def _balanced(self, case: _Case, first: int, second: int, points: Sequence[dict[sp.Symbol, sp.Expr]], matrix: sp.Matrix,
                  right: sp.Matrix) -> list[_Case] | None:
        """Cases with multipliers; None where a point leaves one open."""
        cases = []
        multipliers = [x for x in self.multipliers if any(e.has(x) for e in case.left)]
        for point in points:
            values = dict(point)
            if multipliers:
                minors = {rows: _minor(matrix, rows, point) for rows in combinations(range(matrix.rows), matrix.cols)}
                rows, below = max(minors.items(), key=lambda item: abs(_digits(item[1])))
                if _small(below):
                    return None
                forces = matrix.extract(list(rows), list(range(matrix.cols))).xreplace(point).adjugate() \
                    * right.extract(list(rows), [0]).xreplace(point) / below
                values |= dict(zip(multipliers, forces, strict=True))
            angles = {k: sp.atan2(*[point[x] for x in self.pairs[k]]) for k in (first, second)}
            cases.append(replace(case, left=()).put(values, angles))  # none is left: nothing is put into it
        return cases

    def _angle(self, unknown: Any) -> sp.Expr:
        if isinstance(unknown, sp.Symbol):
            return unknown
        return self.writer.expression(self.exact.sines[unknown][0]).args[0]

    # -- what is found

    def _point(self, case: _Case) -> EquilibriumPoint | None:
        """Coordinates of a case; None where it contradicts itself. Raises SymdynError where what was found is none."""
        values = {x: e for x, e in case.found if x in self.unknown}
        free = [x for x in self.unknown if x not in self.turning and x not in values]
        if self.pairs:
            turned, letters = self._turned(dict(case.angles))
            free += [q for q in self.turning if q not in turned]
            values = {x: e.subs(letters) for x, e in {**values, **turned}.items()}
        if any(c == False for c in case.conditions):  # noqa: E712
            return None
        ordered = {x: values[x] for x in self.unknown if x in values}
        if any(e.has(sp.CRootOf) for e in ordered.values()) and not any(e.free_symbols for e in ordered.values()):
            # Roots of polynomials of high degree take minutes within functions; nothing is proved of them anyway.
            numbers = {x: _digits(e) for x, e in ordered.items()}
            if not all(_small(e.subs(numbers)) for e in self.entries):
                return None
            return EquilibriumPoint(ordered, tuple(free), tuple(dict.fromkeys(case.conditions)), False)
        residuals = [e.subs(ordered) for e in self.entries]
        proved = all(e == 0 or _proved(e) for e in residuals)
        if not proved and any(not e.free_symbols and not _vanishes(e) for e in residuals):
            return None
        wrong = [] if proved else [e for e in residuals if e.free_symbols and not _fulfilled(e, case.conditions)]
        if wrong:
            where = ", ".join(f"{x} = {e}" for x, e in ordered.items())
            raise SymdynError(f"{self.equations.name}: equilibria in closed form were requested, but {where} leaves "
                              f"{shown(wrong[0])}, which is not zero; use module.equilibria()")
        return EquilibriumPoint(ordered, tuple(free), tuple(dict.fromkeys(case.conditions)), proved)

    def _turned(self, angles: dict[int, sp.Expr]) -> tuple[dict[sp.Symbol, sp.Expr], dict[sp.Symbol, sp.Expr]]:
        """Coordinates within angles, from base angles; and sines and cosines of base angles that may have any value. These leave
        as many coordinates free, the first ones that determine them, in which the others are written."""
        loose = {k: sp.Dummy(f"angle{k}", real=True) for k in self.pairs if k not in angles}
        # Letters for roots of polynomials of high degree, with which SymPy takes long for sums.
        roots = {k: sp.Dummy(f"root{k}", real=True) for k, angle in angles.items() if angle.has(sp.CRootOf)}
        back = {letter: angles[k] for k, letter in roots.items()}
        rows, right = [], []
        for k in self.pairs:
            base = self.exact.bases[k]
            rows.append([sp.Rational(str(base.get((self.leaves[q],), 0))) for q in self.turning])
            constant = sp.Add(*[_exact(f) * sp.Mul(*[self.writer.angles.node(n) for n in term]) for term, f in base.items()
                                if not set(term) & self.unknown_leaves])
            right.append({**angles, **loose, **roots}[k] - constant)
        result = dict(zip(self.turning, sp.Matrix(rows).LUsolve(sp.Matrix(right)), strict=True))
        if not loose:
            return {q: _whole(value).xreplace(back) for q, value in result.items()}, {}
        result = {q: value.xreplace(back) for q, value in result.items()}
        unknown, letters = list(loose.values()), {s for k in loose for s in self.pairs[k]}
        leading: list[sp.Symbol] = []
        for q, value in result.items():
            slopes = sp.Matrix([[result[x].coeff(d) for d in unknown] for x in (*leading, q)])
            if not value.free_symbols & letters and slopes.rank() == len(leading) + 1:
                leading.append(q)
        if len(leading) < len(unknown):
            raise SymdynError(f"{self.equations.name}: equilibria in closed form were requested, but at some of them "
                              f"{', '.join(str(q) for q in result)} depend on each other; fix some of them, or use "
                              "module.equilibria()")
        slopes = sp.Matrix([[result[q].coeff(d) for d in unknown] for q in leading])
        at_zero = dict.fromkeys(unknown, sp.S.Zero)
        solved = dict(zip(unknown, slopes.LUsolve(sp.Matrix([q - result[q].subs(at_zero) for q in leading])), strict=True))
        known = {letter: function(sp.expand(solved[d])) for k, d in loose.items()
                 for letter, function in zip(self.pairs[k], (sp.sin, sp.cos), strict=True)}
        return {q: _whole(sp.expand(value.subs(solved)).subs(known)) for q, value in result.items() if q not in leading}, known


def _digits(e: sp.Expr) -> sp.Expr:
    """The value of a number, with digits to spare: those of roots first, which takes a fraction of the time."""
    return e.xreplace({root: root.evalf(3 * DIGITS) for root in e.atoms(sp.CRootOf)}).evalf(2 * DIGITS)


def _small(e: sp.Expr) -> bool:
    """Whether a number is zero but for rounding of what `_digits` gives."""
    return bool(abs(_digits(e)) < ZERO)


def _minor(matrix: sp.Matrix, rows: Sequence[int], values: dict[sp.Symbol, sp.Expr]) -> sp.Expr:
    """The determinant of some rows."""
    return matrix.extract(list(rows), list(range(matrix.cols))).det(method="berkowitz").xreplace(values)


def _cosines(one: sp.Expr, other: sp.Expr, s: sp.Symbol, c: sp.Symbol, sine: sp.Symbol, cosine: sp.Symbol,
             ) -> list[sp.Expr] | None:
    """All cosines at which two polynomials in sines and cosines of two angles may vanish, the first linear in s and c: the real
    roots of a resultant of their resultants. None where that is zero."""
    names = (s, c, sine, cosine)
    context = fmpq_mpoly_ctx.get(tuple(map(str, range(4))), "lex")
    a, b = (context.from_dict({m: fmpq(int(n.p), int(n.q)) for m, n in sp.Poly(e, *names).terms()}) for e in (one, other))
    turns = [context.gens()[k] ** 2 + context.gens()[k + 1] ** 2 - 1 for k in (0, 2)]
    without = [divmod(a.resultant(p, 0), turns[1])[1] for p in (turns[0], b)]
    left = divmod(without[0].resultant(without[1], 1), turns[1])[1].resultant(turns[1], 2)
    if len(left) == 0:
        return None
    roots: list[sp.Expr] = []
    for factor, _ in left.factor()[1]:
        p = sp.Poly.from_dict({(m[3],): sp.Rational(int(n.p), int(n.q)) for m, n in factor.terms()}, cosine)
        roots += [root for root in p.real_roots() if -1 <= root.evalf(30) <= 1]
    return roots


def _decimal(value: Any) -> Any:
    """A decimal number as a fraction of integers; 0.1 is 1/10. Anything else as it is."""
    return sp.Rational(str(value)) if isinstance(value, (float, sp.Float)) and math.isfinite(value) else value


def _exact(value: Any) -> sp.Rational:
    """A number of a polynomial as a fraction: SymPy's floats would be rounded in every product."""
    value = Fraction(value)
    return sp.Rational(value.numerator, value.denominator)


def _proved(e: sp.Expr) -> bool:
    e = _plain(e)
    return not e.has(sp.CRootOf, sp.atan2) and prove(e).proved


def _vanishes(e: sp.Expr) -> bool:
    """Whether a number is zero to 30 digits."""
    return not e.free_symbols and bool(abs(e.evalf(30)) < ZERO)


def _fulfilled(e: sp.Expr, conditions: Sequence[sp.Basic]) -> bool:
    """Whether an expression is zero to 30 digits at numbers for its symbols that meet the conditions, as far as any are found."""
    symbols = sorted(set().union(e.free_symbols, *(c.free_symbols for c in conditions)), key=str)
    for k in range(SAMPLES):
        # Fractions of different primes; half of the samples have both signs where a symbol may be negative.
        numbers = {x: sp.Rational(sp.prime(3 + k + 5 * j), sp.prime(4 + 2 * k + 3 * j)) for j, x in enumerate(symbols)}
        numbers = {x: -v if k % 2 and j % 2 and x.is_negative is not False else v for j, (x, v) in enumerate(numbers.items())}
        if all(c.subs(numbers) == True for c in conditions):  # noqa: E712
            return bool(abs(e.subs(numbers).evalf(30)) < NEAR)
    return True


def _whole(value: sp.Expr) -> sp.Expr:
    """An angle; between -pi and pi where it is a multiple of pi."""
    return _within_turn(sp.expand(value) if value.has(sp.pi) else value)


def _plain(e: sp.Expr) -> sp.Expr:
    """Sines and cosines of arc functions and sums of these written by roots."""
    return sp.expand_trig(e) if e.has(sp.acos, sp.asin, sp.atan2) else e


def _within_turn(angle: sp.Expr) -> sp.Expr:
    """A multiple of pi between -pi (left out) and pi; anything else as it is."""
    turns = angle / (2 * sp.pi)
    if not turns.is_Rational:
        return angle
    turns -= sp.ceiling(turns - sp.Rational(1, 2))
    return 2 * sp.pi * turns
