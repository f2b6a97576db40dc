"""Motions on a device from arrays of other libraries that lie there, whose states stay there: the kernel's text as C on a device
of this processor, against those of arrays of NumPy."""

from __future__ import annotations

import gc
from typing import Any

import numpy as np
import pytest
from host_device import HostDevice, Interface, Lockstep, There, compiled

import symdyn as sd
from symdyn.errors import ArgumentError, SimulationInterrupted, SimulationWarning
from symdyn.runtime.gpu import arrays, device, motions

N = 100
T = [0, 0.4, 1]


def states(n: int = N) -> np.ndarray:
    return np.random.default_rng(4).uniform(-1, 1, (n, 4))


def lent(host: HostDevice, values: np.ndarray) -> There:
    """An array on the device."""
    host.lent.append(values)
    return There(values)


def same(there: Any, here: Any) -> None:
    assert np.array_equal(there.x, here.x, equal_nan=True) and np.array_equal(there.n_steps, here.n_steps)
    assert np.array_equal(there.success, here.success) and there.messages == here.messages


@pytest.mark.parametrize("order", ["rows", "entries", "every second"])
def test_arrays_are_read_where_they_lie_and_states_stay_there(host: HostDevice, order: str) -> None:
    module, x = compiled("double_pendulum"), states()
    x = {"rows": x, "entries": np.asfortranarray(x), "every second": np.repeat(x, 2, axis=0)[::-2]}[order]
    p = module.parameters() * np.linspace(1, 1.2, N)[:, None]
    here = module.simulate_batch(x[:, :2], x[:, 2:], p, t=T)
    there = module.simulate_batch(lent(host, x[:, :2]), lent(host, x[:, 2:]), lent(host, p), t=T, device="gpu")
    # The uploads are times, tolerances, lengths, tables and counters, but no numbers of motions; no states came back.
    sizes = [size for what, size in host.log if what == "up"]
    assert max(sizes) < 1000 and len([what for what, _ in host.log if what == "begin"]) > 3
    assert N * 3 * 4 * 8 not in [size for what, size in host.log if what == "down"]
    assert sum(size for what, size in host.log if what == "down") < 8 * (2 * x.size * 2 + p.size) + N * (64 + 250)
    kept = there.x_on_device
    assert repr(kept) == "<DeviceArray 100 x 3 x 4 of float64>" and kept.__dlpack_device__() == (1, 0) and len(there) == N
    taken = np.from_dlpack(kept)
    assert taken.ctypes.data in host.blocks and taken.shape == (N, 3, 4) and np.array_equal(taken, here.x)
    same(there, here)
    assert there.x is there.x and np.array_equal(there["q1"], here["q1"]) and np.array_equal(there.q, here.q)
    del there, kept
    gc.collect()
    assert len(host.blocks) == 1  # of what was taken
    del taken
    gc.collect()
    assert not host.blocks


def test_some_of_the_arrays_lie_there(host: HostDevice) -> None:
    """Starts by name, one row or one number for all, parameters alone, inputs, and what is not given."""
    module, x = compiled("double_pendulum"), states()
    m2, g = np.linspace(1, 2, N), np.array(9.0)
    defaults = module.parameters()
    for lying, given in (
            (({"q1": lent(host, x[:, 0]), "q2": 0.3}, {"q1_dot": x[:, 1]}), ({"q1": x[:, 0], "q2": 0.3}, {"q1_dot": x[:, 1]})),
            ((x[:, :2], None, {"m2": lent(host, m2), "g": lent(host, g)}), (x[:, :2], None, {"m2": m2, "g": g})),
            ((lent(host, x[:, :2]), lent(host, x[0, 2:]), lent(host, defaults)), (x[:, :2], x[0, 2:], defaults)),
            ((lent(host, x[:1, :2]), x[:, 2:]), (x[:1, :2], x[:, 2:]))):
        found = module.simulate_batch(*lying, t=T, device="gpu")
        assert found.x_on_device.shape == (N, 3, 4)
        same(found, module.simulate_batch(*given, t=T))
    cart = compiled("cart_pole")
    force, name = np.linspace(-1, 1, N), cart.metadata.inputs[0]
    here = cart.simulate_batch(t=T, inputs={name: force})
    for inputs in ({name: lent(host, force)}, lent(host, force[:, None])):
        same(cart.simulate_batch(t=T, inputs=inputs, device="gpu"), here)
    # Inputs over time, which are those of all motions, are brought.
    asked: dict[str, Any] = {"t": T, "inputs": {name: ([0.0, 0.5, 1.0], [0.0, 2.0, 1.0])}}
    same(cart.simulate_batch({cart.metadata.q[1]: lent(host, force)}, **asked, device="gpu"),
         cart.simulate_batch({cart.metadata.q[1]: force}, **asked))


def test_motions_that_fail_or_go_on_on_the_processor(host: HostDevice, monkeypatch: pytest.MonkeyPatch) -> None:
    module, x = compiled("double_pendulum"), states(12)
    x[3, 0] = np.nan
    p = np.tile(module.parameters(), (12, 1))
    p[5, module.metadata.parameters.index("m2")] = -1
    with pytest.warns(SimulationWarning, match="2 of 12 motions failed: 3: .*start is not finite: q1; 5: .*m2"):
        there = module.simulate_batch(lent(host, x[:, :2]), lent(host, x[:, 2:]), lent(host, p), t=T, device="gpu")
    with pytest.warns(SimulationWarning, match="2 of 12 motions failed"):
        here = module.simulate_batch(x[:, :2], x[:, 2:], p, t=T)
    same(there, here)
    assert np.isnan(np.from_dlpack(there.x_on_device)[[3, 5]]).all()
    monkeypatch.setattr(motions, "MOST_STEPS", int(np.median(here.n_steps + here.n_rejected)))
    monkeypatch.setattr(arrays, "PIECE", 100)
    with pytest.warns(SimulationWarning, match="2 of 12 motions failed"):
        some = module.simulate_batch(lent(host, x[:, :2]), lent(host, x[:, 2:]), lent(host, p), t=T, device="gpu")
    assert int(some.note.split()[0]) in range(1, 10) and "of 12 motions one by one: they took more than" in some.note
    assert np.array_equal(np.from_dlpack(some.x_on_device), here.x, equal_nan=True)


def test_starts_are_checked_and_corrected_as_those_of_numpy(host: HostDevice) -> None:
    system = sd.System("top", gravity=[0, 0, -9.81])
    body = system.add_body("b", mass=1, inertia=[0.2, 0.3, 0.4])
    system.add_joint(sd.Spherical("s", system.ground, body, orientation=sd.EulerParameters(), child_point=[0, 0, 1]))
    module = system.embedding().compile(backend="c")
    q = np.tile([1 + 1e-9, 0.0, 0.0, 0.0], (6, 1))  # of a length that is set to 1
    u = np.random.default_rng(2).uniform(1, 5, (6, 3))
    same(module.simulate_batch(lent(host, q), lent(host, u), t=(0, 1), device="gpu"), module.simulate_batch(q, u, t=(0, 1)))


def test_an_interrupt_leaves_no_numbers_where_nothing_was_computed(host: HostDevice, monkeypatch: pytest.MonkeyPatch) -> None:
    module, x = compiled("double_pendulum"), states()
    begun, count = host.launch, iter(range(10))

    def launch(*arguments: Any) -> None:
        if next(count) == 2:
            raise KeyboardInterrupt
        begun(*arguments)

    monkeypatch.setattr(host, "launch", launch)
    with pytest.raises(SimulationInterrupted, match="interrupted after 64 of 100 motions") as caught:
        module.simulate_batch(lent(host, x[:, :2]), lent(host, x[:, 2:]), t=T, device="gpu")
    solution: Any = caught.value.solution
    assert np.array_equal(solution.x[:64], module.simulate_batch(x[:64, :2], x[:64, 2:], t=T).x)
    assert np.isnan(solution.x[64:]).all()


def test_motions_in_warps_are_written_to_their_places(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Lockstep(64)
    monkeypatch.setattr(device, "open_device", lambda number, owner: made)
    monkeypatch.setattr(motions, "TURN", 2)
    module, x = compiled("double_pendulum"), states(200)
    there = module.simulate_batch(lent(made, x[:, :2]), lent(made, x[:, 2:]), t=T, device="gpu")
    assert len(made.launches) > 3
    same(there, module.simulate_batch(x[:, :2], x[:, 2:], t=T))


def test_no_motions(host: HostDevice) -> None:
    module, none = compiled("double_pendulum"), np.zeros((0, 2))
    for q in (none, lent(host, none), {"q1": lent(host, none[:, 0])}):
        motions_of_none = module.simulate_batch(q, t=T, device="gpu")
        assert motions_of_none.x.shape == (0, 3, 4) and motions_of_none.note == "on a processor, without a motion"


def test_single_precision(host: HostDevice) -> None:
    module, x = compiled("double_pendulum"), states().astype(np.float32)
    asked: dict[str, Any] = {"t": T, "rtol": 1e-6, "method": "bs54", "device": "gpu", "precision": "single"}
    there = module.simulate_batch(lent(host, x[:, :2]), lent(host, x[:, 2:]), **asked)
    assert there.x_on_device.dtype == np.float32 and there.x.dtype == float
    same(there, module.simulate_batch(x[:, :2].astype(float), x[:, 2:].astype(float), **asked))


def test_jax(host: HostDevice) -> None:
    jax = pytest.importorskip("jax")
    module, x = compiled("double_pendulum"), states()
    with jax.enable_x64(True):
        q = jax.numpy.asarray(x[:, :2])
        host.lent.append(np.from_dlpack(q))
        there = module.simulate_batch(q, x[:, 2:], t=T, device="gpu")
        taken = jax.dlpack.from_dlpack(there.x_on_device)
        assert taken.dtype == "float64" and np.array_equal(np.asarray(taken), module.simulate_batch(x[:, :2], x[:, 2:], t=T).x)


def test_arrays_of_the_cuda_array_interface(host: HostDevice) -> None:
    module, x = compiled("double_pendulum"), states()
    here = module.simulate_batch(x[:, :2], x[:, 2:], t=T)
    host.lent.append(x)
    same(module.simulate_batch(Interface(x[:, :2]), Interface(x[:, 2:], stream=7), t=T, device="gpu"), here)
    assert [n for what, n in host.log if what == "wait"] == [7]
    rows = np.ascontiguousarray(x[:, :2])
    host.lent.append(rows)
    # In version 2 what it waits for is not known; without strides rows are neighbours.
    old = Interface(rows, strides=None, version=2)
    del old.__cuda_array_interface__["stream"]
    same(module.simulate_batch(old, {"q1_dot": There(x[:, 2]), "q2_dot": Interface(x[:, 3])}, t=T, device="gpu"), here)
    assert [n for what, n in host.log if what == "wait"] == [7, 1]
    same(module.simulate_batch(x[:, :2], x[:, 2:], z=Interface(np.zeros((N, 0)), data=(0, False)), t=T, device="gpu"), here)
    out = np.zeros_like(x)
    host.lent.append(out)
    written = Interface(out)
    assert module.rhs_batch(0.0, Interface(x), out=written, device="gpu") is written
    assert np.array_equal(out, module.rhs_batch(0.0, x))
    away = np.zeros((N, 2))
    for wrong, match in ((Interface(away), "q lies on the GPU with the number 1, and motions are computed on that"),
                         (Interface(x[:, :2], typestr="<i8"), "q is an array of int64 on the device, and precision='double'"),
                         (Interface(x[:, :2], mask=There(x)), "q is a masked array, whose hidden entries would count"),
                         (Interface(x[:, :2], strides=(12, 4)), r"q has strides of \(12, 4\) bytes, which are no multiples")):
        with pytest.raises(ArgumentError, match=match):
            module.simulate_batch(wrong, t=T, device="gpu")
    with pytest.raises(ArgumentError, match="out lies on the device and must not be written; pass another array, or leave out"):
        module.rhs_batch(0.0, Interface(x), out=Interface(out, data=(out.ctypes.data, True)), device="gpu")


def test_arrays_that_do_not_fit(host: HostDevice) -> None:
    module, x = compiled("double_pendulum"), states()
    for arguments, options, match in (
            ((There(x[:, :2].astype(np.float32)),), {}, "q is an array of float32 on the device, and precision='double' takes "),
            (({"q1": There(x[:, 0].astype(int))},), {}, "q, q1 is an array of int64 on the device"),
            ((There(x[:, :2]),), {"precision": "single", "rtol": 1e-6}, "q is an array of float64 on the device, and precision"),
            ((There(x[:, :2], (1, 1)),), {}, "q lies on the GPU with the number 1, and motions are computed on that with the "
                                             "number 0; pass device='gpu:1', or copy it"),
            ((There(x[:, :2], (7, 0)),), {}, "initial q must be real numbers, found .*: an array on a device of the type 7"),
            ((lent(host, x[:, :3]),), {}, r"initial q has the shape \(100, 3\), needed is \(trajectories, 2\): q1, q2"),
            ((lent(host, x[:, :2]), lent(host, x[:7, 2:])), {}, "q has 100 rows, u has 7 rows; give what varies the same number"),
            (({"q9": lent(host, x[:, 0])},), {}, "there is no 'q9', did you mean")):
        with pytest.raises(ArgumentError, match=match):
            module.simulate_batch(*arguments, t=T, device="gpu", **options)
    with pytest.raises(ArgumentError, match="sensitivities: kernels have none of these"):
        module.simulate_batch(lent(host, x[:, :2]), t=T, device="gpu", sensitivities=["m2"])
    host.memory = 5000
    with pytest.raises(ArgumentError, match=r"a processor has 5 kB \(5000 bytes\) of free memory, and the states of 100 motions "
                                            r"at 3 output times take 9.6 kB \(9600 bytes\) there; ask for fewer output times, "):
        module.simulate_batch(lent(host, x[:, :2]), t=T, device="gpu")
    assert not host.blocks
    with pytest.raises(ArgumentError, match="states of these motions lie in the memory of this process; take x, or pass simul"):
        _ = module.simulate_batch(x[:, :2], t=T).x_on_device
