"""The catalogue as a list: names, lookup, laziness."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import symdyn as sd
from symdyn.model.system import System
from symdyn.systems import chains, pendulums

EXPECTED = {"pendulum", "double_pendulum", "n_link_pendulum", "cart_pole", "vehicle_on_track",
            "vehicle_on_rotating_track", "prismatic_chain", "spatial_chain", "two_link_arm", "three_link_arm", "puma560"}


def test_names_are_strings_without_repetition() -> None:
    names = sd.systems.names()
    assert set(names) >= EXPECTED
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("name", sd.systems.names())
def test_name_gives_a_complete_system(name: str) -> None:
    system = sd.systems.get(name)
    assert isinstance(system, System)
    assert getattr(sd.systems, name).__doc__
    model = system.check()
    assert set(model.defaults) == set(model.parameters)
    known = {*model.coordinates, *model.speeds, *model.inputs}
    assert set(model.initial) <= known
    assert model.duration > 0
    for symbol in (*known, *model.parameters):
        assert symbol in model.units


def test_get_passes_options_on() -> None:
    assert len(sd.systems.get("n_link_pendulum", n=3).bodies) == 3
    assert len(sd.systems.get("spatial_chain", n=2).bodies) == 2
    assert len(sd.systems.get("puma560", motors=True).bodies) == 12


def test_attribute_is_the_function() -> None:
    assert sd.systems.pendulum is pendulums.pendulum
    assert sd.systems.spatial_chain is chains.spatial_chain
    assert set(sd.systems.names()) <= set(dir(sd.systems))


def test_unknown_name_offers_the_nearest() -> None:
    with pytest.raises(sd.SymdynError, match="did you mean pendulum") as caught:
        sd.systems.get("pendulm")
    for name in sd.systems.names():
        assert name in str(caught.value)
    with pytest.raises(sd.SymdynError, match="; it has pendulum"):
        sd.systems.get("zzz")
    with pytest.raises(AttributeError, match="pendulum"):
        sd.systems.pendulm  # noqa: B018


@pytest.mark.parametrize(("name", "options"), [("n_link_pendulum", {"n": 0}), ("spatial_chain", {"n": 0}),
                                               ("prismatic_chain", {"n": -1}), ("puma560", {"convention": "craig"})])
def test_impossible_options_are_rejected(name: str, options: dict) -> None:
    with pytest.raises(sd.ModelError, match=name):
        sd.systems.get(name, **options)


def test_listing_imports_no_sympy() -> None:
    root = Path(sd.__file__).parents[1]
    code = ("import sys, symdyn as sd\n"
            "names = sd.systems.names()\n"
            "assert 'pendulum' in names\n"
            "loaded = [m for m in ('sympy', 'numpy', 'scipy', 'symdyn.systems.pendulums') if m in sys.modules]\n"
            "assert not loaded, loaded\n")
    run = subprocess.run([sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": str(root)}, capture_output=True,
                         text=True, check=False)
    assert run.returncode == 0, run.stderr
