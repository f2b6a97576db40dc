"""Start of a mechanism in a program of its own, such as an FMU or a Modelica model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from symdyn.arguments import take
from symdyn.errors import ArgumentError
from symdyn.formulation.equations import Equations
from symdyn.runtime.consistent import check_start
from symdyn.runtime.integrating.simulate import start_of
from symdyn.runtime.masses import real_parameters
from symdyn.runtime.module import Module
from symdyn.shown import name_of, shown


def start_values(module: Module, what: str, q: Any, u: Any, z: Any, params: Any, inputs: Any) -> dict[str, np.ndarray]:
    """States x on the constraints, inputs and parameters p at the start; what: "an FMU", in messages.

    Raises ArgumentError for what a program without Python cannot have: inputs in Python, rigid contacts.
    """
    metadata = module.metadata
    if metadata.contacts or metadata.contact_groups:
        which = [*(c.name for c in metadata.contacts), *(g.name for g in metadata.contact_groups)][0]
        raise ArgumentError(f"{module.name}: {what} asked for, but the impacts and modes of the rigid contact {which} are found "
                            f"in Python, which {what} does not have; give it law='compliant', whose forces are in the equations")
    given = inputs if isinstance(inputs, Mapping) else {"inputs": inputs}
    written = next(((name_of(key), value) for key, value in given.items() if callable(value) or hasattr(value, "period")), None)
    if written:
        raise ArgumentError(f"{module.name}: {what} asked for with {written[0]} = {shown(written[1])}, a function in Python, "
                            f"which {what} does not have; pass a number for the start and set the input in the program that "
                            "imports it, or put the function into the equations as an expression")
    free = take(inputs, metadata.inputs, "inputs", metadata.initial_values("inputs"), module.name)
    p = real_parameters(module, params)
    x = start_of(module, q, u, z)
    check_start(module.following(free), 0.0, x, p)
    return {"x": x, "inputs": free, "p": p}


def equations_of(module: Module, what: str) -> tuple[Equations, Mapping[Any, float] | None]:
    """The equations of a module, and the parameters that are numbers in it. Raises ArgumentError where it has none."""
    provider: Any = module._provider
    if not hasattr(provider, "equations"):
        raise ArgumentError(f"{module.name}: {what} asked for of a module that was put together without equations; compile "
                            "equations")
    equations: Equations = provider.equations
    return equations, provider.specialize
