"""Stability of a state of rest, a steady motion or a periodic motion: one verdict, with what it rests on."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg

from symdyn.errors import ArgumentError, EvaluationError, NoEquilibrium
from symdyn.runtime.consistent import number
from symdyn.shown import name_of, shown
from symdyn.statics.analysis import WORDS, Analysis, decade, held_note, reason, shapes_of
from symdyn.statics.course import Course, autonomous, closed_course, comes_back, follow, scales
from symdyn.statics.equilibrium import Equilibrium, equilibrium
from symdyn.statics.floquet import exponents, fundamental, monodromy, multipliers
from symdyn.statics.frames import ROUNDED, Change, Observer, Seen, constant_change, spinning
from symdyn.statics.gimbal import demand_no_lock
from symdyn.statics.kinks import kink, no_linear_equations
from symdyn.statics.manifold import Manifold, in_motion
from symdyn.statics.modes import Modes, modes_of, ordered, settled_values
from symdyn.statics.selection import holding
from symdyn.statics.singular import singular_configuration
from symdyn.statics.spectrum import CONTINUOUS, Spectrum, spectrum
from symdyn.statics.steady import accelerating, depends_on_time, fastest, steadiness
from symdyn.statics.terms import coordinate_names
from symdyn.turning import in_radians

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Speeds of several rotors have a common period if their ratio is one of whole numbers up to this.
WHOLE = 60
# Turns of the fastest speed that a period may have.
MOST_TURNS = 1000
KINDS = ("rest", "steady motion", "periodic motion")


@dataclass(frozen=True, eq=False)
class Stability:
    """The fate of small disturbances of a motion; prints as a page.

    verdict      "stable" (all exponents proved negative), "neutral" (none positive, zero ones without Jordan blocks), "drifts"
                 (with a Jordan block: a disturbance grows with time), "unstable" (one proved positive), "not decided" (rounding
                 hides a sign, or the position is singular); "" if nothing is free to move
    kind         "rest", "steady motion" or "periodic motion"; period: s, None unless periodic or turning
    exponents    (m,) complex, 1/s: of constant equations their eigenvalues; of periodic ones log(multiplier) / period, with the
                 frequency that a motion shows in the fixed frame
    multipliers  (m,) complex, what a disturbance is multiplied by in a period; None without a period
    modes        with shapes at the start, and harmonics
    evidence     sentences: what was checked and found; reason: the last of them
    motion       the pair (t, x), t (n,) and x (n, n_x) over a period, where the equations are not constant in the coordinates
                 of the model

    >>> stability = sd.systems.pendulum().compile(backend="numpy").stability({"q1": np.pi})
    >>> stability.verdict, stability.stable, stability.reason
    ('unstable', False, 'an exponent is proved positive: 3.13209 1/s')
    """

    title: str
    verdict: str
    kind: str
    period: float | None
    exponents: np.ndarray
    multipliers: np.ndarray | None
    modes: Modes
    evidence: tuple[str, ...]
    held: tuple[str, ...]
    motion: tuple[np.ndarray, np.ndarray] | None

    @property
    def reason(self) -> str:
        """The last sentence of the evidence, which decides.

        >>> sd.systems.pendulum().compile(backend="numpy").stability({"q1": np.pi}).reason
        'an exponent is proved positive: 3.13209 1/s'
        """
        return self.evidence[-1]

    @property
    def stable(self) -> bool | None:
        """True where the verdict is "stable", False where it is "unstable" or "drifts", else None.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> print(module.stability({"q1": 0.0}).stable, module.stability({"q1": np.pi}).stable)
        None False
        """
        return {"stable": True, "unstable": False, "drifts": False}.get(self.verdict)

    def __repr__(self) -> str:
        lines = [f"{self.title}: {self.verdict or 'nothing free to move'} "
                 f"({self.kind})", *[f"  {each}" for each in self.evidence]]
        if self.multipliers is not None:
            shown = ", ".join(f"{abs(m):.6g}" for m in sorted(self.multipliers, key=lambda v: -abs(v))[:6])
            lines.append(f"  sizes of the multipliers: {shown}{', ...' if len(self.multipliers) > 6 else ''}")
        return "\n".join([*lines, repr(self.modes)] if len(self.modes) else lines)


def stability(module: Module, at: Any = None, params: Any = None, t: float = 0.0, inputs: Any = None, free: Any = None,
              fixed: Any = None, hold: Any = None, period: float | None = None, start: Any = None) -> Stability:
    """See Module.stability."""
    from symdyn.statics.linearize import state_of

    if isinstance(period, bool):
        raise ArgumentError(f"{module.name}: pass a period in seconds, found {shown(period)}")
    if period is not None:
        period = number(period, "a period in seconds", module.name)
        if period <= 0:
            raise ArgumentError(f"{module.name}: the period must be more than 0 s, found {period:g}")
    if at is not None and start is not None:
        raise ArgumentError(f"{module.name}: at and start are both given; at is the motion to be judged, start a guess of it: "
                            "pass one of them")
    if isinstance(at, Equilibrium):
        if at.module is not module:
            raise ArgumentError(f"{module.name}: the equilibrium is of {at.module.name}, another module; use its own")
        given = [n for n, v in (("params", params), ("inputs", inputs), ("free", free), ("fixed", fixed)) if v is not None]
        if given:
            raise ArgumentError(f"{module.name}: {', '.join(given)} given with an equilibrium, which has its own; leave them out")
        selection = holding(at.selection, hold)
        return of_manifold(Manifold(in_motion(at.point, selection), selection), period)
    speeds = {name_of(k) for k in fixed} & set(module.metadata.u) if isinstance(fixed, Mapping) else set()
    if start is not None and period is None and not speeds:
        rest = equilibrium(module, free, fixed, start, params, t, inputs)
        return of_manifold(Manifold(in_motion(rest.point, holding(rest.selection, hold)), holding(rest.selection, hold)))
    guess = start is not None or at is None
    if start is not None:
        at = start
    if at is None and isinstance(fixed, Mapping):
        at = _still(module)
    point, selection = state_of(module, at, params, t, inputs, free, fixed, hold, guess)
    return of_manifold(Manifold(point, selection), period)


def _still(module: Module) -> dict[str, float]:
    """The initial values with speeds zero: where a search for a motion with prescribed speeds begins."""
    metadata = module.metadata
    return {n: 0.0 if n in metadata.u and n not in metadata.q else metadata.initial.get(n, 0.0) for n in metadata.x}


def of_manifold(manifold: Manifold, period: float | None = None, rotating: bool = False) -> Stability:
    """The verdict about the motion through the state of a manifold. Raises ArgumentError, NoEquilibrium.

    rotating   frequencies are those that an observer sees who turns with the rotor
    """
    point = manifold.point
    title = f"{point.module.name}: stability"
    if not manifold.n_d + manifold.n_s + len(manifold.states):
        nothing = np.zeros(0, dtype=complex)
        return Stability(title, "", "rest" if not point.u.any() else "motion", None, nothing, None, Modes(title, []),
                         (*held_note(manifold), WORDS[""]), manifold.selection.held, None)
    demand_no_lock(point, "the stability was")
    undecided = singular_configuration(point, manifold.selection)
    steady = steadiness(manifold) if not undecided else None
    if steady is None or steady.kind:
        broken = "" if undecided else kink(point, manifold.selection)
        undecided = undecided or (no_linear_equations(broken) if broken else "")
    if steady is None or undecided:
        nothing = np.zeros(0, dtype=complex)
        return Stability(title, "not decided", "rest" if not point.u.any() else "motion", None, nothing, None, Modes(title, []),
                         (*held_note(manifold), undecided), manifold.selection.held, None)
    if period is not None and fastest(point) * period > 2 * np.pi * MOST_TURNS:
        raise ArgumentError(f"{point.module.name}: a period of {period:g} s is more than {MOST_TURNS} turns of the fastest "
                            "speed; pass the period of the motion")
    length = period if period is not None else found_period(manifold)
    if steady.kind == "rest" and not depends_on_time(point):
        return _constant(manifold, steady.kind, title)
    if steady.kind and length is None:
        return _constant(manifold, steady.kind, title)
    if length is None:
        what = "t appears in the equations" if depends_on_time(point) else "no single speed of rotation gives a period"
        guess = ", a guess of it," if autonomous(manifold) else ""
        raise ArgumentError(f"{point.module.name}: neither rest nor steady motion: {steady.reason}; {what}: pass period=..., in "
                            f"seconds{guess} if the motion is periodic; of other motions eigenvalues say nothing")
    if steady.kind:
        course = follow(manifold, length)
        change = constant_change(course)
        seen_by = Observer(course, rotating)
        return _turned(course, change, steady.kind, title, seen_by) if change else _named(course, steady.kind, title, seen_by)
    open_course = None if accelerating(point, manifold) else follow(manifold, length, closed=False)
    if open_course is None or any(accelerating(node.point, node) for node in open_course.nodes):
        course, kind = closed_course(manifold, length, monodromy, open_course), "periodic motion"
        if not any(accelerating(node.point, node) for node in course.nodes):
            kind = "steady motion" if course.first.point.u.any() else "rest"
    else:
        course, kind = follow(manifold, length), "steady motion" if point.u.any() else "rest"
    change = constant_change(course)
    motion = (course.first.point.t + np.append(course.times, course.period),
              np.array([*[node.point.x for node in course.nodes], course.last.x]))
    seen_by = Observer(course, rotating)
    result = _periodic(course, kind, title, seen_by) if change is None else _turned(course, change, kind, title, seen_by)
    moved = float(np.abs(course.first.point.x - point.x).max(initial=0.0))
    guess = f", from a guess of {length:.6g} s for its period" if course.period != length else ""
    said = (result.evidence[0], f"found by Newton's method, {moved:.3g} away from the given state{guess}", *result.evidence[1:])
    return replace(result, motion=motion, evidence=said if moved else result.evidence)


def _constant(manifold: Manifold, kind: str, title: str) -> Stability:
    analysis = Analysis(manifold)
    evidence = (f"{kind}: accelerations vanish" + (", here and further on" if kind != "rest" else ""),
                "the linear equations are constant along the motion", *held_note(manifold), analysis.reason())
    return Stability(title, analysis.verdict, kind, None, analysis.eigenvalues, None, analysis.modes(f"{title}: modes"), evidence,
                     manifold.selection.held, None)


def _named(course: Course, kind: str, title: str, observer: Observer) -> Stability:
    """Constant equations in axes that turn."""
    analysis = Analysis(course.first)
    result = analysis.spectrum

    def shape(k: int) -> np.ndarray:
        return np.tile(course.widened(result.right[:, k]), (len(course.nodes), 1))

    values, seen = _as_seen(observer, settled_values(result), shape, False)
    evidence = (f"{kind}: accelerations vanish, here and further on",
                "the linear equations are constant along the motion in the coordinates of the model", observer.sentence,
                *held_note(course.first), analysis.reason())
    return _finished(course, result, values, seen, analysis.verdict, kind, title, evidence)


def _turned(course: Course, change: Change, kind: str, title: str, observer: Observer) -> Stability:
    """Constant equations after a change of variables."""
    analysis = Analysis(course.first)
    T, L = (course.first.bundle[:2] if course.bundled else 2 * [np.eye(len(course.A[0]))])
    S = course.reduced(change.S)
    result = spectrum(course.reduced(course.A[0] - change.S), analysis.noise.A.plus(np.abs(L) @ change.error @ np.abs(T)),
                      driven=lambda right, left: analysis.driven(right, left, S, ROUNDED * 2 * np.pi / course.period))
    turned = bool(np.abs(change.S).max(initial=0.0) > 1e-9 * np.abs(course.A).max(initial=0.0))
    powers = np.array([scipy.linalg.expm(change.S * t) for t in course.times])
    n_d = course.sizes[0]
    fixed = turned and observer.in_fixed_axes(powers[:, :n_d, :n_d])

    def shape(k: int) -> np.ndarray:
        return np.array([P @ course.widened(result.right[:, k]) for P in powers])

    values, seen = _as_seen(observer, settled_values(result), shape, fixed)
    how = "after a change of variables that turns steadily" if turned else "along the motion in the coordinates of the model"
    evidence = (f"{kind}, period {course.period:.6g} s",
                f"the linear equations are constant {how}, checked at {len(course.nodes)} positions to "
                f"{decade(_relative(change, course))} of their size", observer.sentence, *held_note(course.first), reason(result))
    return _finished(course, result, values, seen, result.verdict, kind, title, evidence)


def _periodic(course: Course, kind: str, title: str, observer: Observer) -> Stability:
    """Floquet theory."""
    carried = fundamental(course)
    result = multipliers(carried)
    logs = exponents(result, course.period)

    def shape(k: int) -> np.ndarray:
        decay = np.exp(-logs[k] * course.times)
        return np.asarray((carried.nodes @ course.widened(result.right[:, k])) * decay[:, None])

    values, seen = _as_seen(observer, logs, shape, False)
    margins = np.log(np.maximum(np.abs(result.values), 1e-300)) / course.period
    verdict = result.verdict
    decided = verdict in ("stable", "unstable")
    text = f"{WORDS[verdict]}: the largest is {margins.max(initial=-np.inf):.6g} 1/s" if decided else reason(result)
    error = float((carried.E / np.abs(carried.monodromy).max(initial=1e-300)).max(initial=0.0))
    evidence = (f"{kind}, linear equations of period {course.period:.6g} s, which return to within {decade(_return(course))}",
                "no change of variables that turns steadily makes them constant",
                f"monodromy matrix from {len(course.nodes)} positions, known to {decade(error)} of its size", observer.sentence,
                *held_note(course.first), text)
    judged = replace(result, boundary=CONTINUOUS)
    return _finished(course, judged, values, seen, verdict, kind, title, evidence, result.values)


def _finished(course: Course, result: Spectrum, values: np.ndarray, seen: list[Seen], verdict: str, kind: str, title: str,
              evidence: tuple[str, ...], factors: np.ndarray | None = None) -> Stability:
    """The result from exponents as an observer sees them; factors: multipliers, if not those of the exponents."""
    order = ordered(values)
    named = modes_of(result, shapes_of(course.first), f"{title}: modes", values=values, seen=seen)
    factors = np.exp(values * course.period) if factors is None else factors
    return Stability(title, verdict, kind, course.period, values[order], factors[order], named, evidence,
                     course.first.selection.held, None)


def _as_seen(observer: Observer, values: np.ndarray, shape: Callable[[int], np.ndarray],
             fixed: bool) -> tuple[np.ndarray, list[Seen]]:
    """Exponents with the multiple of the frequency that their largest harmonic has, and the harmonics counted from there."""
    shifted = values.astype(complex)
    result: dict[int, Seen] = {}
    for k in np.argsort(-values.imag, kind="stable").tolist():
        partner = _partner(values, k)
        if partner in result and partner != k:  # the two of a pair are seen alike, with opposite signs
            other = result[partner]
            main = round(float((shifted[partner] - values[partner]).imag * observer.course.period / (2 * np.pi)))
            shifted[k] -= 2j * np.pi / observer.course.period * main
            result[k] = replace(other, harmonics=tuple((-multiple, share) for multiple, share in other.harmonics))
            continue
        seen = observer.seen(shape(k), fixed)
        main = seen.harmonics[0][0]
        shifted[k] += 2j * np.pi / observer.course.period * main
        result[k] = replace(seen, harmonics=tuple((multiple - main, share) for multiple, share in seen.harmonics))
    return shifted, [result[k] for k in range(len(values))]


def _partner(values: np.ndarray, k: int) -> int:
    """The index of the complex conjugate of a value; k of a real one. Equal values are paired by their rank among them."""
    value = values[k]
    if abs(value.imag) <= 1e-12 * abs(value) or not value.imag:
        return k
    tolerance = 1e-9 * abs(value)
    alike = [j for j in range(len(values)) if abs(values[j] - value) <= tolerance]
    conjugate = [j for j in range(len(values)) if abs(values[j] - value.conjugate()) <= tolerance]
    rank = alike.index(k)
    return conjugate[rank] if rank < len(conjugate) else k


def _relative(change: Change, course: Course) -> float:
    scale = scales(course)
    into = scale / scale[:, None]
    return float((change.error * into).max(initial=0.0) / (np.abs(course.A[0]) * into).max(initial=1e-300))


def _return(course: Course) -> float:
    return float(np.abs(course.after - course.A[0]).max(initial=0.0) / max(np.abs(course.A).max(initial=0.0), 1e-300))


def found_period(manifold: Manifold) -> float | None:
    """The period of speeds that are held; else one after which the motion is where it was, of all that turns or of parts of it.

    None where there is none: a motion that nothing holds is not moved onto one of another period.
    """
    point = manifold.point
    metadata = point.module.metadata
    labels = coordinate_names(metadata)
    turning = {name: abs(float(u)) for u, name, label in zip(point.u, metadata.u, labels, strict=True)
               if u and in_radians(metadata.units.get(label, metadata.units.get(name, "")).removesuffix("/s"))}
    held = [speed for (name, speed), label in ((each, labels[metadata.u.index(each[0])]) for each in turning.items())
            if name in manifold.selection.held or label in manifold.selection.held]
    if held:
        return common_period(held)
    bodies = [float(w) for w in spinning(manifold) if w > 0]
    candidates = [common_period([*turning.values()]), common_period(bodies),
                  *[2 * np.pi / speed for speed in sorted({*turning.values(), *bodies})]]
    if not point.u.any():
        return None
    longest = 2 * np.pi * WHOLE / fastest(point)
    for candidate in dict.fromkeys(c for c in candidates if c is not None and c <= longest):
        try:
            if comes_back(follow(manifold, candidate, closed=False)):
                return candidate
        except (ArgumentError, EvaluationError, NoEquilibrium):
            continue
    return None


def common_period(speeds: Sequence[float]) -> float | None:
    """2 pi over a speed, of several speeds the least common period; None if there is none."""
    if not speeds:
        return None
    largest = max(speeds)
    ratios = []
    for speed in (w for w in speeds if w > 1e-9 * largest):
        ratio = Fraction(speed / largest).limit_denominator(WHOLE)
        if abs(float(ratio) - speed / largest) > 1e-9 or not ratio:
            return None
        ratios.append(ratio)
    denominator = int(np.lcm.reduce([r.denominator for r in ratios]))
    return 2 * np.pi / largest * denominator / int(np.gcd.reduce([int(r * denominator) for r in ratios]))
