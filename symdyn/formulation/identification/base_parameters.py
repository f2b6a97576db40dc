"""Base parameters: the smallest set of inertial parameters that the equations of motion depend on, tau = Y_b pi_b.

Parameters that a joint does not set in motion are counted to the parent link (see regrouping), which leaves seven parameters of a
link that turns and four of one that slides. Columns of the regressor that are zero at every state are dropped: parameters without
effect. Columns that follow from others, as those of a motor geared to a joint do, are dropped too, and their parameters added to
those of the others with the factors by which they follow.
Source: Gautier and Khalil, Direct calculation of minimum set of inertial parameters of serial robots (1990); Khalil and
Dombre, Modeling, Identification and Control of Robots, section 9.4.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.errors import SymdynError
from symdyn.formulation.identification.regressor import PARAMETERS, entries, project, regressor
from symdyn.formulation.identification.regrouping import factors
from symdyn.formulation.probes.independent import independent
from symdyn.formulation.trees.tree import Pose, Tree, build
from symdyn.model.orientation import EulerParameters
from symdyn.spatial.vectors import identity, vector, zeros
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.node import PARAMETER, is_zero
from symdyn.tape.tape import Tape

# Tolerance between a factor found on the tape and the one found in numbers.
_AGREEMENT = 1e-6


@dataclass(frozen=True)
class Base:
    """The base parameters on the tape.

    names      of the parameters: what they are, and of which link, such as "I_zz_upper"
    values     (n,) from the parameters of the model
    Y          (n_u, n) their regressor
    margins    how clearly the independent columns differ from the dependent ones, see Independent
    """

    names: tuple[str, ...]
    values: np.ndarray
    Y: np.ndarray
    margins: tuple[float, float]


def base(tree: Tree, speed_rates: np.ndarray, a_0: np.ndarray) -> Base:
    """The base parameters of a tree.

    speed_rates   nodes of u_dot, (n_u,); a_0: acceleration of the base, n-frame, (3,), -gravity for the weight
    Raises SymdynError where double precision does not determine what is independent.
    """
    if tree.parallel:  # parameters are constants in body-fixed axes only
        tree = build(tree.model, tree.algebra)
    w_dot = tree.joint_accelerations(speed_rates)
    places = [Pose(k, identity(), zeros(3)) for k in range(len(tree.links))]
    Y = project(tree, regressor(tree, w_dot, a_0, places))
    values = [e for link in tree.links for e in entries(link.effective)]
    names = [f"{parameter}_{link.name}" for link in tree.links for parameter in PARAMETERS]
    felt = [k for k in range(len(values)) if not is_zero(values[k]) and not all(map(is_zero, Y[:, k]))]
    values, names, Y = [values[k] for k in felt], [names[k] for k in felt], Y[:, felt]
    sample, parameters = _sampled(tree, Y)
    result = independent(sample, names)
    for column, numbers in result.coefficients.items():
        with tree.algebra.section(f"base parameters: {names[column]} regrouped"):
            others = list(numbers)
            exact = factors(tree.algebra.recorder, Y[:, others], Y[:, column], parameters, _unit_groups(tree))
            _demand_agreement(tree, exact, list(numbers.values()), parameters, names[column])
            for k, factor in zip(others, exact, strict=True):
                values[k] = values[k] + factor * values[column]
    kept = list(result.kept)
    return Base(tuple(names[k] for k in kept), vector(*[values[k] for k in kept]), Y[:, kept], result.margins)


def _sampled(tree: Tree, Y: np.ndarray) -> tuple[np.ndarray, dict[str, float]]:
    """The regressor at random states, one below the other, (m, n), and the numbers taken for the parameters."""
    n = max(8, -(-3 * Y.shape[1] // max(1, Y.shape[0])))
    tape = Tape.of(tree.algebra.recorder, Y=Y)
    stream = np.random.default_rng(1)
    numbers: dict[str, Any] = {leaf.args[1]: float(stream.uniform(0.5, 1.5)) if leaf.mask == PARAMETER
                               else stream.uniform(-1.5, 1.5, n) for leaf in tape.inputs}
    for group in _unit_groups(tree):
        length = np.sqrt(sum(np.square(numbers.setdefault(name, stream.uniform(-1.5, 1.5, n))) for name in group))
        numbers.update({name: numbers[name] / length for name in group})
    rows = evaluate_rows(tape, numbers, n)["Y"]
    rows = rows[np.isfinite(rows).all(axis=(1, 2))]
    sample = rows.reshape(len(rows) * Y.shape[0], Y.shape[1])
    if len(sample) < Y.shape[1]:
        raise SymdynError(f"{tree.model.name}: the regressor is defined at {len(rows)} of {n} random states only (coordinates "
                          "and speeds in [-1.5, 1.5], parameters in [0.5, 1.5]); check where the coordinates of its joints "
                          "leave their domain, such as log, sqrt or a division")
    return sample, {leaf.args[1]: numbers[leaf.args[1]] for leaf in tape.inputs if leaf.mask == PARAMETER}


def _demand_agreement(tree: Tree, exact: list[Any], wanted: list[float], parameters: Mapping[str, float],
                      name: str) -> None:
    result = evaluate_rows(Tape.of(tree.algebra.recorder, factors=vector(*exact)), parameters, 1)["factors"][0]
    if not np.allclose(result, wanted, rtol=_AGREEMENT, atol=_AGREEMENT):
        raise SymdynError(f"{tree.model.name}: {name} follows from other parameters with the factors {wanted}, but expressions "
                          f"for them give {result.tolist()}; describe the joints by plain coordinates")


def _unit_groups(tree: Tree) -> list[list[str]]:
    return [[q.name for q in joint.coordinates[-4:]] for joint in tree.model.joints
            if isinstance(getattr(joint, "orientation", None), EulerParameters)]
