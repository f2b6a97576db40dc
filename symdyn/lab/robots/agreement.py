"""Agreement of symdyn's results for a robot with those of Pinocchio."""

from __future__ import annotations

import numpy as np

from symdyn.formulation.equations import Equations
from symdyn.lab.robots.pinocchio_robot import PinocchioRobot
from symdyn.model.joints import Fixed, Free, Planar, Prismatic
from symdyn.model.record import Model
from symdyn.tape.floats import evaluate_rows

# symdyn's name of each quantity.
NAMES = {"tau": "inverse_dynamics", "M": "M_tilde", "ud": "accelerations", "J": "J", "com": "center_of_mass",
         "energy": "energy"}


def random_states(model: Model, n: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q (n, n_q) with any angles and attitudes and lengths up to 0.5 m, u and u_dot (n, n_u) up to 1 of their units."""
    q, u, ud = np.zeros((n, len(model.coordinates))), *rng.uniform(-1, 1, (2, n, len(model.speeds)))
    for joint in model.joints:
        columns = [model.coordinates.index(s) for s in joint.coordinates if s in model.coordinates]
        if not columns or isinstance(joint, Fixed):
            continue
        lengths = {Prismatic: 1, Planar: 2, Free: 3}.get(type(joint), 0)
        q[:, columns[:lengths]] = rng.uniform(-0.5, 0.5, (n, lengths))
        if isinstance(joint, Free):
            e = rng.normal(size=(n, 4))
            q[:, columns[3:]] = e / np.linalg.norm(e, axis=1)[:, None]
        else:
            q[:, columns[lengths:]] = rng.uniform(-np.pi, np.pi, (n, len(columns) - lengths))
    return q, u, ud


def differences(equations: Equations, model: Model, peer: PinocchioRobot, n: int, seed: int = 0) -> dict[str, float]:
    """The worst of each quantity over n random states: norm of the difference over the norm; for ud divided by the condition
    number of the mass matrix as well."""
    q, u, ud = random_states(model, n, np.random.default_rng(seed))
    names = [s.name for s in (*model.coordinates, *model.speeds)] + [f"{s.name}_dot" for s in model.speeds]
    given = {p.name: model.defaults[p] for p in model.parameters} | dict(zip(names, [*q.T, *u.T, *ud.T], strict=True))
    tape = equations.tape(*NAMES.values())
    result = evaluate_rows(tape, given, n)
    worst = dict.fromkeys(NAMES, 0.0)
    for k in range(n):
        wanted = peer.quantities(q[k], u[k], ud[k])
        for short, name in NAMES.items():
            difference = float(np.linalg.norm(result[name][k] - wanted[short]) / np.linalg.norm(wanted[short]))
            if short == "ud":
                difference /= float(np.linalg.cond(wanted["M"]))
            # a NaN is the worst of all
            worst[short] = difference if not difference <= worst[short] else worst[short]
    return worst

