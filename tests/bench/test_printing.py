"""The measurement of printing: exact counts, and the bound that no other form is shorter."""

import dataclasses

import pytest
import sympy as sp

import symdyn as sd
from symdyn.cli import main
from symdyn.errors import SymdynError
from symdyn.lab import kane_forms, printing


def test_table(capsys):
    assert main(["bench", "printing", "--systems", "cart_pole", "skate"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == printing.HEADING
    assert [line.split()[:2] for line in lines[1:4]] == [["cart_pole", q] for q in ("M_tilde", "k_tilde", "F_tilde")]
    assert "C_r" in "".join(lines[4:]) and "another form is shorter" not in "".join(lines)


def test_a_longer_form_counts_as_missed(monkeypatch, capsys):
    rows = list(printing.printed("pendulum"))
    assert not any(row.longer for row in rows)
    wrong = dataclasses.replace(rows[0], operations=rows[0].operations + 1, others=(None, rows[0].operations))
    monkeypatch.setattr(printing, "printed", lambda name: iter([wrong, dataclasses.replace(rows[1], seconds=0.6)]))
    assert printing.run(["pendulum"]) == 2
    assert "another form is shorter" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["cart_pole", "three_link_arm"])
def test_kane_s_method_gives_the_same_equations(name):
    eq = sd.systems.get(name).embedding()
    s = eq.symbols
    letters = {sp.Symbol(f"{letter}_{k}"): symbol for letter, symbols in (("q", s.coordinates), ("u", s.speeds))
               for k, symbol in enumerate(symbols)}
    for quantity, value in kane_forms.by_kane(eq).items():
        assert sd.prove(value.xreplace(letters), eq.explicit(quantity))


def test_kane_s_method_is_not_set_up_for_all(capsys):
    with pytest.raises(SymdynError, match="KanesMethod is set up for rigid bodies whose speeds are the rates of the coordinates"):
        kane_forms.by_kane(sd.systems.get("floating_wind_turbine").embedding())


def test_against_sympy_in_a_process_of_its_own():
    assert kane_forms.operations("cart_pole", "k_tilde", "fu") == 5
    assert kane_forms.operations("cart_pole", "k_tilde", "fu", limit=0.1 - kane_forms.START) is None


def test_a_shorter_form_of_sympy_counts_as_missed(monkeypatch, capsys):
    counts = {"trigsimp": None, "simplify": 4, "fu": 6}
    monkeypatch.setattr(kane_forms, "operations", lambda name, quantity, method: counts[method])
    assert printing.run(["cart_pole"], "sympy") == 2
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].endswith("SymPy") and lines[1].endswith("4 simplify      another form is shorter")
    assert "simplify" not in lines[3]
    monkeypatch.setattr(kane_forms, "operations", lambda *_: None)
    assert printing.by_sympy("cart_pole", "M_tilde") == "-"


def test_what_is_too_large_has_a_row():
    row = printing.Row("spatial_chain", "k_tilde", None, (None, 9), 945, 0.1)
    assert row.longer and str(row).split() == ["spatial_chain", "k_tilde", "-", "-", "9", "945", "0.10"]
    assert not dataclasses.replace(row, others=(None, None)).longer
