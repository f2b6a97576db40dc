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
    wrong = dataclasses.replace(rows[0], operations=rows[0].operations + 1,
                                others={"polynomial": None, "nested": rows[0].operations})
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
    assert lines[0].endswith("SymPy") and lines[1].endswith("4 simplify      SymPy's form is shorter")
    assert "simplify" not in lines[3]
    monkeypatch.setattr(kane_forms, "operations", lambda *_: None)
    assert printing.by_sympy("cart_pole", "M_tilde") == "-"


def test_what_is_too_large_has_a_row():
    row = printing.Row("spatial_chain", "k_tilde", None, {"polynomial": None, "fourier": 9}, 945, 0.1)
    assert row.longer and str(row).split() == ["spatial_chain", "k_tilde", "-", "-", "-", "9", "9", "fourier", "945", "-", "0.10"]
    row = dataclasses.replace(row, others={"polynomial": None, "fourier": None})
    assert not row.longer and not row.faults
    assert str(row).split() == ["spatial_chain", "k_tilde", "-", "-", "-", "-", "-", "945", "-", "0.10"]


@pytest.mark.parametrize(("changed", "fault"), [
    ({}, []), ({"operations": 144}, ["above 143"]), ({"operations": None}, ["another form is shorter", "above 143"])])
def test_operations_above_the_reference_count_as_missed(changed, fault):
    row = dataclasses.replace(printing.Row("three_link_arm", "k_tilde", 143, {"nested": 200}, None, 0.1), **changed)
    assert row.faults == fault and "143" in str(row).split()


@pytest.mark.parametrize(("named", "fault"), [
    (599, []), (600, ["with names not below 600"]), (None, ["with names not below 600"])])
def test_intermediates_stay_below_their_bound(named, fault):
    row = printing.Row("puma560", "M_tilde", 1998, {}, named, 0.1)
    assert row.faults == fault and str(row).split()[-3:-1] == ["-" if named is None else str(named), "600"]


def test_figures_of_the_references_are_of_the_catalogue():
    names = sd.systems.names()
    assert {name for name, _ in (*printing.FIRST_FORM, *printing.WITH_NAMES)} < set(names)
    assert all(quantity in printing.QUANTITIES for _, quantity in (*printing.FIRST_FORM, *printing.WITH_NAMES))
    assert {*printing.LONGER, *printing.NAMED_LIMIT} < set(names)


def test_slow_intermediates_count_as_missed(monkeypatch, capsys):
    monkeypatch.setitem(printing.NAMED_LIMIT, "pendulum", 0.5)
    rows = [dataclasses.replace(row, named_seconds=0.2) for row in printing.printed("pendulum")]
    monkeypatch.setattr(printing, "printed", lambda name: iter(rows))
    assert printing.run(["pendulum"]) == 1
    assert "0.60 s for M_tilde, k_tilde and F_tilde in named intermediates, above 0.5 s" in capsys.readouterr().out
