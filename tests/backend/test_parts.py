"""Long functions in parts, and products and sums in one step: the same numbers, in C that every compiler takes."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.backend import source
from symdyn.backend.dialect import Dialect
from symdyn.backend.divide import divide
from symdyn.pipeline import emit
from symdyn.runtime.building.compiler import find_compiler
from symdyn.tape import Recorder
from symdyn.tape.node import COORDINATE
from symdyn.tape.tape import Tape, unsigned

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


@pytest.fixture
def divided(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Sets how functions are divided; None: they stay whole."""
    read = source.read_dialect

    def set_parts(longest: int | None) -> None:
        def changed(folder: Any) -> Dialect:
            dialect = read(folder)
            parts = None if longest is None or dialect.parts is None else dataclasses.replace(
                dialect.parts, whole=longest, longest=longest)
            return dataclasses.replace(dialect, parts=parts)
        monkeypatch.setattr(source, "read_dialect", changed)
    return set_parts


def test_a_long_result_is_stored_by_several_parts(divided: Any) -> None:
    """No part stores more than parts are long; all entries are stored once, zeros included."""
    divided(20)
    equations = sd.systems.get("spatial_chain", n=6).recursive()
    function = emit(equations, "c", ("mass_matrix",), standalone=False).program.functions[0]
    stored = [[int(k) for line in part.results for k in re.findall(r"^out\[(\d+)\] =", line)] for part in function.parts]
    assert [k for part in stored for k in part] == list(range(6 * 6))
    assert max(map(len, stored)) <= 20
    assert [part.stores for part in function.parts] == [bool(part) for part in stored]


@pytest.mark.every_value
@needs_c
@pytest.mark.parametrize("longest", [20, 100])
@pytest.mark.parametrize(("name", "options"), [("spatial_chain", {"n": 4}), ("puma560", {}), ("n_link_pendulum", {"n": 6})])
def test_parts_give_the_same(name: str, options: dict, longest: int, divided: Any) -> None:
    equations = sd.systems.get(name, **options).recursive()
    x = np.linspace(0.1, 0.8, len(equations.symbols.coordinates) + len(equations.symbols.speeds))
    p = [0.7 + 0.01 * k for k in range(len(equations.symbols.parameters))]
    inputs = [0.3] * len(equations.symbols.inputs)
    divided(None)
    whole = equations.compile(backend="c").rhs(0.2, x, p, inputs)
    divided(longest)
    source_of = emit(equations, "c", ("rhs",), standalone=False)
    assert len(source_of.program.functions[0].parts) > 1
    parts = equations.compile(backend="c").rhs(0.2, x, p, inputs)
    # Where the parts end, a product and its sum may be two steps instead of one, and differ in the last bits.
    assert np.abs(parts - whole).max() <= 1e-12 * np.abs(whole).max()


@needs_c
def test_parameters_may_be_called_as_the_work_array_of_parts(divided: Any) -> None:
    divided(20)
    g, w = sd.parameters("g w")
    system = sd.System("chain", gravity=[0, 0, -g])
    body = system.ground
    for k, q in enumerate(sd.coordinates("q_0:6")):
        link = system.add_body(f"link{k}", mass=1 + w, inertia=[0.1, 0.2 * w, 0.3], com=[0.1 * w, 0, 0.3])
        system.add_joint(sd.Revolute(f"joint{k}", body, link, q, axis=np.eye(3)[k % 3].tolist(), parent_point=[0, 0.2, w]))
        body = link
    system.defaults = {g: 9.81, w: 0.5}
    equations = system.embedding()
    x = np.full(12, 0.1)
    assert len(emit(equations, "c", ("rhs",), standalone=False).program.functions[0].parts) > 1
    np.testing.assert_allclose(equations.compile(backend="c").rhs(0, x), equations.compile(backend="numpy").rhs(0, x), rtol=1e-10)


def test_stretches_hand_on_what_is_needed_and_no_more() -> None:
    """Run the stretches by themselves: every value is there when it is read, and nothing overwrites it before."""
    tape = sd.systems.get("spatial_chain", n=5).recursive().tape("rhs")
    entries = tape.outputs["rhs"].entries
    body = list(tape.running)
    stretches, slots, count = divide(tape.arrays, body, entries, 60)
    assert sorted(n.index for stretch, _ in stretches for n in stretch) == [n.index for n in body]
    assert all(len(stretch) <= 60 + 2 for stretch, _ in stretches) and count < len(slots)
    held: dict[int, Any] = {}
    for stretch, kept in stretches:
        own: set[Any] = set()
        for node in stretch:
            for core in map(unsigned, node.args):
                if core in slots and core not in own:
                    assert held[slots[core]] is core
                else:
                    assert core not in body or core in own
            own.add(node)
        held |= {slots[n]: n for n in kept}
    assert all(unsigned(e) in own or held[slots[unsigned(e)]] is unsigned(e) for e in entries if unsigned(e) in set(body))


@needs_c
def test_functions_are_divided_between_sections_where_parts_are_long_enough() -> None:
    recorder = Recorder()
    node, body = recorder.leaf("x", COORDINATE), []
    for name in ("first", "second"):
        with recorder.section(name):
            for _ in range(6):
                node = recorder.sin(node)
                body.append(node)
    stretches, _, _ = divide(Tape.of(recorder, y=[node]).arrays, body, [node], 8)
    assert [[each.section for each in stretch] for stretch, _ in stretches] == [["first"] * 6, ["second"] * 6]


def test_a_long_function_is_divided_where_the_dialect_says() -> None:
    equations = sd.systems.get("spatial_chain", n=24).recursive()
    made = emit(equations, "c", ("rhs",), standalone=False)
    function = made.program.functions[0]
    text = next(iter(made.files.values()))
    assert function.parts and f"rhs_part_{len(function.parts)}(" in text and f"double w[{function.n_w}];" in text
    assert emit(equations, "numpy", ("rhs",), standalone=False).program.functions[0].parts == ()
    x = np.linspace(0.1, 0.8, 48)
    ours, plain = (equations.compile(backend=b).rhs(0.0, x) for b in ("c", "numpy"))
    assert np.abs(ours - plain).max() <= 1e-9 * np.abs(plain).max()


def test_products_and_sums_in_one_step() -> None:
    text = next(iter(emit(sd.systems.get("double_pendulum").embedding(), "c", ("rhs",), standalone=False).files.values()))
    code = text.split("int double_pendulum_rhs(")[2].split("return 0;")[0]
    assert code.count("MADD(") > 5
    assert not re.search(r"[)\w]\*[(\w.]+ [+-] ", re.sub(r"MADD\([^;]*;", "", code)), "a product beside a sum, not fused"


def test_faults_of_parts_in_a_dialect(tmp_path: Any) -> None:
    from symdyn.backend.dialect import read_dialect
    from symdyn.errors import SymdynError

    shipped = source.template_folders()[-1] / "c" / "dialect.toml"
    text = shipped.read_text(encoding="utf-8")
    (tmp_path / "dialect.toml").write_text(text.replace("longest = 800", "length = 800"), encoding="utf-8")
    with pytest.raises(SymdynError, match=r"parts.longest is missing; parts.length is not known"):
        read_dialect(tmp_path)
