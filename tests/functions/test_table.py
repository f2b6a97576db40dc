"""The table of functions says what the functions are: their shapes, and what a mechanism must have for them."""

from __future__ import annotations

import functools
import re
from typing import Any

import pytest

import symdyn as sd
from symdyn.functions.table import ALL, FUNCTIONS, quantity_of, title_of
from symdyn.functions.tapes import has_function, tape_as_derived

MECHANISMS = {"cart_pole": "embedding", "four_bar": "augmented", "three_link_arm": "recursive", "flyball_governor": "embedding",
              "prismatic_chain": "recursive", "rolling_disc": "augmented"}


@functools.cache
def equations(name: str) -> Any:
    return getattr(sd.systems.get(name), MECHANISMS[name])()


def sizes(eq: Any) -> dict[str, int]:
    s = eq.symbols
    n = {"n_q": len(s.coordinates), "n_u": len(s.speeds), "n_z": len(s.states), "n_in": len(s.inputs),
         "n_p": len(s.parameters), "n_c": len(eq.constraints), "n_b": len(eq.bodies), "n_j": len(eq.joints),
         "n_e": len(eq.events)}
    return {**n, "n_x": n["n_q"] + n["n_u"] + n["n_z"]}


def number(text: str, n: dict[str, int]) -> int:
    """The value of a sum of products such as "n_x + 2 n_c"."""
    total = 0
    for term in text.split(" + "):
        value = 1
        for factor in term.split():
            value *= int(factor) if factor.isdigit() else n[factor]
        total += value
    return total


def names(eq: Any) -> list[str]:
    return [n for n in ALL if has_function(eq, n)]


@pytest.mark.parametrize("name", MECHANISMS)
def test_shapes_are_those_of_the_tapes(name: str) -> None:
    eq = equations(name)
    n = sizes(eq)
    stated = [f for f in names(eq) if ALL[f].shape is not None]
    assert len(stated) > 15
    for function in stated:
        found = next(iter(tape_as_derived(eq, function).outputs.values())).shape
        assert found == tuple(number(one, n) for one in ALL[function].shape or ()), function


def test_functions_are_there_where_a_mechanism_has_what_they_need() -> None:
    for name in MECHANISMS:
        eq = equations(name)
        there = set(names(eq))
        for function, entry in ALL.items():
            if entry.needs == "constraints":
                assert (function in there) == bool(eq.constraints), (name, function)
            if entry.needs == "outputs" and function in FUNCTIONS:
                assert (function in there) == any(q.startswith("output_") for q in eq.quantities), (name, function)
            if entry.needs == "":
                assert function in there, (name, function)


def test_titles_are_plain_text_for_headers() -> None:
    for name, entry in ALL.items():
        assert re.fullmatch(r"[ -~]+", entry.title), name  # ASCII: it goes into C files
        assert quantity_of(name) == entry.quantity
    of_tree = title_of("inverse_dynamics", True).removeprefix(FUNCTIONS["inverse_dynamics"].title)
    assert of_tree == ", of the tree: loops cut, without constraints"
    assert title_of("M_tilde", False) == "M_tilde" == quantity_of("M_tilde")
