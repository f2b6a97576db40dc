"""The table of functions says what the functions are: their shapes, and what a mechanism must have for them."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from typing import Any

import pytest
import sympy as sp

import symdyn as sd
from symdyn.backend.right_side import RightSide
from symdyn.functions.groups import of_right_side
from symdyn.functions.table import ALL, EVERY, FUNCTIONS, INTERMEDIATE, entry_of, quantity_of, title_of
from symdyn.functions.tapes import has_function, tape_as_derived
from symdyn.pipeline import emit
from tests.mechanisms import kitchen_sink

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
    for name, entry in EVERY.items():
        assert re.fullmatch(r"[ -~]+", entry.title), name  # ASCII: it goes into C files
        assert quantity_of(name) == entry.quantity
    of_tree = title_of("inverse_dynamics", True).removeprefix(FUNCTIONS["inverse_dynamics"].title)
    assert of_tree == ", of the tree: loops cut, without constraints"
    assert title_of("M_tilde", False) == FUNCTIONS["mass_matrix"].title and quantity_of("M_tilde") == "M_tilde"


@pytest.mark.parametrize(("name", "title"), [
    ("energy_by_x", "derivatives of energy by x"), ("v_2", "v of link 2"), ("outputs_hessian_x",
     "second derivatives of a weighted sum of outputs by x"), ("bias", INTERMEDIATE["bias"].title), ("unheard_of", "unheard_of")])
def test_titles_are_those_of_the_entries_of_families_and_quantities_too(name: str, title: str) -> None:
    assert title_of(name, False) == title


def test_headers_of_generated_code_have_titles_of_families() -> None:
    text = emit(sd.systems.pendulum().equations(), "c", ["energy_by_x"]).files["pendulum.c"]
    assert "// derivatives of energy by x\n" in text


def on_matrices() -> Any:
    """Equations whose matrices were given."""
    x, y = sd.coordinates("x y")
    m, l, g = sd.parameters("m l g")
    return sd.augmented([x, y], [m, m], [0, -m * g], [x**2 + y**2 - l**2])


def from_positions() -> Any:
    """Equations whose positions were given."""
    q = sd.coordinates("q")
    m, l, g = sd.parameters("m l g")
    return sd.embedding([q], [l * sp.sin(q), -l * sp.cos(q)], [m, m], [0, -m * g])


def thrown() -> Any:
    """A free body with Euler parameters that rebounds by an event with a reset."""
    x, y, z = sd.coordinates("x y z")
    system = sd.System("thrown", gravity=[0, 0, -9.81])
    body = system.add_body("body", mass=2, inertia=[1, 2, 3])
    system.add_joint(sd.Free("free", system.ground, body, [x, y, z, *sd.coordinates("e0:4")], sd.EulerParameters()))
    system.add_event("floor", z, direction=-1, reset={z.dot: -z.dot / 2})
    return system.augmented()


def swung() -> Any:
    """A mass on a rod by a constraint, which a stop throws back."""
    x, y = sd.coordinates("x y")
    system = sd.System("swung", gravity=[0, -9.81, 0])
    slider, bob = system.add_body("slider", mass=1), system.add_body("bob", mass=2)
    system.add_joint(sd.Prismatic("along", system.ground, slider, x, axis=[1, 0, 0]))
    system.add_joint(sd.Prismatic("across", slider, bob, y, axis=[0, 1, 0]))
    system.add_constraint(x**2 + y**2 - 1, name="rod")
    system.add_event("stop", x, direction=1, reset={x.dot: -x.dot})
    return system.augmented()


QUANTITIES: dict[str, Callable[[], Any]] = {
    **{f"{name}, {form}": lambda name=name, form=form: getattr(sd.systems.get(name), form)() for name, forms in {
        "four_bar": ("augmented",), "rocking_block": ("embedding", "recursive", "augmented"), "sleigh": ("augmented",),
        "particle_on_moving_slope": ("augmented",), "three_link_arm": ("embedding", "recursive")}.items() for form in forms},
    **{f"kitchen_sink, {form}": lambda form=form: getattr(kitchen_sink(), form)() for form in ("embedding", "augmented")},
    "given matrices": on_matrices, "given positions": from_positions, "Euler parameters": thrown, "resets": swung}


@pytest.mark.parametrize("case", QUANTITIES)
def test_every_quantity_of_a_formulation_has_an_entry_with_its_shape(case: str) -> None:
    eq = QUANTITIES[case]()
    n = sizes(eq)
    for name in eq.quantities:
        entry = entry_of(name)
        assert entry is not None, name
        if entry.shape is not None:
            assert eq.quantity(name).shape == tuple(number(one, n) for one in entry.shape), name


def test_the_cases_have_what_quantities_are_about() -> None:
    made = {case: make() for case, make in QUANTITIES.items()}
    assert made["Euler parameters"].unit_groups and made["four_bar, augmented"].constraints
    assert made["rocking_block, embedding"].contacts and made["rocking_block, embedding"].events
    assert "carried_variation" in made["resets"].quantities and "F_c" in made["given positions"].quantities
    there = {name for eq in made.values() for name in eq.quantities}
    assert set(INTERMEDIATE) <= there


@pytest.mark.parametrize("name", ["lam_by_x", "energy_by_params", "rhs_by_t", "adjoint_x", "adjoint_x_params", "hessian_x",
                                  "hessian_x_inputs_params", "constraints_hessian_x_params", "cut_loads_by_x", "C_by_inputs"])
def test_families_state_the_shapes_of_their_functions(name: str) -> None:
    eq = equations("four_bar")
    assert has_function(eq, name)
    entry = entry_of(name)
    assert entry is not None and entry.shape is not None
    found = next(iter(tape_as_derived(eq, name).outputs.values())).shape
    assert found == tuple(number(one, sizes(eq)) for one in entry.shape)


def test_functions_of_integrators_have_entries_and_other_names_have_none() -> None:
    eq = QUANTITIES["resets"]()
    names = [*of_right_side(eq, RightSide(sensitivities=("",))), *of_right_side(eq, RightSide(adjoint=()))]
    assert {"corrected_columns", "event_reset_columns", "carried_columns", "rhs_weights", "event_bounds"} <= set(names)
    assert all(entry_of(name) for name in names)
    assert [entry_of(name) for name in ("bogus", "bogus_by_x", "lam_by_x_by_x", "hessian_p", "v_0")] == [None] * 5
