"""Names that have parts are recognized as what they were put together from, and other names are not taken apart."""

from __future__ import annotations

import itertools

import pytest

from symdyn.formulation import names

ORDERED = [wrt for n in range(1, 5) for wrt in itertools.combinations(("x", "inputs", "params", "t"), n)]


def test_derivatives_are_recognized_by_their_last_part() -> None:
    functions = ("lam", "inverse_dynamics", "reactions_by_lam", "lam_by_x")
    for of, by in itertools.product(functions, ("x", "inputs", "params", "t", "ud")):
        assert names.derivative_named(f"{of}_by_{by}") == (of, by)
        assert names.Derivative(of, by).name == f"{of}_by_{by}"
    others = ("reactions_by_lam", "rhs_variation_by_matrix", "_by_x", "jacobian_x")
    assert [names.derivative_named(name) for name in others] == [None] * 4


def test_derivatives_of_the_right_hand_side_have_names_of_their_own() -> None:
    assert [names.derivative_of("rhs", by) for by in ("x", "inputs", "params", "t")] == [
        "jacobian_x", "jacobian_inputs", "jacobian_params", "rhs_by_t"]
    assert names.derivative_of("lam", "x") == "lam_by_x"
    assert names.differentiated("jacobian_params") == ("rhs", "params") and names.differentiated("lam_by_x") == ("lam", "x")
    assert names.differentiated("jacobian_x_packed") is None


@pytest.mark.parametrize("wrt", ORDERED)
def test_second_derivatives_are_recognized_with_their_groups(wrt: tuple[str, ...]) -> None:
    for kind in ("adjoint", "hessian", "hessian_product"):
        assert names.second_named("_".join((kind, *wrt))) == (kind, wrt)
        assert names.Weighted(kind, wrt).name == "_".join((kind, *wrt))
    for of in ("constraints", "outputs"):
        assert names.curvature_named("_".join((of, "hessian", *wrt))) == (of, wrt)
        assert names.Curvature(of, wrt).name == "_".join((of, "hessian", *wrt))


@pytest.mark.parametrize("name", ["adjoint", "hessian_", "hessian_inputs_x", "adjoint_x_x", "adjoint_along_q", "hessian_product",
                                  "rhs_hessian_x", "outputs_hessian", "outputs_hessian_params_x"])
def test_other_names_are_no_second_derivatives(name: str) -> None:
    assert names.second_named(name) is None and names.curvature_named(name) is None


def test_quantities_of_links_are_recognized_by_letter_and_number() -> None:
    assert names.link_named("X_star_12") == ("X_star", 12) and names.OfLink("X_star", 12).name == "X_star_12"
    assert names.link_named("I_1") == ("I", 1) and names.link_named("I_A_1") == ("I_A", 1)
    assert [names.link_named(n) for n in ("output_v_1", "v_0", "v", "page_1", "C_1")] == [None] * 5


def test_outputs_are_recognized_by_the_name_that_the_user_gave() -> None:
    assert names.output_quantity("v_1") == "output_v_1" and names.output_named("output_v_1") == "v_1"
    assert names.outputs_in(["rhs", "output_b", "outputs_variation", "output_a"]) == {"output_b": "b", "output_a": "a"}
    assert list(names.outputs_in(["output_b", "output_a"])) == ["output_b", "output_a"]
