"""Arrays of other libraries in many motions, by the protocol DLPack, in and out without copies: by the addresses that C gets."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from symdyn.errors import ArgumentError
from symdyn.real_numbers import NotReal, real
from symdyn.runtime.batches import motions
from symdyn.runtime.batches.arguments import side_by_side
from symdyn.runtime.gpu.dlpack import CPU, CUDA, DeviceArray

N = 11


class Elsewhere:
    """An array of another library, which NumPy has to ask for by DLPack; where: type and number of its device."""

    def __init__(self, values: np.ndarray, where: tuple[int, int] = (CPU, 0)) -> None:
        self.values, self.where = values, where

    def __dlpack__(self, **options: Any) -> Any:
        return self.values.__dlpack__(**options)

    def __dlpack_device__(self) -> tuple[int, int]:
        return self.where


@pytest.fixture
def arm(compiled: Callable[..., Any]) -> Any:
    return compiled("double_pendulum", "c")


@pytest.fixture
def addresses(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Where the tables of states, inputs, parameters begin that motions in lanes are computed from."""
    found: list[int] = []
    tables_of = motions.tables_of
    monkeypatch.setattr(motions, "tables_of", lambda arrays: found.extend(a.ctypes.data for a in arrays) or tables_of(arrays))
    return found


def states(seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (N, 4))


def parameters(module: Any) -> np.ndarray:
    return np.tile(module.parameters(), (N, 1)) * np.linspace(0.9, 1.1, N)[:, None]


@pytest.mark.parametrize("of", [np.asarray, Elsewhere])
def test_starts_and_parameters_are_read_where_they_are(arm: Any, addresses: list[int], of: Callable[..., Any]) -> None:
    for x in (states(), np.asfortranarray(states()), np.repeat(states(), 2, axis=0)[::2]):
        p = parameters(arm)
        addresses.clear()
        many = arm.simulate_batch(of(x[:, :2]), of(x[:, 2:]), of(p), t=(0, 1))
        assert addresses[0] == x.ctypes.data and addresses[2] == p.ctypes.data
        apart = arm.simulate_batch(x[:, :2].copy(), x[:, 2:].copy(), p, t=(0, 1))
        assert addresses[len(addresses) // 2] != x.ctypes.data and np.array_equal(many.x, apart.x)


def test_starts_that_are_no_neighbours_are_put_together(arm: Any, addresses: list[int]) -> None:
    x = states()
    swapped = arm.simulate_batch(x[:, 2:], x[:, :2], t=(0, 1))
    assert addresses[0] != x.ctypes.data
    assert np.array_equal(swapped.x, arm.simulate_batch(x[:, 2:].copy(), x[:, :2].copy(), t=(0, 1)).x)
    one = side_by_side([x[:, :2], np.zeros((1, 2)), np.zeros((1, 0))], N)
    assert np.array_equal(one, np.hstack([x[:, :2], np.zeros((N, 2))]))
    neighbours = side_by_side([x[:, :2], x[:, 2:], np.zeros((1, 0))], N)
    assert neighbours.ctypes.data == x.ctypes.data and np.array_equal(neighbours, x) and not neighbours.flags.writeable
    assert not np.shares_memory(side_by_side([x[:, :2], x[::-1, 2:], np.zeros((1, 0))], N), x)


def test_starts_are_left_as_they_are() -> None:
    """Also where constraints have motions begin elsewhere."""
    import symdyn as sd

    module = sd.systems.four_bar().augmented().compile()
    x = np.tile(np.concatenate(module.consistent()), (3, 1))
    x[1, 0] += 1e-9
    kept = x.copy()
    n_q = module.metadata.sizes.q
    assert module.simulate_batch(x[:, :n_q], x[:, n_q:], t=(0, 0.1)).success.all() and np.array_equal(x, kept)


def test_results_are_taken_where_they_are(arm: Any) -> None:
    x = states()
    for options in ({}, {"sensitivities": ["m2", "g"]}, {"max_steps": 1000}):
        many = arm.simulate_batch(x[:, :2], x[:, 2:], t=np.linspace(0, 1, 3), **options)
        arrays = [many.x, *([many.sensitivity.matrix] if "sensitivities" in options else [])]
        for array in arrays:
            assert array.ctypes.data % 64 == 0 and array.flags.c_contiguous
            assert np.from_dlpack(array).ctypes.data == array.ctypes.data


def test_jax(arm: Any, addresses: list[int]) -> None:
    """Its arrays are in doubles where that was requested."""
    jax = pytest.importorskip("jax")
    x = states()
    here = arm.simulate_batch(x[:, :2], x[:, 2:], parameters(arm), t=(0, 1), sensitivities=["m2"])
    with jax.enable_x64(True):
        q, u, p = (jax.numpy.asarray(a) for a in (x[:, :2], x[:, 2:], parameters(arm)))
        addresses.clear()
        many = arm.simulate_batch(q, u, p, t=(0, 1), sensitivities=["m2"])
        assert addresses[2] == p.unsafe_buffer_pointer() and np.array_equal(many.x, here.x)
        for array in (many.x, many.sensitivity.matrix):
            taken = jax.dlpack.from_dlpack(array)
            assert taken.unsafe_buffer_pointer() == array.ctypes.data and taken.dtype == "float64"
            assert np.array_equal(np.asarray(taken), array)


def test_torch(arm: Any, addresses: list[int]) -> None:
    torch = pytest.importorskip("torch")
    x, p = torch.from_numpy(states()), torch.from_numpy(parameters(arm))
    many = arm.simulate_batch(x[:, :2], x[:, 2:], p, t=(0, 1))
    assert addresses[0] == x.data_ptr() and addresses[2] == p.data_ptr()
    assert torch.from_dlpack(many.x).data_ptr() == many.x.ctypes.data


def test_arrays_that_lie_elsewhere(arm: Any) -> None:
    x = states()
    there = Elsewhere(x[:, :2], (CUDA, 0))
    with pytest.raises(ArgumentError, match=r"double_pendulum: initial q must be real numbers, found .*: an array on a device of "
                       "the type 2 of DLPack; copy it into the memory of this process"):
        arm.simulate_batch(there, t=(0, 1))
    with pytest.raises(ArgumentError, match=r"x must be real numbers, found .*: an array on a device of the type 2"):
        arm.rhs_batch(0.0, Elsewhere(x, (CUDA, 0)))


def test_numbers_of_other_libraries() -> None:
    values = np.arange(6.0).reshape(2, 3)
    rows = DeviceArray(values.ctypes.data, (2, 3), np.dtype(float), (CPU, 0), lambda: None, values.copy)
    assert real(rows).ctypes.data == values.ctypes.data and np.array_equal(real(rows), values)
    assert real(Elsewhere(values.astype(np.float32))).dtype == float
    with pytest.raises(NotReal, match="complex"):
        real(Elsewhere(values + 1j))
    with pytest.raises(NotReal, match="True and False are no numbers"):
        real(Elsewhere(values > 1))
    class Broken:
        def __dlpack_device__(self) -> tuple[int, int]:
            raise RuntimeError("freed")

    with pytest.raises(NotReal, match=r"no array of numbers \(freed\)"):
        real(Broken())
