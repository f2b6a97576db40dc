"""Particles on a sphere that repel each other, many freedoms and as many forces as pairs: the Fekete problem.

Source: Bendtsen and Thomsen; Mazzia and Magherini, Test Set for Initial Value Problem Solvers, release 2.4, problem "Fekete".
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np
import sympy as sp

from symdyn.model.bodies import Body
from symdyn.model.joints import Prismatic
from symdyn.model.symbols import Coordinate, coordinates, parameters
from symdyn.model.system import System

# Circles of latitude on which the particles start: how many, longitude of the first and latitude, rad.
CIRCLES = ((3, 2 * math.pi / 3 + math.pi / 13, 3 * math.pi / 8), (7, 2 * math.pi / 7 + math.pi / 29, math.pi / 8),
           (6, math.pi / 3 + math.pi / 7, -2 * math.pi / 15), (4, math.pi / 17, -3 * math.pi / 10))


def add_particle(system: System, name: str, mass: sp.Expr) -> tuple[Body, list[Coordinate]]:
    """Add a particle with Cartesian coordinates x, y and z of this name; returns its body and the coordinates."""
    body, position = system.ground, []
    for letter, axis in zip("xyz", np.eye(3, dtype=int).tolist(), strict=True):
        q, = coordinates(f"{letter}{name},")
        child = system.add_body(f"{letter}_of_{name}", mass=mass if letter == "z" else 0)
        system.add_joint(Prismatic(f"slide_{letter}{name}", body, child, q, axis=axis))
        body = child
        position.append(q)
    return body, position


def fekete() -> System:
    """Twenty particles of unit mass on the unit sphere, which repel each other by 1/distance and are damped."""
    mass, damping = parameters("m alpha")
    system = System("fekete", gravity=[0, 0, 0])
    particles = []
    for k, start in enumerate(_starts()):
        body, position = add_particle(system, str(k), mass)
        system.initial.update(zip(position, start, strict=True))
        system.add_constraint(sum(q**2 for q in position) - 1, name=f"sphere_{k}")
        system.add_force(body, [-damping * q.dot for q in position], frame=system.ground)
        particles.append((body, position))
    for (a, at), (b, there) in combinations(particles, 2):
        apart = [p - q for p, q in zip(at, there, strict=True)]
        push = [e / sum(e**2 for e in apart) for e in apart]
        system.add_force(a, push, frame=system.ground)
        system.add_force(b, [-e for e in push], frame=system.ground)
    system.defaults = {mass: 1.0, damping: 0.5}
    return system


def _starts() -> Iterator[tuple[float, float, float]]:
    for count, first, latitude in CIRCLES:
        for k in range(count):
            longitude = first + 2 * math.pi * k / count
            yield math.cos(longitude) * math.cos(latitude), math.sin(longitude) * math.cos(latitude), math.sin(latitude)
