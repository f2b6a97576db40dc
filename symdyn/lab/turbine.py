"""`symdyn bench turbine`: figures of the floating wind turbine, each compared with what it should be."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

import symdyn as sd
from symdyn.formulation.equations import Equations
from symdyn.lab.figures import Figure, print_figures
from symdyn.model.system import System
from symdyn.pipeline import emit
from symdyn.systems.turbine_parts import blade_beam, tower_beam
from symdyn.tape.floats import evaluate_rows
from symdyn.timing.loops import evaluation_time

# Bodies and joints alone.
BARE: dict[str, Any] = {"hydrostatics": None, "mooring": None, "added_mass": False, "damping": False, "wind": False,
                        "drives": False}
# While a wave grows: yaw command (rad), torques on the rotor (N m), wind (m/s).
INPUTS = {"yaw_c": 0.3, "tau_a": 2e6, "tau_g": 1.5e6, "v_w": 9.0}
STATES = 1000
ANGLE = np.pi / 3


class States(NamedTuple):
    """q (n, n_q) and u (n, n_u) in the order of some equations; time, s, and inputs by name, which are zero unless given."""

    q: np.ndarray
    u: np.ndarray
    t: float = 0.0
    inputs: Mapping[str, float] = MappingProxyType({})


def turbine(**options: Any) -> System:
    """The catalogue's, with options."""
    return sd.systems.floating_wind_turbine(**options)


def random_states(n: int, seed: int = 0) -> States:
    """Random states of the form in Euler angles: positions within 3 m, angles up to 60 degrees, any azimuth, speeds up to 1 m/s
    and 1 rad/s."""
    rng = np.random.default_rng(seed)
    q = np.column_stack([rng.uniform(-3, 3, (n, 3)), rng.uniform(-ANGLE, ANGLE, (n, 4)), rng.uniform(-np.pi, np.pi, n)])
    return States(q, rng.uniform(-1, 1, (n, 8)))


def values(equations: Equations, states: States, *names: str) -> dict[str, np.ndarray]:
    """Quantities of equations at states, parameters at their numbers."""
    s = equations.symbols
    given: dict[str, Any] = {p.name: float(v) for p, v in s.defaults.items()}
    given |= {"t": states.t} | {a.name: states.inputs.get(a.name, 0.0) for a in s.inputs}
    given |= dict(zip([a.name for a in (*s.coordinates, *s.speeds)], [*states.q.T, *states.u.T], strict=True))
    return evaluate_rows(equations.tape(*names), given, len(states.q))


def body_accelerations(equations: Equations, states: States) -> np.ndarray:
    """[a_G; alpha] of every body, n-frame, (n, n_b, 6); where statements for them fail, by the numeric algorithm."""
    result = values(equations, states, "J", "Jd_qd")
    ud = values(equations.singular_fallback or equations, states, "accelerations")["accelerations"]
    return (np.einsum("nij,nj->ni", result["J"], ud) + result["Jd_qd"]).reshape(len(ud), -1, 6)


class Poses:
    """Where the bodies are and how they move at states of the form in Euler angles, for other sets of coordinates."""

    def __init__(self, equations: Equations, system: System, states: States) -> None:
        from scipy.spatial.transform import Rotation

        model = system.check()
        n = len(states.q)
        result = values(equations, states, "frames", "J")
        frames = result["frames"]
        R, self.p = frames[:, :, 3:].reshape(n, -1, 3, 3), frames[:, :, :3]
        com = np.array([[float(e.xreplace(dict(model.defaults))) for e in body.com] for body in model.bodies])
        twists = np.einsum("nij,nj->ni", result["J"], states.u).reshape(n, -1, 6)
        omega = twists[:, :, 3:]
        self.v = twists[:, :, :3] - np.cross(omega, np.einsum("nkij,kj->nki", R, com))
        self.v_body, self.omega_body = (np.einsum("nkji,nkj->nki", R, w) for w in (self.v, omega))
        parameters = Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat().reshape(n, -1, 4)
        self.e = parameters[:, :, [3, 0, 1, 2]]
        self.states = states

    def quasi_velocities(self) -> States:
        """States of the form in Euler parameters."""
        q, u, *_ = self.states
        return self.states._replace(q=np.column_stack([q[:, :3], self.e[:, 0], q[:, 6:]]),
                                    u=np.column_stack([self.v_body[:, 0], self.omega_body[:, 0], u[:, 6:]]))

    def absolute(self, equations: Equations) -> States:
        """States of the augmented form: the platform's own coordinates, those of the six other bodies, those of driven joints."""
        (q, u, *_), bodies = self.states, range(1, self.p.shape[1])
        own = ["yaw", "azimuth"]
        driven = [own.index(c.name) for c in equations.symbols.coordinates if c.name in own]
        return self.states._replace(
            q=np.column_stack([q[:, :6], *[np.column_stack([self.p[:, k], self.e[:, k]]) for k in bodies],
                               *[q[:, 6 + k] for k in driven]]),
            u=np.column_stack([u[:, :6], *[np.column_stack([self.v[:, k], self.omega_body[:, k]]) for k in bodies],
                               *[u[:, 6 + k] for k in driven]]))


def difference(result: np.ndarray, wanted: np.ndarray) -> float:
    """Largest difference over the states, relative to the largest acceleration at each, linear and angular by themselves."""
    worst = 0.0
    for part in (slice(0, 3), slice(3, 6)):
        a, b = result[:, :, part], wanted[:, :, part]
        worst = max(worst, float((np.abs(a - b).max(axis=(1, 2)) / np.abs(b).max(axis=(1, 2))).max()))
    return worst


def formulations(n: int, seed: int = 0, **options: Any) -> dict[str, float]:
    """Differences of the accelerations of all bodies from the embedded ones at n random states; see `difference`.

    Also "constraints", the largest residual of those of absolute coordinates, m.
    """
    system, quasi = turbine(**options), turbine(orientation="parameters", **options)
    embedded = system.embedding()
    states = random_states(n, seed)._replace(t=7.3, inputs=INPUTS)
    wanted = body_accelerations(embedded, states)
    poses = Poses(embedded, system, states)
    absolute = system.augmented("absolute")
    placed = poses.absolute(absolute)
    return {
        "constraints": float(np.abs(values(absolute, placed, "C")["C"]).max()),
        "augmented, absolute coordinates": difference(body_accelerations(absolute, placed)[:, :wanted.shape[1]], wanted),
        "recursive, Euler angles": difference(body_accelerations(system.recursive(), states), wanted),
        "recursive, quasi-velocities": difference(body_accelerations(quasi.recursive(), poses.quasi_velocities()), wanted),
        "embedded, quasi-velocities": difference(body_accelerations(quasi.embedding(), poses.quasi_velocities()), wanted),
    }


def tumbling(module: Any, rtol: float = 1e-11) -> tuple[float, float]:
    """A turbine without water and weight that turns over through a pitch of 90 degrees, at t = 0: its energy error, and how far
    its pitch is from 90 degrees there, deg; module: of the bare form in quasi-velocities."""
    half = float(np.sqrt(0.5))
    upright = module.simulate(t=(0, -8), q={"e0": half, "e2": half}, params={"g": 0.0}, rtol=rtol,
                              u={"omega_x": 0.02, "omega_y": 0.3, "omega_z": 0.05, "yaw_dot": 0.03, "azimuth_dot": 1.2})
    n_q = len(module.metadata.q)
    start = upright.x[-1]
    solution = module.simulate(t=np.linspace(-8, 8, 801), q=start[:n_q], u=start[n_q:], params={"g": 0.0}, rtol=rtol)
    pitch = solution["platform_pitch_deg"]
    if pitch[0] > 10 or pitch[-1] > 10:
        raise AssertionError(f"the turbine does not turn over: its pitch goes from {pitch[0]} to {pitch[-1]} degrees")
    return solution.energy_error(), abs(90.0 - float(pitch[400]))


def series(module: Any, rtol: float = 1e-11) -> dict[str, Any]:
    """Time series of the moored turbine, with the work of its loads; module: of `turbine()`."""
    rest = {name: module.metadata.initial.get(name, 0.0) for name in module.metadata.q}
    rated = 12.1 * np.pi / 30
    cases: dict[str, dict[str, Any]] = {
        "start-up of the rotor": {"inputs": {"tau_a": 2e6, "v_w": 8.0}},
        "free decay in pitch": {"q": {"theta": rest["theta"] + 0.08}},
        "free decay in heave": {"q": {"z": rest["z"] + 0.8}},
        "yaw of the nacelle under a spinning rotor": {"u": {"azimuth_dot": rated}, "inputs": {"yaw_c": lambda t, x: 0.005 * t}},
        "thrust step": {"inputs": {"v_w": (np.array([0.0, 20.0, 20.001, 200.0]), np.array([0.0, 0.0, 10.0, 10.0]))}},
    }
    return {name: module.simulate(t=(0, 120), work=True, rtol=rtol, **case) for name, case in cases.items()}


def leading(mode: Any) -> str:
    """The coordinate with most kinetic energy in a mode."""
    return str(mode.coordinates[int(np.argmax(mode.shares))])


def decay_period(module: Any, rest: np.ndarray, mode: Any, size: float = 0.01) -> float:
    """Period of a small free decay, s, from where the mode's leading coordinate passes rest; size: its amplitude, m or rad."""
    names = module.metadata.q
    column = names.index(leading(mode))
    shape = mode.shape / mode.shape[column] * size
    start, speed = rest[:len(names)] + shape.real, (mode.eigenvalue * shape).real
    solution = module.simulate(t=np.linspace(0, 5 * mode.period, 5001), q=start, u=speed, rtol=1e-11)
    y = solution.q[:, column] - rest[column]
    up = np.flatnonzero((y[:-1] < 0) & (y[1:] >= 0))
    times = solution.t[up] - y[up] * (solution.t[up + 1] - solution.t[up]) / (y[up + 1] - y[up])
    return float(np.diff(times).mean())


# -- the figures


def derivation() -> Iterator[Figure]:
    """Derivation of the embedded model in 8 coordinates, every parameter a symbol."""
    best = np.inf
    for _ in range(3):
        begun = clock.perf_counter()
        equations = turbine(**BARE).embedding()
        emit(equations, "c", ("rhs",), standalone=False)
        best = min(best, clock.perf_counter() - begun)
    yield "describe, derive and emit, embedded, 8 coordinates", best, "s", "< 1.5"
    yield "one compiled evaluation, embedded", evaluation_time(equations, repeats=150) * 1e6, "us", "< 0.2"
    for name, options in (("recursive", {}), ("recursive, quasi-velocities", {"orientation": "parameters"})):
        yield f"one compiled evaluation, {name}", evaluation_time(turbine(**BARE | options).recursive()) * 1e6, "us", ""
    lumped = turbine(**BARE | {"blades": "lumped"}).embedding()
    yield "one compiled evaluation, embedded, blades lumped", evaluation_time(lumped) * 1e6, "us", ""


def agreement() -> Iterator[Figure]:
    """Three formulations, and the passage through a pitch of 90 degrees."""
    for what, options in (("bare", BARE), ("with loads", {"waves": True})):
        for name, value in formulations(STATES, **options).items():
            yield f"{what}: {name}, {STATES} states", value, "", "< 1e-10" if name != "constraints" else ""
    error, left = tumbling(turbine(**BARE | {"orientation": "parameters"}).embedding().compile())
    yield "tumbling in quasi-velocities: energy error", error, "", "< 1e-8"
    yield "tumbling in quasi-velocities: pitch short of 90 degrees", left, "deg", "< 1e-6"


def motion() -> Iterator[Figure]:
    """Ten minutes, and the energy balance of time series."""
    for name, options in (("hydrostatics and mooring", {"drives": False, "wind": False}), ("all loads", {})):
        module = turbine(**options).embedding().compile()
        start = {"theta": 0.05, "z": 0.2, "x": 0.5}
        runs = [module.simulate(t=(0, 600), q=start, rtol=1e-8) for _ in range(5)]
        yield f"10 minutes, {name}, rtol 1e-8", min(run.integrator_seconds or run.seconds for run in runs), "s", "< 0.3"
    for name, solution in series(module).items():
        yield f"energy balance: {name}", solution.energy_error(), "", "< 1e-8"


def statics() -> Iterator[Figure]:
    """Equilibria from random starts, and natural periods compared with those of free decay."""
    module = turbine(rotor="fixed").embedding().compile()
    reach = np.radians(20)
    result = module.equilibria(100, dict.fromkeys("xyz", 3.0) | dict.fromkeys(("psi", "theta", "phi"), float(reach)))
    yield "equilibria that 100 starts lead to", len(result), "", ""
    yield "starts that lead nowhere", len(result.failures), "", "<= 0"
    yield "most iterations of a start", int(result.iterations.max()), "", "<= 25"
    rest = module.equilibrium()
    yield "draft in equilibrium", 4.0 - rest["z"], "m", ""
    for mode in module.linearize(rest).modes():
        if leading(mode) == "yaw":  # the nacelle's, no mode of the platform
            continue
        yield f"period of {mode.name}", mode.period, "s", ""
        off = abs(decay_period(module, rest.x, mode) / mode.period - 1)
        yield f"period of {mode.name}: free decay differs by", off, "", "< 0.005"


def flexible() -> Iterator[Figure]:
    """Tower and blades that bend: equilibrium, energy, the limit of great stiffness, and the tower on land."""
    module = turbine(rotor="fixed", flexible=True).embedding().compile()
    rest = module.equilibrium()
    yield "flexible: iterations to equilibrium", rest.iterations, "", "<= 25"
    yield "flexible: the tower's top bends by", rest["tower_fa1"] + rest["tower_fa2"], "m", ""
    start = {**dict(zip(module.metadata.q, rest.q, strict=True)), "theta": 0.08}
    decay = module.simulate(t=(0, 120), q=start, work=True, rtol=1e-11)
    yield "flexible: energy balance of free decay in pitch", decay.energy_error(), "", "< 1e-8"
    yield "flexible: 2 minutes of it", decay.integrator_seconds or decay.seconds, "s", ""
    rigid = turbine(rotor="fixed").embedding().compile()
    same = beam_numbers()
    wanted = platform_frequencies(rigid, same)
    for factor, bound in ((1e2, ""), (1e4, ""), (1e6, "< 1e-5")):
        result = platform_frequencies(module, {"s_T": factor, "s_B": factor})
        off = float(np.abs(result / wanted - 1).max())
        yield f"flexible, {factor:g} times as stiff: platform frequencies off rigid ones", off, "", bound
    tower = sd.systems.land_wind_turbine(rotor="fixed", flexible="tower").embedding().compile()
    for mode in tower.linearize(tower.equilibrium()).modes():
        if leading(mode) in ("tower_fa1", "tower_ss1"):
            yield f"on land, rigid blades: {leading(mode)}", mode.frequency, "Hz", ""


def beam_numbers() -> dict[str, float]:
    """Parameters of the rigid turbine with mass and inertia of the flexible one's beams."""
    result: dict[str, float] = {}
    for letter, beam in (("T", tower_beam().modal), ("B", blade_beam().modal)):
        z = beam.h0[2] / beam.m
        result |= {f"m_{letter}": beam.m, f"z_{letter}": z, f"I_{letter}": beam.I0[0, 0] - beam.m * z**2}
    return result


def platform_frequencies(module: Any, params: dict[str, float]) -> np.ndarray:
    """Frequencies of the six slowest modes at rest, Hz, (6,)."""
    return np.asarray(module.linearize(module.equilibrium(params=params)).modes().frequencies[:6])


GROUPS = (derivation, agreement, motion, statics, flexible)


def run(only: Sequence[str] | None = None) -> int:
    """Print the figures, or those of some groups; returns the number of those that miss their bound."""
    return print_figures(GROUPS, only, 72)
