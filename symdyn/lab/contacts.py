"""Contact by work against error: motions that are known in closed form, with located switches and by time stepping, and of other
programs.

    ball         falls from 0.5 m and bounces with e = 0.8 until it is at rest
    oscillator   a mass on a spring with dry friction, which sticks after eight half periods
    billiard     a ball that slides with sidespin and then rolls, in space

Every program runs from loose to tight settings: tolerances of the method that locates switches, steps of all others. The error is
the largest one of the position over 31 times, by the size of the motion; work is processor time of the run, without the making
of the model. MuJoCo and Exudyn have no rigid contact: where bodies touch they yield. Their ball yields so that an impact takes 5,
20 or 80 steps, whichever gives the smallest error; friction of a joint is MuJoCo's frictionloss, in Exudyn friction over a zone
of speeds that shrinks with the steps. A ball that slides on a plane is not built for Exudyn here. Siconos, which locates impacts
as well, has no package that pip installs. The cost of contacts is measured in symdyn.lab.contact_costs.

    symdyn bench contacts
"""

from __future__ import annotations

import importlib.util
import json
import time as clock
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import symdyn as sd
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.lab.contact_costs import COSTS, Cost

G = 9.81
LOCATED, STEPPED, MUJOCO, EXUDYN = "symdyn, switches located", "symdyn, time stepping", "MuJoCo", "Exudyn"
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10, 1e-12)
STEPS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5)
# Steps that an impact of yielding bodies may take.
IMPACT_STEPS = (5, 20, 80)
# Errors below which the located method is to take the least time.
AHEAD = 1e-3
# Function of times and a setting: seconds, and positions (n_t, n).
Runner = Callable[[np.ndarray, float], tuple[float, np.ndarray]]
HEADING = f"{'motion':12}{'program':26}{'setting':>10}{'error':>12}{'ms':>10}"


@dataclass(frozen=True)
class Point:
    """One run: the motion and the program, its tolerance or step, the error, seconds."""

    motion: str
    program: str
    setting: float
    error: float
    seconds: float

    def __str__(self) -> str:
        return f"{self.motion:12}{self.program:26}{self.setting:10.0e}{self.error:12.2e}{1e3 * self.seconds:10.3f}"


@dataclass(frozen=True)
class Motion:
    """A motion that is known.

    times, truth   where it is, (n_t, n)
    size           of the motion, m; start: q, u of the system
    peers          by the program what runs it with steps of about a length and gives the seconds and the positions (n_t, n)
    """

    name: str
    system: Callable[[], sd.System]
    start: tuple[list[float], list[float]]
    times: np.ndarray
    truth: np.ndarray
    size: float
    peers: dict[str, Runner]


# -- the motions

HEIGHT, RESTITUTION = 0.5, 0.8
MASS, STIFFNESS, FRICTION, AMPLITUDE = 2.0, 50.0, 1.5, 0.5
RADIUS, BALL, ROUGH = 0.03, 0.17, 0.2
SPEED, SPIN = np.array([2.0, 0.0]), np.array([-30.0, -20.0])


def _ball() -> sd.System:
    system = sd.System("bouncing_ball", gravity=[0, -G])
    body = system.add_body("ball", mass=1.0)
    system.add_joint(sd.Prismatic("height", system.ground, body, axis=[0, 1], coordinate=sd.coordinates("y")))
    system.add_contact(sd.Contact("floor", body, system.ground, restitution=RESTITUTION))
    return system


def ball_heights(times: np.ndarray) -> np.ndarray:
    """Heights of the ball, (n_t,)."""
    begin, speed, result = np.sqrt(2 * HEIGHT / G), np.sqrt(2 * HEIGHT * G), np.zeros(len(times))
    first = times < begin
    result[first] = HEIGHT - G * times[first] ** 2 / 2
    while speed > 1e-15:
        speed *= RESTITUTION
        since = times - begin
        flies = (since >= 0) & (since < 2 * speed / G)
        result[flies] = speed * since[flies] - G * since[flies] ** 2 / 2
        begin += 2 * speed / G
    return result


def _oscillator() -> sd.System:
    x = sd.coordinates("x")
    system = sd.System("dry_oscillator")
    body = system.add_body("body", mass=MASS)
    system.add_joint(sd.Prismatic("rail", system.ground, body, coordinate=x))
    system.add_joint_force("rail", -STIFFNESS * x)
    system.add_contact(sd.JointFriction("friction", "rail", breakaway=FRICTION, sliding=FRICTION))
    return system


def oscillator_places(times: np.ndarray) -> np.ndarray:
    """Places of the mass on the spring, (n_t,): half periods about the middles by which friction displaces it."""
    half, off = np.pi / np.sqrt(STIFFNESS / MASS), FRICTION / STIFFNESS
    n, place, result = 0, AMPLITUDE, np.zeros(len(times))
    while abs(place) > off:
        middle, now = np.sign(place) * off, (times >= n * half) & (times < (n + 1) * half)
        result[now] = middle + (place - middle) * np.cos(np.pi / half * (times[now] - n * half))
        place, n = 2 * middle - place, n + 1
    result[times >= n * half] = place
    return result


def _billiard() -> sd.System:
    system = sd.System("billiard_ball", gravity=[0, 0, -G])
    body = system.add_body("ball", mass=BALL, inertia=[2 / 5 * BALL * RADIUS**2] * 3)
    system.add_joint(sd.Free("free", system.ground, body, orientation=sd.EulerParameters()))
    system.add_contact(sd.Contact("cloth", body, system.ground, shape=sd.contacts.Sphere(RADIUS), friction=ROUGH))
    return system


def billiard_places(times: np.ndarray) -> np.ndarray:
    """Places of the ball on the cloth, (n_t, 2): a parabola along the slip, which keeps its direction, then a straight line."""
    slip = SPEED - RADIUS * np.array([SPIN[1], -SPIN[0]])
    size = np.linalg.norm(slip)
    until, against = 2 * size / (7 * ROUGH * G), -ROUGH * G * slip / size
    slides, rolls = np.minimum(times, until)[:, None], np.maximum(times - until, 0.0)[:, None]
    return SPEED * slides + against * slides**2 / 2 + (SPEED + against * until) * rolls


def motions() -> dict[str, Motion]:
    """The motions by name."""
    ball, oscillator, billiard = np.linspace(0, 3, 31), np.linspace(0, 6, 31), np.linspace(0, 1.5, 31)
    result = [
        Motion("ball", _ball, ([HEIGHT], [0.0]), ball, ball_heights(ball)[:, None], HEIGHT,
               {MUJOCO: partial(_most_exact, partial(_mujoco, _MJ_BALL)), EXUDYN: partial(_most_exact, partial(_exudyn, True))}),
        Motion("oscillator", _oscillator, ([AMPLITUDE], [0.0]), oscillator, oscillator_places(oscillator)[:, None], AMPLITUDE,
               {MUJOCO: partial(_mujoco, _MJ_OSCILLATOR), EXUDYN: partial(_exudyn, False)}),
        Motion("billiard", _billiard, ([0, 0, RADIUS, 1, 0, 0, 0], [*SPEED, 0.0, *SPIN, 0.0]), billiard,
               billiard_places(billiard), 1.0, {MUJOCO: partial(_mujoco, _MJ_BILLIARD)})]
    return {motion.name: motion for motion in result}


# -- MuJoCo

_MJ_BALL = ('<body><joint type="slide" axis="0 0 1"/><geom type="sphere" size="0.1" mass="1" pos="0 0 0.1"/></body>'
            '<geom type="plane" size="9 9 9"/>')
_MJ_OSCILLATOR = (f'<body><joint type="slide" axis="1 0 0" stiffness="{STIFFNESS}" frictionloss="{FRICTION}"/>'
                  f'<geom type="sphere" size="0.1" mass="{MASS}"/></body>')
_MJ_BILLIARD = (f'<body pos="0 0 {RADIUS}"><freejoint/><geom type="sphere" size="{RADIUS}" mass="{BALL}" '
                f'friction="{ROUGH} 0 0"/></body><geom type="plane" size="9 9 9" friction="{ROUGH} 0 0"/>')


def _mujoco(world: str, times: np.ndarray, step: float, impact_steps: int = 0) -> tuple[float, np.ndarray]:
    import mujoco

    every = max(1, round(float(times[1] - times[0]) / step))
    h = float(times[1] - times[0]) / every
    gravity = 0.0 if world == _MJ_OSCILLATOR else -G
    reference = f"{2 * h!r} 1"
    if world == _MJ_BALL:
        stiffness, damping = _yielding(impact_steps * h)
        reference = f"{-stiffness!r} {-damping!r}"
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{h!r}" gravity="0 0 {gravity}" cone="elliptic" integrator="implicitfast" impratio="10"/>'
        f'<default><geom solref="{reference}" solimp="0.9999 0.9999 0.001" condim="3"/>'
        f'<joint solreffriction="{2 * h!r} 1" solimpfriction="0.9999 0.9999 0.001"/></default>'
        f'<worldbody>{world}</worldbody></mujoco>')
    data = mujoco.MjData(model)
    if world == _MJ_BALL:
        data.qpos[0] = HEIGHT
    elif world == _MJ_OSCILLATOR:
        data.qpos[0] = AMPLITUDE
    else:
        data.qvel[:] = [*SPEED, 0.0, *SPIN, 0.0]
    n, rows = 2 if world == _MJ_BILLIARD else 1, [np.array(data.qpos[:2])]
    begun = clock.process_time()
    for _ in times[1:]:
        mujoco.mj_step(model, data, nstep=every)
        rows.append(np.array(data.qpos[:2]))
    return clock.process_time() - begun, np.array(rows)[:, :n]


def _most_exact(ball: Callable[..., tuple[float, np.ndarray]], times: np.ndarray, step: float) -> tuple[float, np.ndarray]:
    """The run of the bouncing ball with the least error, of those with impacts of so many steps."""
    truth = ball_heights(times)[:, None]
    return min((ball(times, step, n) for n in IMPACT_STEPS), key=lambda one: float(np.abs(one[1] - truth).max()))


def _yielding(lasts: float) -> tuple[float, float]:
    """Stiffness and damping by mass of a linear impact of a length, s, that gives back RESTITUTION of the speed."""
    decay = -np.log(RESTITUTION) / np.pi
    ratio = decay / np.sqrt(1 + decay**2)
    frequency = np.pi / (lasts * np.sqrt(1 - ratio**2))
    return float(frequency**2), float(2 * ratio * frequency)


# -- Exudyn

def _exudyn(bounces: bool, times: np.ndarray, step: float, impact_steps: int = 0) -> tuple[float, np.ndarray]:
    """The ball that bounces on the end of its path, or the mass on the spring with friction."""
    import exudyn as exu
    from exudyn import itemInterface as item

    every = max(1, round(float(times[1] - times[0]) / step))
    h = float(times[1] - times[0]) / every
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    mass, start = (1.0, HEIGHT) if bounces else (MASS, AMPLITUDE)
    node = mbs.AddNode(item.Node1D(referenceCoordinates=[0.0], initialCoordinates=[start]))
    mbs.AddObject(item.Mass1D(physicsMass=mass, nodeNumber=node))
    moving = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    ground = mbs.AddNode(item.NodePointGround())
    fixed = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
    if bounces:
        stiffness, damping = _yielding(impact_steps * h)
        data = mbs.AddNode(item.NodeGenericData(numberOfDataCoordinates=3, initialCoordinates=[0.0, 0.0, 0.0]))
        mbs.AddLoad(item.LoadCoordinate(markerNumber=moving, load=-G))
        mbs.AddObject(item.ObjectConnectorCoordinateSpringDamperExt(
            markerNumbers=[fixed, moving], nodeNumber=data, useLimitStops=True, limitStopsLower=0.0, limitStopsUpper=1e3,
            limitStopsStiffness=stiffness, limitStopsDamping=damping))
    else:
        mbs.AddObject(item.ObjectConnectorCoordinateSpringDamperExt(
            markerNumbers=[fixed, moving], stiffness=STIFFNESS, fDynamicFriction=FRICTION,
            frictionProportionalZone=2 * h * FRICTION / MASS))
    sensor = mbs.AddSensor(item.SensorNode(nodeNumber=node, storeInternal=True,
                                           outputVariableType=exu.OutputVariableType.Coordinates))
    mbs.Assemble()
    settings: Any = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps, settings.timeIntegration.endTime = every * (len(times) - 1), float(times[-1])
    settings.timeIntegration.generalizedAlpha.spectralRadius = 1.0
    settings.timeIntegration.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = float(times[1] - times[0])
    begun = clock.process_time()
    mbs.SolveDynamic(settings)
    seconds = clock.process_time() - begun
    rows = np.asarray(mbs.GetSensorStoredData(sensor))
    places = np.searchsorted(rows[:, 0], times - h / 2)
    return seconds, rows[np.minimum(places, len(rows) - 1), 1:2]


# -- the measurement

def _installed(program: str) -> bool:
    return importlib.util.find_spec(program.lower()) is not None


def measure(motion: Motion, repeats: int = 3) -> Iterator[Point]:
    """Runs of all programs that are installed, each the least of so many times; raises what a run of symdyn raises."""
    module = motion.system().compile()
    n = motion.truth.shape[1]

    def located(times: np.ndarray, setting: float) -> tuple[float, np.ndarray]:
        begun = clock.process_time()
        solution = module.simulate(times, *motion.start, rtol=setting)
        return clock.process_time() - begun, solution.q[:, :n]

    def stepped(times: np.ndarray, setting: float) -> tuple[float, np.ndarray]:
        begun = clock.process_time()
        solution = module.simulate(times, *motion.start, method="moreau", step=setting)
        return clock.process_time() - begun, solution.q[:, :n]

    programs: dict[str, tuple[Runner, tuple[float, ...]]] = {LOCATED: (located, TOLERANCES), STEPPED: (stepped, STEPS)}
    programs |= {name: (run, STEPS) for name, run in motion.peers.items() if _installed(name)}
    for name, (run, settings) in programs.items():
        run(motion.times, settings[0])  # which compiles what is not yet
        for setting in settings:
            runs = [run(motion.times, setting) for _ in range(repeats)]
            error = float(np.abs(runs[0][1] - motion.truth).max()) / motion.size
            yield Point(motion.name, name, setting, error, min(seconds for seconds, _ in runs))


def behind(points: Sequence[Point], below: float = AHEAD) -> list[Point]:
    """Runs of other programs with an error below a bound which no run with located switches is as accurate and as quick as."""
    own = [p for p in points if p.program == LOCATED]
    return [p for p in points if p.program not in (LOCATED, STEPPED) and p.error < below and not any(
        o.motion == p.motion and o.error <= p.error and o.seconds <= p.seconds for o in own)]


def picture(points: Sequence[Point], path: Path) -> None:
    """Work against error of every motion, as a file."""
    from matplotlib.figure import Figure

    names = list(dict.fromkeys(p.motion for p in points))
    figure = Figure(figsize=(4.2 * len(names), 3.8), layout="constrained")
    for name, axes in zip(names, np.atleast_1d(figure.subplots(1, len(names))), strict=True):
        for marker, program in zip("os^d", (LOCATED, STEPPED, MUJOCO, EXUDYN), strict=True):
            own = [p for p in points if p.motion == name and p.program == program]
            if own:
                axes.loglog([max(p.error, 1e-16) for p in own], [1e3 * p.seconds for p in own], marker + "-", label=program)
        axes.set(title=name, xlabel="error by the size of the motion", ylabel="processor time, ms")
        axes.grid(True, alpha=0.3)
        axes.legend(fontsize=7)
    figure.savefig(path)


def run(names: Sequence[str] | None = None, repeats: int = 3, folder: Path | None = None) -> int:
    """Measure the named motions and costs (default: all), print a line of each run, and write table and picture into a folder;
    returns how many runs of other programs are not met, and how many bounds of costs. Raises ArgumentError for names that there
    are not."""
    known: dict[str, Motion | None] = {**motions(), **dict.fromkeys(COSTS)}
    strange = [name for name in names or () if name not in known]
    if strange or repeats < 1:
        raise ArgumentError("; ".join([*[f"there is no motion {name!r}; pass some of {', '.join(known)}" for name in strange],
                                       *[f"{repeats} repeats were asked for; pass 1 or more"] * (repeats < 1)]))
    missing = [name for name in (MUJOCO, EXUDYN) if not _installed(name)]
    print(HEADING, flush=True)
    points: list[Point] = []
    costs: list[Cost] = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)
        for name in names or known:
            motion = known[name]
            for point in measure(motion, repeats) if motion is not None else ():
                points.append(point)
                print(point, flush=True)
            for cost in COSTS[name](repeats) if motion is None else ():
                costs.append(cost)
                print(cost, flush=True)
    if missing:
        print(f"{', '.join(missing)}: not installed; pip install 'symdyn[peers]'")
    missed = behind(points)
    for point in missed:
        print(f"behind: {point.program} has {point.error:.2g} of {point.motion} in {1e3 * point.seconds:.3g} ms")
    where = Path("generated/contacts") if folder is None else folder
    where.mkdir(parents=True, exist_ok=True)
    (where / "contacts.json").write_text(json.dumps([asdict(p) for p in points], indent=1) + "\n", encoding="utf-8")
    if costs:
        (where / "costs.json").write_text(json.dumps([asdict(c) for c in costs], indent=1) + "\n", encoding="utf-8")
    if points and importlib.util.find_spec("matplotlib") is not None:
        picture(points, where / "contacts.svg")
    print(f"wrote {where}")
    return len(missed) + sum(cost.value > cost.bound for cost in costs)
