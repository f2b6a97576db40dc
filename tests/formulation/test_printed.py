"""Printed equations are those that the generated code computes: see symdyn.lab.printed for the mechanisms."""

import dataclasses

import pytest
import sympy as sp

from symdyn.lab import printed


@pytest.mark.parametrize("title", ["named embedding", "dependent embedding", "custom embedding", "quasi embedding",
                                   "constrained augmented"])
def test_explicit_quantities_agree_with_generated_code(title):
    found = list(printed.compare(printed.SYSTEMS[title](), states=1, most=60))
    assert len(found) > 6 and all(c.passed for c in found), [c for c in found if not c.passed]
    assert {"rates", "N"} <= {c.name for c in found}


def test_a_symbol_that_the_equations_do_not_have_is_found():
    equations = printed.SYSTEMS["named embedding"]()
    v = equations.symbols.speeds[0]
    leaves = {symbol: leaf for symbol, leaf in equations.leaves.items() if symbol != v}
    spoilt = dataclasses.replace(equations, leaves={**leaves, sp.Symbol("v"): equations.leaves[v]})
    wrong = [c for c in printed.compare(spoilt, states=1, most=20) if not c.passed]
    assert "rates" in [c.name for c in wrong] and all(c.strange == ("v",) for c in wrong)
