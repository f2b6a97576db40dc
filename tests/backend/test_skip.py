"""Code that a mechanism does not need is not there: seen in operation counts and in the written source."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest

import symdyn as sd
from symdyn.backend.source import Source
from symdyn.functions.table import FUNCTIONS
from symdyn.pipeline import emit
from tests.mechanisms import pendulums, planar_or_spatial, split_by_fixed_joint


def operations(equations: Any, function: str) -> int:
    """Operations of one evaluation, without what is hoisted."""
    return int(equations.tape(FUNCTIONS[function].quantity).operations)


def rendered(equations: Any, *functions: str) -> Source:
    return emit(equations, "c", functions, standalone=False, integrator=False)


def body(source: Source, function: str) -> str:
    """The statements of one C function."""
    text = next(iter(source.files.values()))
    found = re.search(rf"^SYMDYN_EXPORT int {source.metadata.name}_{function}\([^)]*\) {{\n(.*?)^}}", text,
                      re.MULTILINE | re.DOTALL)
    assert found is not None
    return re.sub(r"//.*", "", found[1])


SMALL = ("mass_matrix", "k_tilde", "F_tilde", "energy", "positions")


@pytest.mark.parametrize("name", ["double_pendulum", "three_link_arm", "kitchen_sink"])
def test_one_function_asked_for_costs_less_than_all(name: str, derived: Callable[..., Any]) -> None:
    equations = derived(name)
    together = equations.tape(*[FUNCTIONS[f].quantity for f in SMALL]).operations
    for function in SMALL:
        assert operations(equations, function) < together
        source = rendered(equations, function)
        assert [f.name for f in source.program.functions] == [function]
        others = [f for f in (*SMALL, "rhs", "J", "outputs") if f != function]
        text = next(iter(source.files.values()))
        assert not any(f"{equations.name}_{other}(" in text for other in others)


def test_mass_matrix_reads_neither_loads_nor_speeds(derived: Callable[..., Any]) -> None:
    source = rendered(derived("kitchen_sink"), "mass_matrix")
    text = body(source, "mass_matrix")
    assert source.metadata.arguments["mass_matrix"] == ["t", "q", "c"] or "u[" not in text
    assert not any(word in text for word in ("u[", "inputs[", "z[", "exp(", "erf(", "?"))


def test_constants_are_those_of_the_functions_asked_for(derived: Callable[..., Any]) -> None:
    equations = derived("three_link_arm")
    assert rendered(equations, "positions").program.n_c < rendered(equations, "rhs").program.n_c
    assert rendered(equations, "positions").program.prologue.count < rendered(equations, "rhs").program.prologue.count


def test_no_time_where_nothing_depends_on_it(derived: Callable[..., Any]) -> None:
    still, shaken = rendered(derived("double_pendulum"), "rhs", "energy"), rendered(derived("kitchen_sink"), "rhs", "energy")
    assert all("t" not in arguments for arguments in still.metadata.arguments.values())
    assert "double t" not in next(iter(still.files.values()))
    assert all("t" in arguments for arguments in shaken.metadata.arguments.values())


def test_nothing_but_what_is_there_is_passed(derived: Callable[..., Any]) -> None:
    arguments = rendered(derived("double_pendulum"), "rhs").metadata.arguments["rhs"]
    assert not {"z", "inputs", "ud", "t"} & set(arguments)


@pytest.mark.parametrize("function", ["rhs", "mass_matrix", "k_tilde", "F_tilde", "energy", "inverse_dynamics"])
def test_plane_in_space_costs_no_more(function: str) -> None:
    flat, spatial = (planar_or_spatial(planar).embedding() for planar in (True, False))
    assert operations(spatial, function) <= operations(flat, function)
    count = [rendered(e, function).program.prologue.count for e in (spatial, flat)]
    assert count[0] <= count[1]


@pytest.mark.parametrize("n", [1, 2, 4])
def test_constant_mass_matrix_is_factorized_once(n: int, derived: Callable[..., Any]) -> None:
    source = rendered(derived("prismatic_chain", n=n), "rhs", "mass_matrix")
    program = source.program
    rhs, mass_matrix = program.functions
    assert "div" not in rhs.operations and "/" not in body(source, "rhs")
    assert mass_matrix.count == 0
    assert program.prologue.operations["div"] == n and body(source, "prologue").count("/") == n
    # Every pivot is demanded to be positive, also one that is a plain parameter, and nowhere else.
    assert body(source, "prologue").count("> 0.0)) return") == n
    assert not any("> 0.0" in body(source, f) for f in ("rhs", "mass_matrix"))
    # Forward and back substitution with L of a full matrix, from the forces.
    assert rhs.count <= 2 * n * n


def test_mass_matrix_that_varies_is_factorized_at_every_state(derived: Callable[..., Any]) -> None:
    source = rendered(derived("double_pendulum"), "rhs")
    assert source.program.functions[0].operations["div"] >= 1 and "return" in body(source, "rhs").split("return 0")[0]


def test_mechanisms_that_do_not_touch_are_solved_separately() -> None:
    one, other, both = (pendulums(*numbers).embedding() for numbers in ((1,), (2,), (1, 2)))
    for function in ("rhs", "mass_matrix", "k_tilde", "F_tilde", "inverse_dynamics"):
        assert operations(both, function) == operations(one, function) + operations(other, function)
    M = both.quantity("M_tilde")
    assert M.shape == (4, 4) and (M[:2, 2:] == 0).all() and (M[2:, :2] == 0).all()
    assert not re.search(r"L[34]_[12]", body(rendered(both, "rhs"), "rhs"))


def test_fixed_joint_costs_nothing() -> None:
    whole, split = (split_by_fixed_joint(s).embedding() for s in (False, True))
    for function in ("rhs", "mass_matrix", "inverse_dynamics"):
        assert operations(split, function) == operations(whole, function)
    assert any("weld" in note for note in split.notes)


def test_structural_zeros_are_not_computed(derived: Callable[..., Any]) -> None:
    """Coriolis terms of sliders, gravity in a horizontal plane: the numbers 0, not operations that give 0."""
    chain = derived("prismatic_chain", n=3)
    assert (chain.quantity("k_tilde") == 0).all()
    assert "out[0] = 0.0;" in body(rendered(chain, "k_tilde"), "k_tilde")
    assert operations(chain, "k_tilde") == 0


def test_sine_and_cosine_once_for_each_angle(derived: Callable[..., Any]) -> None:
    for name, n in (("double_pendulum", 2), ("three_link_arm", 3), ("spatial_chain", 4)):
        equations = derived(name, n=n) if name == "spatial_chain" else derived(name)
        count = rendered(equations, "rhs").program.functions[0].operations["trig"]
        assert count <= 2 * n, name


def test_symmetric_entries_are_formed_once(derived: Callable[..., Any]) -> None:
    M = derived("three_link_arm").quantity("M_tilde")
    assert all(M[i, j] is M[j, i] for i in range(3) for j in range(3))


def test_no_inputs_no_input_handling(derived: Callable[..., Any]) -> None:
    quiet, driven = (next(iter(emit(derived(n), "c", ["rhs"], standalone=False).files.values()))
                     for n in ("pendulum", "driven_oscillator"))
    assert "symdyn_inputs_at" not in quiet and "symdyn_inputs_at" in driven


def test_integrator_only_with_the_right_hand_side() -> None:
    equations = sd.systems.pendulum().embedding()
    assert "dop853" in next(iter(emit(equations, "c", ["rhs"]).files.values()))
    assert "dop853" not in next(iter(emit(equations, "c", ["energy"]).files.values()))
    assert "dop853" not in next(iter(emit(equations, "c", ["rhs"], integrator=False).files.values()))
