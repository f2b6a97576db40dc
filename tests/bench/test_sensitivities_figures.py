"""Figures of sensitivities where the programs that they are compared with are not installed."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from symdyn.errors import MissingExtra
from symdyn.lab import sensitivities
from symdyn.lab.casadi_field import casadi_field


def test_programs_that_are_missing(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def other() -> Iterator[tuple[str, float, str, str]]:
        yield "something", 1.0, "", "< 2"

    monkeypatch.setattr(sensitivities, "_missing", lambda: ["jax", "diffrax"])
    monkeypatch.setattr(sensitivities, "GROUPS", (other, sensitivities.diffrax))
    assert sensitivities.run() == 0
    printed = capsys.readouterr().out
    assert "something" in printed and "diffrax: not measured, jax and diffrax not installed; run: pip install jax" in printed
    with pytest.raises(MissingExtra, match="the Python package jax is not installed; run: pip install jax diffrax"):
        sensitivities.run(["diffrax"])


def test_a_field_in_the_words_of_another_program() -> None:
    """The statements that CVODES and diffrax get, in NumPy, of three states at once: they are those of the right-hand side."""
    from types import SimpleNamespace

    import numpy as np

    import symdyn as sd

    equations = sd.systems.two_link_arm().equations()
    module = equations.compile(backend="numpy")
    x = np.array([[0.3, -0.4, 0.5, 0.6], [-2.0, 1.0, 0.0, 3.0], [0.0, 0.0, 0.0, 0.0]])
    words = SimpleNamespace(sin=np.sin, cos=np.cos, vertcat=lambda *entries: np.array(entries))
    names = [*module.metadata.x, *module.metadata.parameters, *module.metadata.inputs]
    values = [*x.T, *module.default_parameters, *[0.0] * len(module.metadata.inputs)]
    found = casadi_field(words, equations, dict(zip(names, values, strict=True)))
    np.testing.assert_allclose(found.T, module.rhs(0.0, x), rtol=1e-14, atol=1e-15)
