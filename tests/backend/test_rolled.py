"""Repeated statements of like bodies, as loops: the bits of straight-line code, the numbers of many digits, and code that does
not grow."""

from __future__ import annotations

import ctypes
import re
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.backend import source as rendering
from symdyn.backend.dialect import Dialect
from symdyn.backend.function import Function
from symdyn.backend.like_parts import Loop, find_loops
from symdyn.backend.program import LEAST_SAVED, LEAST_SECONDS, STATEMENT_SECONDS, Program, build
from symdyn.backend.right_side import RightSide
from symdyn.backend.source import Source, render
from symdyn.errors import EvaluationError, SymdynError
from symdyn.formulation.equations import Equations
from symdyn.functions.content import content_of
from symdyn.lab.rolled import cable, legs
from symdyn.pipeline import emit, write_source
from symdyn.runtime.building.compiler import find_compiler
from tests.backend.c_warnings import LANGUAGE, faults_of
from tests.helpers import swept

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


def shuffled(n: int) -> sd.System:
    """Rods one on the other whose drives come in another order than the rods."""
    g, mass, length = sd.parameters("g m l")
    system = sd.System(f"shuffled_{n}", gravity=[0, -g])
    q, drives = sd.coordinates(f"q1:{n + 1}"), sd.inputs(f"F1:{n + 1}")
    parent = system.ground
    for k in range(n):
        rod = system.add_body(f"rod{k + 1}", mass=mass, inertia=mass * length**2 / 12, com=[length / 2, 0])
        system.add_joint(sd.Revolute(f"hinge{k + 1}", parent, rod, q[k], parent_point=[length if k else 0, 0]))
        parent = rod
    for k in np.random.default_rng(5).permutation(n):
        system.add_joint_force(f"hinge{k + 1}", drives[k])
    system.defaults = {g: 9.81, mass: 1.0, length: 0.7}
    return system


def uneven(n: int) -> sd.System:
    """A cable whose links in the middle differ: by the symbol of a mass, a number in its place, a joint, and a missing load."""
    g, m, other, length, stiffness, inertia = sd.parameters("g m m_other l k I")
    system = sd.System(f"uneven_{n}", gravity=[0, 0, -g])
    parent = system.ground
    for i, angles in enumerate(zip(sd.coordinates(f"a1:{n + 1}"), sd.coordinates(f"b1:{n + 1}"), strict=True)):
        mass = {n // 2: other, n // 2 + 1: sp.Rational(1, 7)}.get(i, m)
        link = system.add_body(f"link{i + 1}", mass=mass, inertia=[inertia / 100, inertia, inertia], com=[length / 2, 0, 0])
        at = [length if i else 0, 0, 0]
        if i == n // 2 + 2:
            hinge = sd.Revolute(f"joint{i + 1}", parent, link, angles[0], axis=[0, 1, 0], parent_point=at)
            system.add_joint_force(system.add_joint(hinge), [-stiffness * angles[0]])
        else:
            joint = system.add_joint(sd.Universal(f"joint{i + 1}", parent, link, angles, axes=([0, 1, 0], [0, 0, 1]),
                                                  parent_point=at))
            if i != n // 2 + 3:
                system.add_joint_force(joint, [-stiffness * angle for angle in angles])
        parent = link
    system.defaults = {g: 9.81, m: 0.1, other: 0.3, length: 0.1, stiffness: 1.0, inertia: 1e-4}
    return system


MADE: dict[str, Callable[[], Equations]] = {
    "pendulum": lambda: sd.systems.get("n_link_pendulum", n=14).recursive(),
    "chain": lambda: sd.systems.get("spatial_chain", n=20).recursive(),
    "cable": lambda: cable(12).recursive(),
    "legs": lambda: legs(6).recursive(),
    "shuffled": lambda: shuffled(16).recursive(),
    "uneven": lambda: uneven(16).recursive(),
}


def rolled_and_straight(equations: Equations, monkeypatch: pytest.MonkeyPatch, bound: dict[str, float] | None = None,
                        name: str = "rhs") -> tuple[Source, Source]:
    """A function with loops, and the same steps one after the other in one function, with the same products in sums."""
    content = content_of(equations, (name,), False, bound or {}, RightSide())
    rolled = render(content, "c", standalone=False, right_side=RightSide(integrated=False), rolled=True)
    read = rendering.read_dialect

    def whole(folder: Path) -> Dialect:
        return replace(read(folder), parts=None)

    def like(*args: Any, **given: Any) -> Program:
        return build(*args, **given, like=rolled.program)

    with monkeypatch.context() as patched:
        patched.setattr(rendering, "read_dialect", whole)
        patched.setattr(rendering, "build", like)
        return rolled, render(content, "c", standalone=False, right_side=RightSide(integrated=False), rolled=False)


def numbers(source: Source, folder: Path, states: int = 20, name: str = "rhs") -> np.ndarray:
    """Constants and results of a function at random states and parameters, of code that is compiled quickly."""
    compiler = find_compiler()
    assert compiler is not None
    about, size = source.metadata, source.program.functions[0].size
    folder.mkdir()
    (folder / "code.c").write_text(next(iter(source.files.values())))
    subprocess.run([*compiler.command, *LANGUAGE, "-O0", "-fPIC", "-shared", "-o", folder / "code.so", folder / "code.c", "-lm"],
                   check=True)
    library = ctypes.CDLL(str(folder / "code.so"))
    random = np.random.default_rng(7)
    results = []
    for _ in range(states):
        given = {group: random.normal(size=max(1, len(getattr(about, group)))) for group in ("q", "u", "z", "inputs")}
        given["p"] = np.array([0.5 if d is None else d for d in about.defaults]) * random.uniform(0.9, 1.1, len(about.defaults))
        given["c"], out = np.zeros(max(1, source.program.n_c)), np.full(size, np.nan)
        at = {name: array.ctypes.data_as(ctypes.c_void_p) for name, array in {**given, "out": out}.items()}
        assert library[f"{about.name}_prologue"](at["p"], at["c"]) == 0
        arguments = [ctypes.c_double(0.4) if g == "t" else at[g] for g in about.arguments[name]]
        assert library[f"{about.name}_{name}"](*arguments, at["out"]) == 0
        results.append(np.concatenate([given["c"], out]))
    return np.array(results)


@needs_c
@pytest.mark.parametrize("name", swept(MADE, "cable", "shuffled", "uneven"))
def test_loops_give_the_bits_of_straight_line_code(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    rolled, straight = rolled_and_straight(MADE[name](), monkeypatch)
    function = rolled.program.functions[0]
    assert function.loops and function.written < 0.8 * function.steps
    assert not straight.program.functions[0].parts
    found, wanted = numbers(rolled, tmp_path / "rolled"), numbers(straight, tmp_path / "straight")
    assert np.isfinite(found).all() and np.array_equal(found, wanted)


@needs_c
@pytest.mark.parametrize("name", ["position_correction", *swept(["velocity_correction"])])
def test_the_last_trip_reads_what_it_has_computed_itself(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    rolled, straight = rolled_and_straight(sd.systems.get("n_four_bar", n=12).augmented(), monkeypatch, name=name)
    assert "what like bodies repeat" in next(iter(rolled.files.values()))
    found = numbers(rolled, tmp_path / "rolled", name=name)
    assert np.isfinite(found).all() and np.array_equal(found, numbers(straight, tmp_path / "straight", name=name))


@needs_c
def test_numbers_that_differ_from_trip_to_trip_stand_in_a_table(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    equations = sd.systems.get("n_link_pendulum", n=14).recursive()
    bound = {f"l{k + 1}": 1.0 + 0.1 * k * k for k in range(13)}
    rolled, straight = rolled_and_straight(equations, monkeypatch, bound)
    text = next(iter(rolled.files.values()))
    assert re.search(r"static const double table\d+\[\] = \{ [\d.]+, [\d.]+", text)
    assert np.array_equal(numbers(rolled, tmp_path / "rolled"), numbers(straight, tmp_path / "straight"))


def test_places_that_do_not_grow_evenly_stand_in_a_table() -> None:
    text = next(iter(emit(MADE["shuffled"](), "c", ("rhs",), standalone=False, rolled=True).files.values()))
    assert re.search(r"static const int table\d+\[\] = \{ \d+, \d+", text)


@needs_c
@pytest.mark.parametrize("name", [*swept(["pendulum"]), "cable"])
def test_files_that_stand_alone_agree_with_numbers_of_many_digits(name: str, tmp_path: Path) -> None:
    """The example of a file compares every function with reference vectors; compilers have nothing to warn of."""
    compiler = find_compiler()
    assert compiler is not None
    source = emit(MADE[name](), "c", ("rhs",), rolled=True)
    assert source.program.functions[0].loops
    write_source(source, tmp_path)
    file = next(tmp_path.glob(f"{source.metadata.name}.c"))
    assert faults_of(file, tidy=False) == ""
    subprocess.run([*compiler.command, "-std=c99", "-O1", "-o", tmp_path / "check", tmp_path / "main.c", file, "-lm"], check=True)
    done = subprocess.run([tmp_path / "check"], capture_output=True, text=True)
    assert done.returncode == 0 and "all results agree" in done.stdout, done.stdout


def code_of(name: str, n: int) -> tuple[Function, list[str]]:
    """The right-hand side of so many bodies, and the lines of its parts."""
    equations = cable(n).recursive() if name == "cable" else sd.systems.get(name, n=n).recursive()
    source = emit(equations, "c", ("rhs",), standalone=False, integrator=False)
    text = next(iter(source.files.values()))
    return source.program.functions[0], [line for line in text.splitlines() if line.startswith("    ") and line.endswith(";")]


@pytest.mark.parametrize(("name", "n"), [("n_link_pendulum", 30), ("cable", 20), *swept([
    ("n_link_pendulum", 60), ("spatial_chain", 60), ("cable", 60)])])
def test_code_does_not_grow_with_the_number_of_bodies(name: str, n: int) -> None:
    some, some_lines = code_of(name, n)
    more, more_lines = code_of(name, 2 * n)
    assert more.steps > 1.9 * some.steps and more.count > 1.9 * some.count
    assert more.written < 1.3 * some.written and len(more_lines) < 1.3 * len(some_lines)


def test_short_functions_stay_straight_line() -> None:
    """Where nobody asks, functions roll if that saves many statements."""
    small, large = (sd.systems.get("n_link_pendulum", n=n).recursive() for n in (8, 40))
    texts = {rolled: next(iter(emit(small, "c", ("rhs",), standalone=False, rolled=rolled).files.values()))
             for rolled in (False, True, "auto")}
    assert texts["auto"] == texts[False] != texts[True]
    function = emit(large, "c", ("rhs",), standalone=False).program.functions[0]
    assert function.loops and function.steps - function.written >= LEAST_SAVED
    assert not emit(large, "c", ("rhs",), standalone=False, rolled=False).program.functions[0].loops
    assert not emit(large, "numpy", ("rhs",), standalone=False).program.functions[0].loops


def test_templates_of_the_user_get_loops_where_asked_only(tmp_path: Path) -> None:
    """Their layout of functions may be an older one."""
    equations = sd.systems.get("n_link_pendulum", n=40).recursive()
    for rolled, loops in (("auto", False), (True, True)):
        function = emit(equations, "c", ("rhs",), tmp_path, standalone=False, rolled=rolled).program.functions[0]
        assert bool(function.loops) is loops


def test_what_cannot_be_asked() -> None:
    equations = sd.systems.pendulum().embedding()
    with pytest.raises(SymdynError, match=r"rolled=True was asked for, and the backend numpy writes no loops; take 'c'"):
        equations.compile(backend="numpy", rolled=True)
    with pytest.raises(SymdynError, match=r"rolled is 'yes'; pass True, False or 'auto'"):
        equations.compile(backend="numpy", rolled="yes")  # type: ignore[arg-type]
    with pytest.raises(SymdynError, match="rolled is 1; pass"):
        sd.systems.pendulum().compile(backend="numpy", rolled=1)


def test_nothing_repeats() -> None:
    equations = sd.systems.get("puma560").recursive()
    assert (emit(equations, "c", ("rhs",), standalone=False, rolled=True).files
            == emit(equations, "c", ("rhs",), standalone=False, rolled=False).files)


@needs_c
def test_the_report_names_loops() -> None:
    equations = sd.systems.get("n_link_pendulum", n=14).recursive()
    rows = equations.compile(backend="c", rolled=True).report().rolled
    made = emit(equations, "c", ("rhs",), standalone=False, integrator=False, rolled=True).program
    assert [(r.function, r.loops, r.trips) for r in rows] == [
        (f.name, len(f.loops), sum(f.loops)) for f in (made.prologue, made.functions[0])]
    assert f"rhs: {rows[1].loops} loops of {rows[1].trips} trips in all; {rows[1].written} statements are written" in str(
        equations.compile(backend="c", rolled=True).report())
    assert rows[1].seconds_saved == (rows[1].statements - rows[1].written) * STATEMENT_SECONDS < LEAST_SECONDS
    assert not equations.compile(backend="c").report().rolled


@needs_c
def test_a_fault_in_a_trip_has_the_reason_of_its_body() -> None:
    equations = sd.systems.get("n_link_pendulum", n=14).recursive()
    x = np.linspace(0.1, 0.9, 28)
    modules = [equations.compile(backend="c", rolled=rolled) for rolled in (True, False)]
    for faulty in range(1, 15):
        messages = []
        for module in modules:
            with pytest.raises(EvaluationError) as raised:
                module.rhs(0.0, x, {f"I{faulty}": -1000.0})
            messages.append(str(raised.value))
        assert messages[0] == messages[1]
        assert f"q{faulty}_dot" in messages[0] or f"rod{faulty}" in messages[0]


@needs_c
@pytest.mark.parametrize("name", [*swept(["pendulum"]), "cable"])
def test_lanes_have_loops_and_the_bits_of_one_motion(name: str) -> None:
    equations = MADE[name]()
    module = equations.compile(backend="c", rolled=True)
    n_q = len(module.metadata.q)
    starts = np.random.default_rng(3).normal(size=(11, 2 * n_q)) / 5
    many = module.simulate_batch(starts[:, :n_q], starts[:, n_q:], t=(0.0, 0.1))
    for x, end in zip(starts, many.x, strict=True):
        one = module.simulate(q=x[:n_q], u=x[n_q:], t=(0.0, 0.1))
        assert np.array_equal(one.x[-1], end.reshape(-1, 2 * n_q)[-1])
    lanes = emit(equations, "c", ("rhs",), standalone=False, batch=True, rolled=True).files
    vectors = next(iter(lanes.values())).split("Many states at once")[-1]
    assert re.search(r"for \(int i = 0; i < \d+; i\+\+\) \{\n(?:        .*\n)*        const symdyn_vector ", vectors)


# -- where steps repeat


def test_loops_among_kinds_of_steps() -> None:
    block = list(range(20, 40))
    kinds = np.array([1, 2, 3, *block * 6, 4, 5, *[7] * 50, 8])
    assert find_loops(kinds, []) == [Loop(3, 20, 6), Loop(125, 1, 50)]
    # Where a heading begins, a stretch begins, at the cost of one trip.
    assert find_loops(kinds, [10, 30, 50]) == [Loop(10, 20, 5), Loop(125, 1, 50)]


def test_two_stretches_alike_are_no_loop() -> None:
    assert find_loops(np.array(list(range(100)) * 2), []) == []
    assert find_loops(np.arange(300), []) == []
    assert find_loops(np.array([], dtype=np.int64), []) == []
