"""Many balls in a box by time stepping: how long a second of motion takes, and by how much the laws of contact are missed.

The record of a run is checked again, in NumPy: of every contact in every step the law of impact, the cone of friction and its
direction from velocities and impulses; gaps of all pairs and planes from the positions.

    symdyn bench balls
"""

from __future__ import annotations

import resource
import time as clock
import warnings
from dataclasses import dataclass

import numpy as np

import symdyn as sd
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.runtime.module import Module
from symdyn.runtime.solutions.solution import Solution

G, RADIUS, MASS, FRICTION, RESTITUTION = 9.81, 0.05, 1.0, 0.3, 0.2
# Distance of the balls at the start, by their radius, and how far they are displaced at random.
APART, SCATTER = 2.3, 0.1
# Steps of a second of motion.
STEP = 5e-3


def box(n: int) -> tuple[sd.System, np.ndarray]:
    """Balls above the floor of an open box that is half as wide as they are high, and their coordinates, (7*n,)."""
    side = int(np.ceil((n / 2) ** (1 / 3)))
    half = side * APART * RADIUS / 2
    system = sd.System("balls", gravity=[0, 0, -G])
    balls = [system.add_body(f"ball_{k}", mass=MASS, inertia=[0.4 * MASS * RADIUS**2] * 3) for k in range(n)]
    for k, ball in enumerate(balls):
        system.add_joint(sd.Free(f"joint_{k}", system.ground, ball, orientation=sd.EulerParameters()))
    walls = [sd.contacts.Plane([-x, -y, 0], [x * half, y * half, 0]) for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    system.add_contact(sd.ContactGroup("balls", balls, sd.contacts.Sphere(RADIUS), [sd.contacts.Plane(), *walls], FRICTION,
                                       RESTITUTION))
    layer = (np.indices((side, side)).reshape(2, -1).T - (side - 1) / 2) * APART * RADIUS
    levels = np.arange(-(-n // side**2)) * APART * RADIUS + 1.2 * RADIUS
    places = np.array([[x, y, z] for z in levels for x, y in layer])[:n]
    places += np.random.default_rng(1).uniform(-SCATTER * RADIUS, SCATTER * RADIUS, places.shape)
    return system, np.hstack([places, np.tile([1.0, 0, 0, 0], (n, 1))]).ravel()


def missed(solution: Solution) -> np.ndarray:
    """The largest velocity by which a contact misses the laws in every step, m/s, (n_steps,): of impact, w_n + e w_n_before >= 0
    or no impulse; of friction, an impulse within the cone, and of its full size against the slip where it slips."""
    stepped = solution.stepped
    assert stepped is not None
    values = stepped.touched.values
    end, impulse, begin = values[:, 1:4], values[:, 4:7], values[:, 7:10]
    free = MASS * 2 / 7  # a ball's mass at the place where it touches, along a tangent
    law = end[:, 0] + RESTITUTION * np.minimum(begin[:, 0], 0.0)
    off = np.abs(np.minimum(law, impulse[:, 0] / MASS))
    bound, pull, slip = FRICTION * impulse[:, 0], np.linalg.norm(impulse[:, 1:], axis=1), np.linalg.norm(end[:, 1:], axis=1)
    outside = (pull - bound) / free
    slack = np.minimum(slip, np.maximum(bound - pull, 0.0) / free)
    along = np.abs(pull * slip + (impulse[:, 1:] * end[:, 1:]).sum(axis=1))
    turned = along / np.maximum(pull, 1e-300) * (pull > 1e-12)
    worst = np.zeros(len(stepped.h))
    np.maximum.at(worst, stepped.touched.step, np.maximum.reduce([off, outside, slack, turned]))
    return worst


def deepest(solution: Solution, n: int) -> float:
    """The largest overlap of two balls, or of one and a plane, at all stored times, m."""
    from scipy.spatial import cKDTree

    half, worst = int(np.ceil((n / 2) ** (1 / 3))) * APART * RADIUS / 2, 0.0
    for places in solution.q.reshape(len(solution.t), n, 7)[:, :, :3]:
        pairs = cKDTree(places).query_pairs(2 * RADIUS, output_type="ndarray")
        gaps = np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1) - 2 * RADIUS
        walls = half - np.abs(places[:, :2]) - RADIUS
        worst = max(worst, -min(gaps.min(initial=0.0), walls.min(), (places[:, 2] - RADIUS).min()))
    return worst


@dataclass(frozen=True)
class Measured:
    """Seconds of deriving, of compilers and of a second of motion, contacts in the mean, quantiles (0.5, 0.9, 1) of what the laws
    are missed by in a step, m/s, the largest overlap, m."""

    n: int
    derived: float
    compiled: float
    ran: float
    contacts: float
    missed: tuple[float, float, float]
    overlap: float

    def __str__(self) -> str:
        half, most, worst = self.missed
        return (f"{self.n:6}{self.derived:12.2f}{self.compiled:12.1f}{self.ran:10.2f}{self.contacts:11.0f}"
                f"{half:11.1e}{most:11.1e}{worst:11.1e}{self.overlap:11.1e}")


HEADING = (f"{'balls':>6}{'derived, s':>12}{'compiled, s':>12}{'runs, s':>10}{'contacts':>11}{'missed':>11}{'90 %':>11}"
           f"{'worst':>11}{'overlap':>11}")


def _of_compilers() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def measure(n: int, step: float = STEP) -> Measured:
    """A second of motion of n balls; processor times."""
    system, start = box(n)
    begun = clock.process_time()
    module: Module = system.compile()
    derived, compilers = clock.process_time() - begun, _of_compilers()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)
        module.simulate((0, step), q=start, method="moreau", step=step)
        compiled, begun = _of_compilers() - compilers, clock.process_time()
        solution = module.simulate((0, 1), q=start, method="moreau", step=step)
    ran = clock.process_time() - begun
    stepped = solution.stepped
    assert stepped is not None
    half, most, worst = np.quantile(missed(solution), [0.5, 0.9, 1.0]).tolist()
    return Measured(n, derived, compiled, ran, len(stepped.touched.a) / len(stepped.h), (half, most, worst), deepest(solution, n))


def run(numbers: str = "30,60,125,250,500", step: float = STEP) -> int:
    """Measure boxes of so many balls each, and print a line of each. Raises ArgumentError for numbers of balls that are none."""
    wanted = [text.strip() for text in numbers.split(",")]
    if not all(text.isdecimal() and int(text) > 0 for text in wanted) or not step > 0:
        raise ArgumentError(f"balls are {numbers!r}, and the step is {step:g} s; pass numbers such as '30,60', and a positive "
                            "step")
    print(HEADING, flush=True)
    for text in wanted:
        print(measure(int(text), step), flush=True)
    return 0
