"""Equations and modules pickle and copy: by their description, and with the text of what was generated."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import SymdynError
from tests.running import run_program

FORMS = [("two_link_arm", "embedding"), ("spatial_chain", "recursive"), ("four_bar", "augmented"),
         ("pendulum_absolute", "augmented")]


@pytest.mark.parametrize(("name", "form"), FORMS)
def test_equations_are_derived_again_to_the_same_quantities(name: str, form: str) -> None:
    first = getattr(sd.systems.get(name), form)()
    first = replace(first, simplify_seconds=3.0)
    for again in (pickle.loads(pickle.dumps(first)), copy.deepcopy(first)):
        assert again is not first and again.recorder is not first.recorder and again.simplify_seconds == 3.0
        assert (again.F_tilde - first.F_tilde).is_zero_matrix and again.constraints == first.constraints
        assert again.symbols == first.symbols


def test_equations_by_hand() -> None:
    q = sd.coordinates("q")
    m, l = sd.parameters("m l", positive=True)
    eq = sd.embedding(coordinates=[q], position=[l * sp.sin(q), -l * sp.cos(q)], mass=[m, m], force=[0, -9 * m], name="bob")
    assert pickle.loads(pickle.dumps(eq)).M_tilde == eq.M_tilde


def test_equations_without_a_description_are_named() -> None:
    eq = replace(sd.systems.pendulum().embedding(), again=None)
    with pytest.raises(SymdynError, match="pendulum: these equations were put together by hand, without what they are derived"):
        pickle.dumps(eq)


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_modules_travel_with_what_was_generated_and_make_the_rest(backend: str, tmp_path: Path) -> None:
    if backend == "c" and sd.systems.pendulum().compile().backend != "c":
        pytest.skip("no C compiler here")
    module = sd.systems.get("four_bar").augmented().compile(backend)
    x = module.consistent(q={"q1": 0.4})
    state = np.concatenate(x)
    wanted = module.rhs(0.3, state)
    data = pickle.dumps(module)
    back = pickle.loads(data)
    assert back.metadata == module.metadata and (back.rhs(0.3, state) == wanted).all()
    assert back._provider._equations is None  # the text was enough
    assert (back.mass_matrix(x[0]) == module.mass_matrix(x[0])).all() and back._provider._equations is None
    assert (back.jacobian(0.3, state).x == module.jacobian(0.3, state).x).all() and back._provider._equations is not None
    assert (copy.deepcopy(module).rhs(0.3, state) == wanted).all()
    assert [p.name for p in back.write(tmp_path)] == [p.name for p in module.write(tmp_path)]


def test_another_process_computes_the_same_bits(tmp_path: Path) -> None:
    module = sd.systems.get("double_pendulum").compile()
    x = np.array([0.3, -1.2, 0.5, 2.0])
    (tmp_path / "module.pickle").write_bytes(pickle.dumps(module))
    (tmp_path / "there.py").write_text("import pickle; m = pickle.load(open('module.pickle', 'rb'))\n"
                                       "print(m.rhs(0.0, [0.3, -1.2, 0.5, 2.0]).tobytes().hex(), m.rhs(0.0, [0.0] * 4).shape)")
    run = run_program(tmp_path / "there.py")
    assert run.returncode == 0, run.stderr
    assert run.stdout.split()[0] == module.rhs(0.0, x).tobytes().hex()


def test_a_copy_without_equations_says_what_to_do() -> None:
    module = replace(sd.systems.pendulum().embedding(), again=None).compile("numpy")
    module.rhs(0.0, [0.1, 0.0])
    back = pickle.loads(pickle.dumps(module))
    assert (back.rhs(0.0, [0.1, 0.0]) == module.rhs(0.0, [0.1, 0.0])).all()
    with pytest.raises(SymdynError, match=r"a function of this copy of a module is needed that was not used .* call the"):
        back.jacobian(0.0, [0.1, 0.0])
