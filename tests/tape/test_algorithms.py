"""Numeric algorithms in C and in Python: the same bits, and the same inputs rejected, for thousands of inputs of each."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import pytest

from symdyn.backend.right_side import RightSide
from symdyn.backend.source import Content, render
from symdyn.model.elements.catenary import Catenary
from symdyn.model.elements.cube import Cube
from symdyn.tape import Recorder, Tape
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.intrinsics import LOOSE, SMOOTHED, Intrinsic, Multipliers, Saddle
from symdyn.tape.node import INPUT
from tests.c_rows import needs_c, rows_in_c
from tests.helpers import swept

INPUTS = 10_000
SIZES = ((1, 1), (2, 1), (3, 2), (4, 4), (6, 3), (9, 12))
EACH = 500


# -- inputs


def constraints(rng: np.random.Generator, n: int, m: int, kind: int) -> np.ndarray:
    """Rows, by kind: of full rank, one that depends on others, all but so, one that is zero, zero columns."""
    C = rng.normal(size=(m, n))
    last = rng.choice([-1.0, 0.5, 2.0], m - 1) @ C[:-1]
    if kind == 1:
        C[-1] = last
    elif kind == 2:
        C[-1] = last + 10.0 ** rng.uniform(-16, -2) * C[-1]
    elif kind == 3:
        C[-1] = 0
    elif kind == 4:
        C[:, : 1 + n // 3] = 0
    return C


def masses(rng: np.random.Generator, n: int, kind: int) -> np.ndarray:
    """Symmetric, by kind: regular, far apart, some without mass, singular, next to singular, not positive, zero."""
    L = rng.normal(size=(n, n))
    if kind == 1:
        L *= 10.0 ** rng.uniform(-8, 8, n)[:, None]
    elif kind == 2:
        L[: 1 + n // 2] = 0
    elif kind == 3:
        L = L @ np.diag(np.arange(n) > 0)
    elif kind == 4:
        L[-1] = L[0] * (1 + 10.0 ** rng.uniform(-16, -6))
    M = L @ L.T
    return M - 2 * np.diag(np.diag(M)) if kind == 5 else M * (kind != 6)


def saddle_points(n: int, m: int) -> np.ndarray:
    rng, rows = np.random.default_rng(n), []
    for k in range(EACH):
        w = 10.0 ** rng.uniform(-3, 3, n)
        M, C = masses(rng, n, k % 7) / w[:, None] / w, constraints(rng, n, m, k // 7 % 5) / w
        rows.append(np.concatenate([[rng.choice([SMOOTHED, 1e-3])], M[np.tril_indices(n)], C.ravel(), rng.uniform(0.1, 3, m), w,
                                    rng.normal(size=n + m) * 10.0 ** rng.uniform(-5, 5)]))
    return broken(rng, np.array(rows))


def chains(n: int, m: int) -> np.ndarray:
    """Rows k of C with entries k to k + 2, masses coupled with the next one: everything far from the diagonal is zero."""
    rng, rows = np.random.default_rng(n), []
    near = np.arange(n) - np.arange(m)[:, None]
    for k in range(EACH):
        w = 10.0 ** rng.uniform(-3, 3, n)
        L = np.triu(np.tril(masses(rng, n, k % 5)), -1)
        C = constraints(rng, n, m, 0) * ((near >= 0) & (near <= 2)) * (rng.random((m, n)) < 0.9) / w
        M = L @ L.T / w[:, None] / w
        rows.append(np.concatenate([[SMOOTHED], M[np.tril_indices(n)], C.ravel(), rng.uniform(0.1, 3, m), w,
                                    rng.normal(size=n + m)]))
    return broken(rng, np.array(rows))


def forces(n: int, m: int) -> np.ndarray:
    rng, rows = np.random.default_rng(n), []
    for k in range(EACH):
        w = 10.0 ** rng.uniform(-3, 3, n)
        C = constraints(rng, n, m, k % 5) / w
        rows.append(np.concatenate([C.ravel(), rng.uniform(0.1, 3, m), w, rng.normal(size=n)]))
    return broken(rng, np.array(rows))


def cuts(order: int, n: int = INPUTS // 3 + 1) -> np.ndarray:
    """Cuts of cubes in any attitude, dry and sunk, along faces and edges, and without an attitude; (n, 4)."""
    rng = np.random.default_rng(order)
    e = rng.normal(size=(n, 4)) * 10.0 ** rng.uniform(-3, 1, (n, 4))
    e[:, 0] = rng.uniform(-0.7, 0.7, n) * np.abs(e[:, 1:]).sum(axis=1)
    e[::4, 1:] = rng.choice([0.0, 1.0, -2.0, 1e-17, -1e-9, 1e-200], e[::4, 1:].shape)
    e[::4, 0] = (rng.choice([-0.5, 0.0, 0.5], e[::4, 1:].shape) * e[::4, 1:]).sum(axis=1)
    return broken(rng, e)


def lines(seabed: int, n: int = INPUTS // 2) -> np.ndarray:
    """Taut, slack, stiff and soft, with friction and without, and ends that no line has; (n, 4)."""
    rng = np.random.default_rng(seabed)
    x, z = rng.uniform(0, 1.2, n), rng.uniform(0, 1, n) * 10.0 ** rng.uniform(-3, 0, n)
    x[::10], z[1::20] = 10.0 ** rng.uniform(-12, -6, len(x[::10])), -z[1::20]
    e, friction = 10.0 ** rng.uniform(-9, 0, n), 10.0 ** rng.uniform(-6, 1, n)
    e[::3], friction[::2], e[5::50], friction[7::70] = 0, 0, -1, -1
    return broken(rng, np.column_stack([x, z, e, friction]))


def broken(rng: np.random.Generator, rows: np.ndarray) -> np.ndarray:
    """The rows, a few of them with what is no number or none at all."""
    some = rng.choice(len(rows), len(rows) // 50, replace=False)
    rows[some, rng.integers(0, rows.shape[1], len(some))] = rng.choice([np.nan, np.inf, -np.inf, 0.0, 1e200], len(some))
    return rows


# -- both texts


Compiled = Callable[[Intrinsic, np.ndarray], tuple[np.ndarray, np.ndarray]]


@pytest.fixture(scope="module")
def in_c(tmp_path_factory: pytest.TempPathFactory) -> Compiled:
    """intrinsic, rows of values (n, n_in) -> results (n, n_out), and where there are none."""
    def run(intrinsic: Intrinsic, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        folder = tmp_path_factory.mktemp("c")
        numbers = {"LOOSE": LOOSE, "MASSLESS": 1e-12, "ROUNDS": 5, "CLEANINGS": 2, "SMOOTHED": SMOOTHED}
        sizes = intrinsic.sizes if len(intrinsic.sizes) == 2 else (1, 1)
        for name in ("SADDLE", "MULTIPLIERS"):
            numbers |= {f"{name}_N": sizes[0], f"{name}_M": sizes[1], f"{name}_ONE_SIZE": 0}
        head = "".join(f"#define SYMDYN_{name} {value!r}\n" for name, value in numbers.items())
        given = "".join(f"{size}, " for size in intrinsic.sizes)
        text = f'{head}#define SYMDYN_LINKED static\n#include "{intrinsic.name}.h"'
        return rows_in_c(folder, text, f"{intrinsic.name}({given}", values.shape[1], intrinsic.n_out)(values)

    return run


KERNELS: dict[str, tuple[Intrinsic, Callable[[], np.ndarray]]] = {
    **{f"saddle {n} {m}": (Saddle((n, m), ""), lambda n=n, m=m: saddle_points(n, m)) for n, m in SIZES},
    "saddle of a chain": (Saddle((12, 9), ""), lambda: chains(12, 9)),
    **{f"multipliers {n} {m}": (Multipliers((n, m), ""), lambda n=n, m=m: forces(n, m)) for n, m in SIZES},
    **{f"cube {order}": (Cube((order,), ""), lambda order=order: cuts(order)) for order in (0, 1, 2)},
    **{f"catenary {seabed}": (Catenary((seabed,), ""), lambda seabed=seabed: lines(seabed)) for seabed in (0, 1)},
}


# One code for all sizes: least, more speeds than constraints, as many, fewer.
FEW = [name for name in KERNELS if not name.endswith(("2 1", "3 2"))]
of_each = pytest.mark.parametrize("name", swept(KERNELS, *FEW))


@functools.cache
def inputs(name: str) -> np.ndarray:
    """Made once for all tests of an algorithm, none of which may change them."""
    values = KERNELS[name][1]()
    values.setflags(write=False)
    return values


@needs_c
@pytest.mark.native
@of_each
def test_c_and_python_give_the_same_bits_and_reject_the_same(name: str, in_c: Compiled) -> None:
    intrinsic, values = KERNELS[name][0], inputs(name)
    expected, rejected = in_c(intrinsic, values)
    found = intrinsic.rows(values.T)
    expected[rejected] = np.nan
    np.testing.assert_array_equal(found, expected)
    assert 0.3 < np.isfinite(found).all(axis=1).mean() < 1
    for k in range(0, len(values), 97):  # state by state as all at once
        np.testing.assert_array_equal(intrinsic.rows(values[k].tolist()), found[k])


@of_each
def test_generated_python_has_the_text_of_the_package(name: str) -> None:
    """The same bits; what is rejected raises, with the states at which it does."""
    intrinsic, values = KERNELS[name][0], inputs(name)[::3]
    recorder = Recorder()
    names = [f"v{k}" for k in range(values.shape[1])]
    tape = Tape.of(recorder, solve=recorder.call(intrinsic, [recorder.leaf(n, INPUT) for n in names]))
    groups = {group: names if group == "inputs" else [] for group in ("q", "u", "z", "ud", "inputs", "p")}
    content = Content("intrinsics", "test", {"solve": tape}, {"solve": "solve"}, groups, {}, {}, {})
    text, = render(content, "numpy", standalone=False, right_side=RightSide(integrated=False)).files.values()
    module: dict[str, object] = {"__name__": "intrinsics"}
    exec(text, module)
    expected = intrinsic.rows(values.T)
    rejected = np.isnan(expected).any(axis=1)
    solve, failure = module[intrinsic.name], module["SingularError"]
    assert callable(solve) and isinstance(failure, type) and issubclass(failure, ArithmeticError)
    np.testing.assert_array_equal(np.array(solve(*intrinsic.sizes, list(values[~rejected].T), 1)).T, expected[~rejected])
    if isinstance(intrinsic, Multipliers):  # there are always some, but of what is no number
        assert not np.isfinite(np.array(solve(*intrinsic.sizes, list(values.T), 1)).T[rejected]).all(axis=1).any()
        return
    with pytest.raises(failure) as caught:
        solve(*intrinsic.sizes, list(values.T), 1)
    states = caught.value.states  # type: ignore[attr-defined]
    assert states.any() and not states[~rejected].any()


@pytest.mark.parametrize("name", swept([name for name in KERNELS if name.startswith(("saddle", "multipliers"))],
                                        *(name for name in FEW if name.startswith(("saddle", "multipliers")))))
def test_statements_are_those_of_the_text(name: str) -> None:
    """Recorded on a tape, for bounds of rounding errors; e is divided by there by multiplying with its inverse."""
    intrinsic, values = KERNELS[name][0], inputs(name)[::35].copy()  # the regular ones
    recorder = Recorder()
    names = [f"v{k}" for k in range(values.shape[1])]
    leaves: list = [recorder.leaf(n, INPUT) for n in names]
    if isinstance(intrinsic, Saddle):
        values[:, 0] = leaves[0] = SMOOTHED
    found = intrinsic.statements(recorder, leaves)
    rows = evaluate_rows(Tape.of(recorder, solve=found), dict(zip(names, values.T, strict=True)), len(values))["solve"]
    expected = intrinsic.rows(values.T)
    regular = np.isfinite(expected).all(axis=1)
    assert regular.mean() > 0.9
    errors = np.abs(rows - expected)[regular].max(axis=1) / np.abs(expected[regular]).max(axis=1)
    assert np.median(errors) < 1e-15 and errors.max() < 1e-9
