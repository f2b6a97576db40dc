"""Motions with rigid contacts that are made in C, against the same laws in Python."""

from __future__ import annotations

import copy
import ctypes
import functools
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import SimulationInterrupted
from symdyn.runtime import contact_laws as laws
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import find_compiler, require_compiler
from symdyn.runtime.building.shared import shared, text
from symdyn.runtime.contact_laws import Site
from symdyn.runtime.integrating import contacts, hybrid, mode_codes
from symdyn.runtime.integrating.slip_begins import SlipBegins
from symdyn.thresholds import DEPENDENT
from tests.derivatives.test_periodic_contacts import after_heel_strike, walker
from tests.helpers import swept
from tests.runtime.test_rigid_contact import G, ball, planar

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


@functools.cache
def hybrid_in_c() -> ctypes.CDLL:
    return shared("hybrid", require_compiler())


def in_c(D: np.ndarray, b: np.ndarray, sites: list[Site]) -> tuple[int, list[str], np.ndarray, np.ndarray]:
    """Result of C, and modes, forces and accelerations."""
    n, rows = len(sites), np.array([0 if site.bounded else len(site.rows) for site in sites], dtype=np.intc)
    excluded = np.array([sum(1 << mode_codes.MODES.index(mode) for mode in site.excluded) for site in sites], dtype=np.intc)
    coefficients = np.array([[s.static, s.kinetic, 0.0 if s.slip is None or not len(s.slip) else s.slip[0]] for s in sites])
    mode, answer = np.zeros(n, dtype=np.intc), np.zeros(n + 2 * len(b))
    tolerances = np.array([laws.NOISE, DEPENDENT, laws.DIFFERENT, laws.KEPT])
    arrays = [rows, excluded, coefficients, np.ascontiguousarray(D), b, tolerances, mode, answer]
    found = hybrid_in_c().symdyn_hybrid_modes(n, *[ctypes.c_void_p(a.ctypes.data) for a in arrays])
    return found, [mode_codes.MODES[k] for k in mode.tolist()], answer[n:n + len(b)], answer[n + len(b):]


@pytest.mark.parametrize(("n", "problems"), [(1, 1500), (2, 400), *swept([(1, 9200), (2, 800), (3, 300)])])
def test_modes_are_those_of_all_combinations(n: int, problems: int) -> None:
    """Random problems with and without friction, with friction of joints, slips and modes that are ruled out; of some the rows
    depend on each other, or nothing moves."""
    stream, counts = np.random.default_rng(n), dict.fromkeys((-1, 0, 1), 0)
    for k in range(problems):
        sites: list[Site] = []
        first = 0
        for _ in range(n):
            bounded = bool(stream.uniform() < 0.2)
            rows = tuple(range(first, first + (1 if bounded else int(stream.integers(1, 3)))))
            first += len(rows)
            kinetic = float(stream.uniform(0, 2))
            static = kinetic * float(stream.choice([1.0, 1.5]))
            slip = np.array([float(stream.choice([-1.0, 1.0]))])[:len(rows) - 1 + bounded] if stream.uniform() < 0.4 else None
            ruled = ((), (laws.STICKING,), (laws.STICKING, laws.SLIDING))[stream.choice(3, p=[0.7, 0.2, 0.1])]
            sites.append(Site(rows, static, kinetic, slip, excluded=ruled[:1] if bounded else ruled, bounded=bounded))
        dependent = k % 4 == 0 and first > 1
        root = stream.normal(size=(first, first - 1 if dependent else first + 1))
        D, b = root @ root.T, stream.normal(size=first) * (k % 15 > 0)
        found, modes, lam, w = in_c(D, b, sites)
        expected = laws.solutions(D, b, sites)
        counts[found] += 1
        if found == 1:
            assert len(expected) == 1 and modes == [mode.kind for mode in expected[0].modes]
            assert np.abs(lam - expected[0].lam).max() < 1e-9 * (1 + np.abs(lam).max())
            assert np.abs(w - expected[0].w).max() < 1e-9 * (1 + np.abs(b).max())
        elif found == 0:
            assert not expected
        else:
            assert dependent or len(expected) > 1
    assert counts[1] > problems // 2 and counts[-1] > 0


def test_rows_that_depend_on_each_other_are_left_to_python() -> None:
    assert in_c(np.ones((2, 2)), np.array([-1.0, -1.0]), [Site((0,), 0, 0), Site((1,), 0, 0)])[0] == -1


def box() -> Any:
    contact = sd.Contact("corner", "body", "ground", shape=sd.contacts.Box([0.4, 0.2]), friction=(0.4, 0.3), restitution=0.6)
    return planar("tumbling_box", [contact], 2.0, 2.0 * (0.4**2 + 0.2**2) / 12).compile()


def closing_walls() -> Any:
    """A ball between two walls, of which one comes nearer at 0.5 m/s."""
    x, y = sd.coordinates("x y")
    system = sd.System("walls", gravity=[0, -G])
    wall, carrier, body = (system.add_body(name, mass=1.0) for name in ("wall", "carrier", "ball"))
    system.add_joint(sd.Prismatic("drive", system.ground, wall, axis=[1, 0], coordinate=2 - sd.t / 2))
    system.add_joint(sd.Prismatic("along", system.ground, carrier, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("across", carrier, body, axis=[0, 1], coordinate=y))
    for name, other, normal in (("fixed", system.ground, [1, 0]), ("coming", wall, [-1, 0])):
        system.add_contact(sd.Contact(name, body, other, shape=(sd.contacts.Point(), sd.contacts.Plane(normal)), restitution=1))
    return system.compile()


def hopper() -> Any:
    """A mass on a leg with a spring, whose foot sticks, and whose joint has stops."""
    length, angle, x, y = sd.coordinates("length angle x y")
    system = sd.System("hopper", gravity=[0, -G])
    carrier, hip, leg, foot = (system.add_body(name, mass=m, inertia=0.1 * m) for name, m in (
        ("carrier", 0.0), ("hip", 5.0), ("leg", 0.5), ("foot", 0.2)))
    system.add_joint(sd.Prismatic("along", system.ground, carrier, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("up", carrier, hip, axis=[0, 1], coordinate=y))
    system.add_joint(sd.Revolute("swing", hip, leg, coordinate=angle))
    system.add_joint(sd.Prismatic("stroke", leg, foot, axis=[0, -1], coordinate=length))
    system.add_joint_force("swing", -2 * angle - angle.dot / 10)
    system.add_joint_force("stroke", -400 * (length - 1) - 5 * length.dot)
    system.add_contact(sd.Contact("toe", foot, system.ground, shape=sd.contacts.Point(), friction=0.9))
    system.add_contact(sd.Stop("stop", "swing", -0.2, 0.2, restitution=0.5))
    return system.compile()


def belt() -> Any:
    """A block on a spring, on a belt that it sticks to and slips on, in a shaft whose joint has friction."""
    x, y = sd.coordinates("x y")
    system = sd.System("belt_and_shaft", gravity=[0, -G])
    band, slide, block = (system.add_body(name, mass=m) for name, m in (("band", 1.0), ("slide", 0.1), ("block", 1.0)))
    system.add_joint(sd.Prismatic("drive", system.ground, band, axis=[1, 0], coordinate=sd.t / 5))
    system.add_joint(sd.Prismatic("along", system.ground, slide, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("across", slide, block, axis=[0, 1], coordinate=y))
    system.add_spring_damper(system.ground, block, point_a=[-1, 0], stiffness=100, length=1)
    system.add_contact(sd.Contact("sole", block, band, friction=(0.5, 0.3)))
    system.add_contact(sd.JointFriction("shaft", "along", breakaway=0.02, sliding=0.01))
    return system.compile()


def oscillator() -> Any:
    x = sd.coordinates("x")
    system = sd.System("oscillator_with_stop")
    body = system.add_body("body", mass=2.0)
    system.add_joint(sd.Prismatic("rail", system.ground, body, coordinate=x))
    system.add_joint_force("rail", -50 * x)
    system.add_contact(sd.JointFriction("friction", "rail", breakaway=3.0, sliding=1.5))
    system.add_contact(sd.Stop("stop", "rail", -0.3, 0.6, restitution=0.7))
    return system.compile()


def four_bar() -> Any:
    """A four-bar linkage, whose states are projected onto its loop, on a stop that gives back 0.8 of the speed."""
    system = sd.systems.four_bar()
    system.add_contact(sd.Stop("stop", "hinge1", 0.5, 3.0, restitution=0.8))
    return system.compile()


OTHERS = ("ball", "radau"), ("walls", "bs54")
SHORT = "ball", "walls", "belt", "oscillator", "four_bar", "hopper"
CASES: dict[str, tuple[Any, tuple[float, float], dict[str, Any], int]] = {
    "ball": (lambda: ball(restitution=0.8).compile(), (0, 3), {"q": [0.5]}, 60),
    "walker": (walker, (0, 30), dict(zip("qu", after_heel_strike(0.20031090, -0.19983247), strict=True)), 9),
    "box": (box, (0, 1.2), {"q": [0, 0.6, 0.3], "u": [1.0, 0, 3.0]}, 4),
    "walls": (closing_walls, (0, 3.5), {"q": [1.0, 0.0], "u": [0.7, 0.0]}, 5),
    "belt": (belt, (0, 12), {"u": [0.2, 0.0]}, 15),
    "oscillator": (oscillator, (0, 6), {"q": [0.5]}, 7),
    "four_bar": (four_bar, (0, 5), {}, 50),
    "hopper": (hopper, (0, 2), {"q": {"y": 1.2, "length": 1.0, "angle": 0.1}}, 4),
}


def counted(step: Any, what: str, tried: list[str]) -> Any:
    """A method that notes its calls."""
    def noted(*given: Any) -> Any:
        tried.append(what)
        return step(*given)
    return noted


@pytest.mark.parametrize(("name", "method"), swept(
    [*((name, "dop853") for name in CASES), ("box", "radau"), *OTHERS], *((name, "dop853") for name in SHORT), *OTHERS))
@pytest.mark.filterwarnings("ignore:hopper.* on the border of two modes:symdyn.errors.SimulationWarning")
def test_motions_are_those_with_every_switch_in_python(name: str, method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    make, span, start, n = CASES[name]
    module, tried = make(), []
    for owner, what in ((hybrid.Motion, "go"), (contacts._Phases, "_switch")):
        monkeypatch.setattr(owner, what, counted(getattr(owner, what), what, tried))
    module.simulate(span, **start, method=method, rtol=1e-11)  # which compiles the modes that it comes to
    tried.clear()
    quick = module.simulate(span, **start, method=method, rtol=1e-11, work=True)
    quickly = tried.copy()
    tried.clear()
    monkeypatch.setattr(hybrid, "of", lambda *given: None)
    slow = module.simulate(span, **start, method=method, rtol=1e-11, work=True)
    assert "go" not in tried and tried.count("_switch") > n
    assert "go" in quickly and quickly.count("_switch") < tried.count("_switch") / 2, quickly
    assert quick.success and slow.success and np.array_equal(quick.t, slow.t)
    assert quick.n_steps == pytest.approx(slow.n_steps, rel=0.05)
    size = np.abs(slow.x).max()
    off = np.abs(quick.x - slow.x).max(axis=1)
    assert np.quantile(off, 0.98) < 1e-7 * size  # at output times next to impacts one run may be before, one behind them
    for contact, one in quick.contacts.items():
        two = slow.contacts[contact]
        assert [mode for _, mode in one.switches] == [mode for _, mode in two.switches]
        assert np.abs(np.array([t for t, _ in one.switches]) - [t for t, _ in two.switches]).max(initial=0.0) < 1e-7
        assert len(one.impacts.t) == len(two.impacts.t)
        assert np.abs(one.impacts.t - two.impacts.t).max(initial=0.0) < 1e-7
        assert np.abs(one.impacts.impulse - two.impacts.impulse).max(initial=0.0) < 1e-6 * size
        assert np.array_equal(one.mode[off < 1e-7 * size], two.mode[off < 1e-7 * size])
    for event, one in quick.events.items():
        assert len(one.t) == len(slow.events[event].t)
    assert len(quick.doubts) == len(slow.doubts)
    assert np.abs(quick.energy_balance["error"]).max() < 1e-6

SWITCH = """
SYMDYN_EXPORT int symdyn_hybrid_one(symdyn_hybrid *h);
SYMDYN_EXPORT int symdyn_hybrid_one(symdyn_hybrid *h) { return symdyn_take_parameters(h) || symdyn_switch(h); }
"""
SWITCHES = 150, *swept([1250])


class Switches:
    """Switches of a motion, and the like of other states, before any is made."""

    def __init__(self, module: Any, span: tuple[float, float], start: dict[str, Any], seed: int) -> None:
        self.seen: list[Any] = []
        self.stream, switch = np.random.default_rng(seed), contacts._Phases._switch

        def noted(one: Any, t: float, x: np.ndarray, fired: Any, begins: bool) -> np.ndarray:
            kept = copy.copy(one)
            kept.t, kept.x, kept.fired, kept.begun, kept.left = t, x.copy(), list(fired), begins, dict(one.left)
            kept.modes, kept.still, kept.passed = one.modes.copy(), one.still.copy(), one.passed.copy()
            kept.directions = one.directions.copy()
            if one._is_plain() and not one.left:
                self.seen.append(kept)
            return switch(one, t, x, fired, begins)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(contacts._Phases, "_switch", noted)
            patch.setattr(hybrid, "of", lambda *given: None)
            module.simulate(span, **start)
        motion = hybrid.of(module, self.seen[0].request, "dop853")
        assert motion is not None
        self.motion, self.library = motion, cache.load(text("hybrid") + SWITCH, "symdyn_hybrid", require_compiler())

    def draw(self) -> Any:
        """One of them, of another state with the same contacts closed, sticking and meeting; of one in four nothing is left of
        the approach but rounding. Forces may be within the bounds that they are to have left."""
        seen, stream = self.seen[self.stream.integers(len(self.seen))], self.stream
        one, middle = copy.copy(seen), seen.module.metadata.sizes.q + seen.module.metadata.sizes.u
        one.impacts, one.happened, one.doubts, one.ruled_out, one.left = [], [], {}, {}, {}
        one.modes, one.still, one.passed = seen.modes.copy(), seen.still.copy(), seen.passed.copy()
        one.evaluators, one.latest_numbers, one.begins = {}, None, SlipBegins(one.request.span[1] - one.request.span[0])
        x = seen.x.copy()
        x[:middle] += 10.0 ** stream.uniform(-6, -0.5) * stream.normal(size=middle)
        closing = {k for k, what in one.fired if what == "closes"}
        closed = {k for k, mode in enumerate(one.modes) if mode != contacts.OPEN}
        gaps = {k: one.normal[k] for k in one.placed if k in closed | closing}
        stopped = closed | closing if stream.uniform() < 0.25 else closed
        held = [one.normal[k] for k in sorted(stopped) if one.records[k].normal]
        held += [row for k, still in enumerate(one.still) if still and k in closed for row in one.tangents[k]]
        for _ in range(3):
            x = contacts.onto_rows(lambda x: one._numbers(one.t, x), x, gaps, held)
        slip, directions = one._numbers(one.t, x).slip, []
        for k, (mode, rows) in enumerate(zip(one.modes, one.tangents, strict=True)):
            directions.append(np.sign(slip[rows]) if mode == contacts.SLIDING and not one.still[k] else one.directions[k])
        one.x, one.directions = x, directions
        return one


@pytest.mark.parametrize("count", SWITCHES)
@pytest.mark.parametrize("name", CASES)
def test_switches_are_those_of_python(name: str, count: int) -> None:
    """States near the switches of a motion: what C makes, with impacts, modes and slips that begin, is what Python makes."""
    make, span, start, _ = CASES[name]
    switches, done = Switches(make(), span, start, 5), 0
    motion = switches.motion
    for _ in range(4 * count):
        if done == count:
            break
        one = switches.draw()
        motion.start(one.request, contacts.LAWS, one.same)
        motion.record.n_phases = motion.record.n_impacts = 0
        one._hand_over(motion)
        if switches.library.symdyn_hybrid_one(ctypes.byref(motion.record)):
            continue
        done += 1
        x = one._switch(one.t, one.x, one.fired, one.begun)
        assert not one.doubts and not one.shared
        assert [mode_codes.MODES[k] for k in motion.mode.tolist()] == one.modes
        assert np.abs(motion.x - x).max() <= 1e-9 * (1 + np.abs(x).max())
        assert motion.passed.tolist() == one.passed
        closed = [k for k, mode in enumerate(one.modes) if mode != contacts.OPEN]
        assert [bool(motion.still[k]) for k in closed] == [one.still[k] for k in closed]
        rubbing = [k for k in closed if one.tangents[k]]
        assert motion.sign[rubbing].tolist() == [one.directions[k][0] for k in rubbing]
        assert np.flatnonzero(motion.slipping).tolist() == sorted(one.begins.directions)
        assert np.flatnonzero(motion.left > -np.inf).tolist() == sorted(one.left)
        assert motion.record.n_impacts == len(one.impacts)
        assert motion.happened[:motion.record.n_happened].tolist() == [each.event for each in one.happened]
        for impact, theirs in zip(one.impacts, motion.impact, strict=False):
            ours = np.array([impact.impulses, impact.before, impact.after])
            assert np.abs(ours - theirs).max() <= 1e-9 * (1 + np.abs(ours).max())
    assert done == count


def test_a_motion_in_pieces_is_the_same_and_keeps_what_was_done_when_it_is_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Records of C that hold eight phases are emptied in between; the third call of it is interrupted."""
    whole = ball(restitution=0.8).compile().simulate((0, 3), q=[0.5])
    monkeypatch.setattr(hybrid, "MOST_PHASES", 8)
    module = ball(restitution=0.8).compile()
    parts = module.simulate((0, 3), q=[0.5])
    assert np.array_equal(parts.x, whole.x) and np.array_equal(parts.t, whole.t)
    for one, two in ((parts.contacts["floor"].impacts, whole.contacts["floor"].impacts),):
        assert np.array_equal(one.t, two.t) and np.array_equal(one.impulse, two.impulse)
    assert np.array_equal(parts.events["floor_closes"].t, whole.events["floor_closes"].t)
    assert [one.after[1] for one in parts._happened] == [one.after[1] for one in whole._happened]
    assert parts._happened[0].before[1] == pytest.approx(-np.sqrt(G)) and parts._happened[0].after[1] > 0
    calls, go = [], hybrid.Motion.go

    def interrupted(self: hybrid.Motion, times: np.ndarray) -> hybrid.Done:
        calls.append(go(self, times))
        if len(calls) == 3:
            raise KeyboardInterrupt
        return calls[-1]

    monkeypatch.setattr(hybrid.Motion, "go", interrupted)
    with pytest.raises(SimulationInterrupted) as stopped:
        module.simulate((0, 3), q=[0.5])
    kept = stopped.value.solution
    assert len(kept.events["floor_closes"].t) == 16 and len(kept.contacts["floor"].impacts.t) == 15
    assert np.array_equal(kept.events["floor_closes"].t, whole.events["floor_closes"].t[:16])
    assert len(kept.t) > 100 and np.array_equal(kept.x[:-1], whole.x[:len(kept.t) - 1])
