"""The same records on other scalars."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from fractions import Fraction
from typing import Any

import numpy as np

from symdyn.formulation.loads.recorded import Applied
from symdyn.formulation.textbook.rates import Rates
from symdyn.formulation.trees.flexible import FlexibleLink
from symdyn.formulation.trees.tree import Link, Pose, Tree
from symdyn.spatial.inertia import ArticulatedInertia, Inertia
from symdyn.spatial.vectors import vector
from symdyn.tape.node import Node

RECORDS = (Tree, Link, Pose, Inertia, ArticulatedInertia, FlexibleLink, Applied, Rates)


def on_scalars(value: Any, number: Callable[[Any], Any]) -> Any:
    """A tree, its loads, its rates, or a tuple of such, with every node, fraction and float taken over by `number`.

    Integers stay, so that zeros are exact; so does everything that is no scalar.
    """
    if isinstance(value, np.ndarray):
        return vector(*[on_scalars(e, number) for e in value.ravel()]).reshape(value.shape)
    if isinstance(value, RECORDS):
        return replace(value, **{f.name: on_scalars(getattr(value, f.name), number) for f in fields(value)})
    if isinstance(value, (tuple, list)):
        return type(value)(on_scalars(e, number) for e in value)
    return number(value) if isinstance(value, (Node, Fraction, float)) else value
