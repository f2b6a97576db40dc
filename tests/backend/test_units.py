"""Translation units of what is only loaded: each compiles by itself, all of them as one file; what is shared is the same text."""

from __future__ import annotations

import functools
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import symdyn as sd
from symdyn.backend import units
from symdyn.backend.units import LEAST_LINES
from symdyn.pipeline import emit
from symdyn.runtime.building import objects
from symdyn.runtime.building.compiler import find_compiler, require_compiler
from symdyn.runtime.building.library import CLibrary
from symdyn.translation_units import TranslationUnit, joined, translation_units
from tests.runtime.test_events import ball

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
STRICT = ("-std=c99", "-O1", "-Wall", "-Wextra", "-Wno-unused-function", "-Wno-unused-const-variable", "-Werror")


def text_of(equations: Any, method: str = "dop853") -> str:
    names = [n for n in ("rhs", "position_correction", "velocity_correction", "length", "events", "event_resets")
             if n == "rhs" or n in equations.quantities]
    return next(iter(emit(equations, "c", names, standalone=False, method=method).files.values()))


@functools.cache
def check_compiles(text: str, *options: str) -> None:
    """Compile a text strictly; what several mechanisms or methods share, once."""
    with tempfile.TemporaryDirectory() as made:
        file = Path(made, "unit.c")
        file.write_text(text)
        done = subprocess.run([*require_compiler().command, *STRICT, *options, "-fPIC", "-c", "-o", file.with_suffix(".o"), file],
                              capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_long_texts_take_a_lower_level(monkeypatch: pytest.MonkeyPatch) -> None:
    """All units of the model but the first one; those that mechanisms share keep theirs."""
    equations = sd.systems.get("double_wishbone").augmented()
    monkeypatch.setattr(units, "LEAST_LINES", 50)
    usual = translation_units(text_of(equations))
    monkeypatch.setattr(units, "LONG_LINES", 100)
    found = translation_units(text_of(equations))
    assert [unit.text for unit in found] == [unit.text for unit in usual]
    own = [unit.level for unit in found[1:] if not unit.shared]
    assert len(own) > 1 and set(own) == {"-O1"} and {unit.level for unit in usual if not unit.shared} == {""}
    assert [unit.level for unit in found if unit.shared] == [unit.level for unit in usual if unit.shared]


def test_control_of_steps_takes_the_level_at_which_runs_are_as_fast(derived: Callable[..., Any]) -> None:
    """The last shared unit: with twelve stages, with seven, with events, and of a method without stages."""
    for equations, method, wanted in ((derived("double_pendulum"), "dop853", ["", "-O1"]),
                                      (derived("double_pendulum"), "bs54", ["", "-O2"]),
                                      (ball().embedding(), "dop853", ["", "-O2"]), (derived("double_pendulum"), "radau5", [""])):
        assert [unit.level for unit in translation_units(text_of(equations, method)) if unit.shared] == wanted


@needs_c
def test_units_that_take_longest_are_compiled_first(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if require_compiler().kind not in ("gcc", "clang"):
        pytest.skip("units are for gcc and clang")
    seen = compilations(monkeypatch)
    texts = [TranslationUnit(f"int f{k}(void) {{ return {'1 +' * n} 1; }}\n", True, level)
             for k, (n, level) in enumerate([(100, ""), (190, "-O1"), (150, "-O2"), (50, "")])]
    assert objects.built_from_units(joined(texts), cache / "made.so", require_compiler(), cache)
    assert [Path(command[command.index("-c") - 1]).stem for command in seen] == ["unit_2", "unit_0", "unit_1", "unit_3"]


def test_units_of_a_text() -> None:
    several = [TranslationUnit("a\n"), TranslationUnit("b\n", True), TranslationUnit("c\n", True, "-O2"), TranslationUnit("d\n")]
    assert translation_units(joined(several)) == several
    assert translation_units("one\n") == [TranslationUnit("one\n")]


@pytest.mark.every_value
@needs_c
@pytest.mark.parametrize("method", ["dop853", "bs54", "radau5", "gauss"])
@pytest.mark.parametrize("system", ["pendulum", "four_bar", "ball", "double_wishbone"])
def test_each_unit_compiles_and_so_do_all_in_one_file(system: str, method: str) -> None:
    equations = ball().embedding() if system == "ball" else sd.systems.get(system).augmented() if system != "pendulum" else \
        sd.systems.get(system).embedding()
    text = text_of(equations, method)
    units = translation_units(text)
    assert len(units) >= (3 if method in ("dop853", "bs54") else 2)
    for unit in units:
        check_compiles(unit.text)
    check_compiles(text, "-fsyntax-only")


def test_long_models_have_several_units() -> None:
    short, long = (translation_units(text_of(sd.systems.get(n).augmented())) for n in ("four_bar", "double_wishbone"))
    own = [unit for unit in long if not unit.shared]
    assert sum(not unit.shared for unit in short) == 1 < len(own)
    assert all(unit.text.count("\n") < 4 * LEAST_LINES for unit in own)


def test_what_is_shared_has_no_name_of_the_mechanism(derived: Callable[..., Any]) -> None:
    first, second = ([unit.text for unit in translation_units(text_of(equations)) if unit.shared]
                     for equations in (derived("double_pendulum"), sd.systems.get("n_link_pendulum", n=2).embedding()))
    assert first == second and first
    assert not any("double_pendulum" in text for text in first)


def test_series_stay_in_one_unit(derived: Callable[..., Any]) -> None:
    assert len(translation_units(text_of(derived("double_pendulum"), "taylor"))) == 1


# -- objects in the cache


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SYMDYN_CACHE_DIR", str(tmp_path))
    return tmp_path


def compilations(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    seen: list[list[str]] = []
    original = objects._started
    monkeypatch.setattr(objects, "_started", lambda command, *rest: (seen.append(command), original(command, *rest))[1])
    return seen


@needs_c
def test_shared_units_are_compiled_once(cache: Path, derived: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    if require_compiler().kind not in ("gcc", "clang"):
        pytest.skip("units are for gcc and clang")
    seen = compilations(monkeypatch)
    module = derived("double_pendulum").compile(backend="c")
    a = module.simulate((0, 1), rtol=1e-9)
    first = len(seen)
    other = sd.systems.get("n_link_pendulum", n=2).embedding().compile(backend="c")
    other.simulate((0, 1))
    assert first == 3 and len(seen) == 4
    for kept in cache.glob("unit-*.o"):
        kept.write_bytes(b"damaged")
    for library in cache.glob("double_pendulum-*"):
        library.unlink()
    again = derived("double_pendulum").compile(backend="c").simulate((0, 1), rtol=1e-9)
    assert len(seen) == 7 and (again.x == a.x).all()


@needs_c
def test_units_and_one_file_give_the_same_bits(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(units, "LEAST_LINES", 50)
    equations = sd.systems.get("four_bar").augmented()
    assert sum(not unit.shared for unit in translation_units(text_of(equations))) > 1
    apart = equations.compile(backend="c").simulate((0, 0.05))
    monkeypatch.setattr(objects, "_WITH_OBJECTS", ())
    for library in cache.iterdir():
        if library.is_file():
            library.unlink()
    whole = equations.compile(backend="c").simulate((0, 0.05))
    assert (whole.x == apart.x).all()


@needs_c
def test_a_unit_that_does_not_compile_is_reported_as_one_file(cache: Path, derived: Callable[..., Any]) -> None:
    source = emit(derived("double_pendulum"), "c", ("rhs",), standalone=False)
    text = next(iter(source.files.values())).replace("symdyn_propose(run);", "symdyn_propose(walk);")
    with pytest.raises(sd.CompileError, match=r"(?s)Source kept at: .*double_pendulum-\w+\.c.*walk"):
        CLibrary(text, source.metadata, require_compiler())
    assert not list(cache.glob("unit-*.o"))
