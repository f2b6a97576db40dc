"""Ensembles: samples, outcomes compared with single simulations, members that fail, executors that die, a full disk."""

from __future__ import annotations

import errno
import itertools
import os
import pickle
import signal
import time
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import mpmath
import numpy as np
import pytest
from scipy import stats

import symdyn as sd
from symdyn.ensembles import chunk, plan, portable, store
from symdyn.ensembles.archive import thinned
from symdyn.ensembles.axes import read_axis
from symdyn.ensembles.lock import OneRun
from symdyn.ensembles.measures import Measure, take_measures
from symdyn.ensembles.samples import _permuted
from symdyn.errors import ArgumentError, CompilerNotFound, EnsembleStopped
from symdyn.runtime.building import texts
from symdyn.runtime.building.recall import recall

T = (0.0, 0.5)


@pytest.fixture(scope="module")
def module():
    return recall("double_pendulum", {})


def drawn(count=40, **options):
    return sd.Samples({"m2": [1.0, 2.0], "l1": {"from": 0.5, "to": 1.5}, "q1": {"distribution": "normal", "mean": 1, "std": 0.2},
                       "g": 9.8}, count=count, seed=3, **options)


# -- samples


@pytest.mark.parametrize("sampling", ["random", "latin_hypercube", "sobol"])
def test_every_block_of_samples_is_the_same_however_it_is_cut(sampling):
    samples = drawn(101, sampling=sampling)
    whole = samples.block(0, 101)
    pieces = {k: samples.block(k, min(k + 7, 101)) for k in reversed(range(0, 101, 7))}
    assert np.array_equal(whole, np.vstack([pieces[k] for k in sorted(pieces)]))
    assert np.array_equal(whole, drawn(101, sampling=sampling).block(0, 101))
    assert set(whole[:, 0]) == {1.0, 2.0} and (whole[:, 3] == 9.8).all() and samples.varied == ("m2", "l1", "q1")


def test_another_seed_gives_other_samples():
    a, b = (sd.Samples({"g": {"from": 0, "to": 1}}, count=50, seed=s, sampling=w).block(0, 50)
            for s, w in ((1, "latin_hypercube"), (2, "latin_hypercube")))
    assert not np.isclose(a, b).all()


def test_a_latin_hypercube_has_one_sample_in_every_row_and_column():
    samples = sd.Samples({n: {"from": 0, "to": 1} for n in "abc"}, sampling="latin_hypercube", count=1000, seed=5)
    cells = np.floor(1000 * samples.block(0, 1000)).astype(int)
    assert all(sorted(column) == list(range(1000)) for column in cells.T)
    assert abs(np.corrcoef(cells.T)[0, 1]) < 0.1 and abs(np.corrcoef(cells[:-1, 0], cells[1:, 0])[0, 1]) < 0.1


@pytest.mark.parametrize("n", [1, 2, 3, 17, 64, 1000])
def test_permuted_numbers_are_a_permutation(n):
    assert sorted(_permuted(np.arange(n), n, (1, 2))) == list(range(n))


def test_sobol_points_are_those_of_scipy():
    samples = sd.Samples({"a": {"from": 0, "to": 1}, "b": {"from": 2, "to": 4}}, sampling="sobol", count=64, seed=9)
    expected = stats.qmc.Sobol(2, seed=9).random(64)
    assert np.allclose(samples.block(0, 64), expected * [1, 2] + [0, 2], rtol=0, atol=1e-15)


@pytest.mark.parametrize("given, law", [
    ({"distribution": "uniform", "from": -1, "to": 3}, stats.uniform(-1, 4)),
    ({"distribution": "loguniform", "from": 0.1, "to": 10}, stats.loguniform(0.1, 10)),
    ({"distribution": "normal", "mean": 2, "std": 0.5}, stats.norm(2, 0.5)),
    ({"distribution": "truncated_normal", "mean": 2, "std": 0.5, "from": 1.5, "to": 4}, stats.truncnorm(-1, 4, 2, 0.5)),
    ({"distribution": "lognormal", "median": 2, "sigma": 0.3}, stats.lognorm(0.3, scale=2)),
    ({"distribution": "triangular", "from": 1, "mode": 2, "to": 5}, stats.triang(0.25, 1, 4)),
])
def test_distributions_are_those_of_scipy(given, law):
    probabilities = sd.Samples({"x": {"from": 0, "to": 1}}, count=200, seed=8).block(0, 200)
    values = sd.Samples({"x": given}, count=200, seed=8).block(0, 200)
    assert np.allclose(values, law.ppf(probabilities), rtol=1e-10)


def test_a_grid_has_every_combination_and_the_last_varies_fastest():
    samples = sd.Samples({"a": [1, 2], "b": {"from": 0, "to": 1, "count": 3}, "c": 7.0})
    assert samples.count == 6
    assert np.array_equal(samples.block(0, 6), list(itertools.product([1, 2], [0, 0.5, 1], [7])))
    assert np.array_equal(samples.block(2, 5), samples.block(0, 6)[2:5])


@pytest.mark.parametrize("values, options, message", [
    ({}, {}, "one name at least"),
    ({"a": "x"}, {}, "samples.a: give a number"),
    ({"a": [1, 2], "b": [1, 2, 3]}, {"sampling": "paired"}, "as many of each, found a: 2, b: 3"),
    ({"a": [1, 2]}, {"sampling": "gird"}, "sampling 'gird' asked for; there are paired, grid"),
    ({"a": {"from": 0, "to": 1}}, {}, "random needs a count"),
    ({"a": {"from": 0, "to": 1}}, {"sampling": "grid"}, "a has a distribution"),
    ({"a": [1, 2]}, {"sampling": "grid", "count": 3}, "the grid has 2 samples, but the count is 3"),
    ({"a": [1, 2]}, {"count": 3, "seed": -1}, "the seed must be"),
    ({"a": {"distribution": "normal", "mean": 0}}, {"count": 3}, "samples.a.std: is missing"),
    ({"a": {"distribution": "normal", "mean": 0, "std": -1, "sd": 1}}, {"count": 3}, "std > 0, found mean = 0, std = -1"),
    ({"a": {"distribution": "norml"}}, {"count": 3}, "did you mean normal"),
    ({"a": {"from": 1, "to": 0}}, {"count": 3}, "uniform needs from < to"),
    ({"a": {"from": 1, "to": 2, "count": 1.5}}, {}, "a.count: must be a whole number"),
    ({"a": [1]}, {"sampling": "sobol", "count": 2**31}, "sobol has"),
])
def test_samples_that_cannot_be_made(values, options, message):
    with pytest.raises(ArgumentError, match=message.replace("(", r"\(")):
        sd.Samples(values, **options)


# -- outcomes


def farthest(solution):
    return np.abs(solution.q).max(axis=0)


def test_outcomes_are_those_of_single_simulations(module):
    samples = drawn()
    outcomes = {"end": "end q1", "lowest": "min q2_dot", "top": "max q2", "mean": "mean energy", "rms": "rms q1_dot",
                "then": "q1 at 0.25", "all": "trace q2", "first": "start q1", "far": farthest}
    times = np.linspace(*T, 21)
    done = sd.ensemble(module, samples, times, outcomes, chunk=7, rtol=1e-9)
    assert done.count == 40 and done.n_failed == 0 and not done.failures() and done["all"].shape == (40, 21)
    for k in (0, 13, 39):
        m2, l1, q1, g = samples.block(k, k + 1)[0]
        motion = module.simulate(times, {"q1": q1}, params={"m2": m2, "l1": l1, "g": g}, rtol=1e-9)
        expected = {"end": motion["q1"][-1], "lowest": motion["q2_dot"].min(), "top": motion["q2"].max(),
                    "mean": np.sum((motion.energy[1:] + motion.energy[:-1]) / 2) / 20,
                    "rms": np.sqrt(np.sum((motion["q1_dot"][1:] ** 2 + motion["q1_dot"][:-1] ** 2) / 2) / 20),
                    "then": motion["q1"][10], "all": motion["q2"], "first": q1, "far": np.abs(motion.q).max(axis=0)}
        for label, value in expected.items():
            np.testing.assert_allclose(done[label][k], value, rtol=1e-12, err_msg=label)
        assert np.array_equal(done.samples[k], [m2, l1, q1, g]) and done["l1"][k] == l1


def test_arrays_belong_together_and_the_end_of_all_states_is_kept_by_default(module):
    angles, masses = np.linspace(-1, 1, 5), np.linspace(1, 3, 5)
    done = sd.ensemble(module, {"q1": angles, "m1": masses}, T, u={"q2_dot": 0.5})
    motion = module.simulate(T, {"q1": angles[3]}, {"q2_dot": 0.5}, {"m1": masses[3]})
    np.testing.assert_allclose([done[label][3] for label in done.labels], motion.x[-1], rtol=1e-13)
    assert done.labels == ("end q1", "end q2", "end q1_dot", "end q2_dot")


def test_a_system_is_compiled_and_its_inputs_can_vary():
    done = sd.ensemble(sd.systems.get("cart_pole"), {"F": [0.0, 1.0, 2.0]}, (0.0, 0.1), ["end q1", "max F"])
    assert done["max F"].tolist() == [0, 1, 2] and (np.diff(done["end q1"]) > 0).all()


def test_a_start_is_made_consistent_for_every_member():
    module = recall("four_bar", {})
    first = module.metadata.x[0]
    angle = module.consistent()[0][0]
    angles = angle + np.linspace(-0.1, 0.1, 3)
    done = sd.ensemble(module, {first: angles}, (0.0, 0.05), {"start": f"start {first}", "error": violation}, consistent=True)
    np.testing.assert_allclose(done["start"], angles, rtol=1e-12)
    assert done["error"].max() < 1e-10
    with pytest.raises(ArgumentError, match=r"none of 3 samples that were tried can be simulated; the first: four_bar: the "
                                            r"initial positions violate .*; begin each motion with the nearest consistent state: "
                                            r"consistent=True, in a sweep file consistent = true$"):
        sd.ensemble(module, {first: angle + np.array([0.3, 0.4, 0.5])}, (0.0, 0.05))


@pytest.mark.parametrize("several", [False, True])
def test_an_inconsistent_start_is_a_failure_with_what_to_do(monkeypatch, several):
    module = recall("four_bar", {})
    first, angle = module.metadata.x[0], module.consistent()[0][0]
    monkeypatch.setattr(plan, "VECTORS_FROM", 1 if several else 10)
    done = sd.ensemble(module, {first: [angle, angle + 0.3]}, (0.0, 0.05))
    assert done.failed.tolist() == [False, True]
    assert done.failures()[0]["message"].endswith("consistent state: consistent=True, in a sweep file consistent = true")


def violation(solution):
    return np.abs(solution.constraint_violation).max()


# -- members that fail


def sometimes(solution):
    if solution.params[1] > 2.5:
        raise ZeroDivisionError("too heavy")
    return solution.x[-1, 0] if solution.params[1] > 1.5 else [1.0, 2.0]


def test_a_failed_member_is_reported_and_the_others_go_on(module):
    angles = np.linspace(-1, 1, 20)
    angles[[3, 11]] = np.nan, np.inf
    done = sd.ensemble(module, {"q1": angles}, T, ["end q1", "trace q2"], chunk=4)
    assert np.flatnonzero(done.failed).tolist() == [3, 11] and done.n_failed == 2
    assert np.isnan(done["end q1"][[3, 11]]).all() and np.isnan(done["trace q2"][3]).all()
    assert np.isfinite(np.delete(done["end q1"], [3, 11])).all()
    failures = done.failures()
    assert [f["index"] for f in failures] == [3, 11] and failures[1]["values"] == {"q1": "inf"}
    assert failures[0]["message"] == "double_pendulum: a sample must be finite, found q1 = nan"
    assert done.failures(1) == failures[:1]


def test_motions_that_stop_early_and_functions_that_raise_are_failures(module):
    done = sd.ensemble(module, {"q1": [0.0, 0.5, 1.0]}, (0.0, 5.0), max_steps=20)
    assert done.n_failed == 3 and "20 steps were done, as asked" in done.failures()[0]["message"]
    done = sd.ensemble(module, {"m1": [2.0, 3.0, 1.0]}, T, {"some": sometimes})
    assert done.failed.tolist() == [False, True, True]
    told = [f["message"] for f in done.failures()]
    assert told == ["ZeroDivisionError: too heavy", "outcome 'some' has the shape (2,), elsewhere ()"]
    done = sd.ensemble(module, {"m1": [2.0, 3.0]}, T, {"some": lambda solution: np.inf if solution.params[1] < 2.5 else 1.0})
    assert done.failures()[0]["message"] == "some: the outcome is not finite"


@pytest.mark.parametrize("samples, options, message", [
    ({"q9": [1, 2]}, {}, "samples: there is no q9; there are q: q1, q2"),
    ({"q1": [1, 2], "m1": [1, 2, 3]}, {}, "as many of each, found q1: 2, m1: 3"),
    ({"q1": [1, 2]}, {"outcomes": "end q1"}, "outcomes must be a list of texts"),
    ({"q1": [1, 2]}, {"outcomes": ["stop q1"]}, "write one of start, end, min"),
    ({"q1": [1, 2]}, {"outcomes": ["end q1_dt"]}, "did you mean q1_dot"),
    ({"q1": [1, 2]}, {"outcomes": ["end q1", "end q1"]}, "the name is taken"),
    ({"q1": [1, 2]}, {"outcomes": ["q1 at 1.2.3"]}, "'1.2.3' is not a time"),
    ({"q1": [1, 2]}, {"outcomes": [3]}, "neither a text"),
    ({"q1": [1, 2]}, {"outcomes": [farthest]}, "a function needs a label in the results; pass a mapping such as {'farthest': f"),
    ({"q1": [1, 2]}, {"outcomes": [lambda sol: 1.0]}, "pass a mapping such as {'outcome': function}"),
    ({"q1": [1, 2]}, {"outcomes": ["q1 at 7"]}, "asked for at 7 s, outside of 0 to 0.5 s"),
    ({"q1": [1, 2]}, {"outcomes": ["q1 at 0.3"], "t": np.linspace(0, 1, 3)}, "at 0.3 s, which t does not have"),
    ({"q1": [1, 2]}, {"t": (1, 1)}, "t must be"),
    ({"q1": [1, 2]}, {"t": "long"}, "t must be"),
    ({"q1": [1, 2]}, {"rtol": -1}, "none of 2 samples that were tried can be simulated; the first: "
     "double_pendulum: tolerances must be positive, found rtol = -1$"),
    ({"q1": [1, 2]}, {"rtol": 1e-6, "atol": -1}, "tolerances must be positive, found rtol = 1e-06, atol = -1$"),
    ({"q1": [1, 2]}, {"chunk": 0}, "chunk must be a whole number from 1 on"),
    ({"q1": [1, 2]}, {"executor": 3}, "an executor must be"),
    ({"q1": [1, 2]}, {"params": {"m9": 1}}, "there is no 'm9'"),
])
def test_what_does_not_fit_is_reported_at_once(module, samples, options, message):
    with pytest.raises(ArgumentError, match=message):
        sd.ensemble(module, samples, **{"t": T, **options})


def test_an_unknown_option_is_an_error(module):
    with pytest.raises(TypeError, match="unexpected keyword argument 'rtoll'"):
        sd.ensemble(module, {"q1": [1, 2]}, T, rtoll=1)


def test_what_is_no_mechanism_is_rejected():
    with pytest.raises(ArgumentError, match="needs a Module or a System, found 3"):
        sd.ensemble(3, {"q1": [1, 2]})


# -- executors


def test_processes_give_the_same_file(module, tmp_path):
    here = sd.ensemble(module, drawn(), T, {"end": "end q1", "far": farthest}, chunk=10, path=tmp_path / "here")
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        there = sd.ensemble(module, drawn(), T, {"end": "end q1", "far": farthest}, chunk=10, path=tmp_path / "there",
                            executor=pool)
    assert here.file.read_bytes() == there.file.read_bytes()


class Mortal(ThreadPoolExecutor):
    """Dies after some tasks; those that it has are lost, as with a pool of processes."""

    def __init__(self, life):
        super().__init__(1)
        self.life = life

    def submit(self, function, *arguments):
        if self.life <= 0:
            future = Future()
            future.set_exception(BrokenExecutor("a worker was killed"))
            return future
        self.life -= 1
        return super().submit(function, *arguments)


def test_what_was_done_by_an_executor_that_died_is_kept(module, tmp_path):
    whole = sd.ensemble(module, drawn(), T, chunk=5, path=tmp_path / "whole")
    with pytest.raises(EnsembleStopped, match=r"the executor died: a worker was killed; \d+ of 40 samples are kept in") as stop:
        sd.ensemble(module, drawn(), T, chunk=5, path=tmp_path / "part", executor=Mortal(3), outstanding=1)
    assert stop.value.n_done == 15 and stop.value.count == 40
    again = sd.ensemble(module, drawn(), T, path=tmp_path / "part", resume=True)
    assert again.n_resumed == 15 and again.file.read_bytes() == whole.file.read_bytes()


def test_a_function_that_makes_executors_is_asked_again(module, tmp_path):
    made = []

    def make():
        made.append(Mortal(3))
        return made[-1]

    whole = sd.ensemble(module, drawn(), T, chunk=5)
    done = sd.ensemble(module, drawn(), T, chunk=5, executor=make, outstanding=2)
    assert len(made) >= 3 and done.file.read_bytes() == whole.file.read_bytes()
    with pytest.raises(EnsembleStopped, match="tried 3 times: BrokenExecutor: a worker was killed; 0 of 40 samples were"):
        sd.ensemble(module, drawn(), T, executor=lambda: Mortal(0))
    shut = ThreadPoolExecutor(1)
    shut.shutdown()
    with pytest.raises(EnsembleStopped, match="the executor died: cannot schedule new futures after shutdown"):
        sd.ensemble(module, drawn(), T, executor=shut)


class Unlucky(ThreadPoolExecutor):
    """Every task fails a number of times before it is done."""

    def __init__(self, times):
        super().__init__(1)
        self.times, self.seen = times, {}

    def submit(self, function, chunk):
        self.seen[chunk.index] = self.seen.get(chunk.index, 0) + 1
        if self.seen[chunk.index] > self.times:
            return super().submit(function, chunk)
        future = Future()
        future.set_exception(MemoryError("no room"))
        return future


def test_a_chunk_that_a_worker_lost_is_tried_again(module):
    unlucky = Unlucky(2)
    done = sd.ensemble(module, drawn(), T, chunk=10, executor=unlucky)
    assert done.n_failed == 0 and set(unlucky.seen.values()) == {3}
    with pytest.raises(EnsembleStopped, match=r"samples \d+ to \d+ cannot be computed, tried 3 times: MemoryError: no room"):
        sd.ensemble(module, drawn(), T, chunk=10, executor=Unlucky(3))


class Counting(ThreadPoolExecutor):
    """Knows how many tasks were ever unfinished at a time."""

    most = 0

    def __init__(self):
        super().__init__(1)
        self.open = 0

    def submit(self, *arguments):
        self.open += 1
        self.most = max(self.most, self.open)
        future = super().submit(*arguments)
        future.add_done_callback(self._closed)
        return future

    def _closed(self, _):
        self.open -= 1


def test_a_bounded_number_of_chunks_is_handed_over(module):
    counting = Counting()
    sd.ensemble(module, drawn(), T, chunk=1, executor=counting, outstanding=4)
    assert counting.most <= 4


# -- the folder


def test_a_full_disk_is_reported_and_what_is_there_is_kept(module, tmp_path, monkeypatch):
    whole = sd.ensemble(module, drawn(), T, chunk=10, path=tmp_path / "whole")
    write, written = store.write_archive, []

    def full(path, entries):
        if len(written) == 2:
            raise OSError(errno.ENOSPC, "No space left on device")
        written.append(path)
        write(path, entries)

    monkeypatch.setattr(store, "write_archive", full)
    with pytest.raises(EnsembleStopped, match=r"the disk is full .*; 20 of 40 samples are kept in .*; pass resume=True"):
        sd.ensemble(module, drawn(), T, chunk=10, path=tmp_path / "part", outstanding=1)
    monkeypatch.undo()
    again = sd.ensemble(module, drawn(), T, chunk=10, path=tmp_path / "part", resume=True)
    assert again.n_resumed == 20 and again.file.read_bytes() == whole.file.read_bytes()


def test_a_disk_that_is_full_half_way_through_a_file_leaves_no_part_of_it(tmp_path):
    def fill(file):
        file.write(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError):
        store.write_whole(tmp_path / "a", fill)
    assert not list(tmp_path.iterdir())


def test_a_damaged_chunk_is_computed_again(module, tmp_path):
    whole = sd.ensemble(module, drawn(), T, chunk=10, path=tmp_path / "whole")
    with pytest.raises(EnsembleStopped):
        sd.ensemble(module, drawn(), T, chunk=10, path=tmp_path / "part", executor=Mortal(3), outstanding=1)
    damaged = sorted((tmp_path / "part" / "chunks").glob("*.npz"))[0]
    content = bytearray(damaged.read_bytes())
    content[200] ^= 1
    damaged.write_bytes(bytes(content))
    again = sd.ensemble(module, drawn(), T, chunk=10, path=tmp_path / "part", resume=True)
    assert again.n_resumed == 20 and again.file.read_bytes() == whole.file.read_bytes()


def test_only_the_same_ensemble_is_gone_on_with(module, tmp_path):
    folder = tmp_path / "a"
    first = sd.ensemble(module, drawn(), T, chunk=10, path=folder)
    with pytest.raises(ArgumentError, match="holds an ensemble already"):
        sd.ensemble(module, drawn(), T, chunk=10, path=folder)
    same = sd.ensemble(module, drawn(), T, path=folder, resume=True)
    assert same.n_resumed == 40 and np.array_equal(same["end q1"], first["end q1"])
    with pytest.raises(ArgumentError, match=r"(?s)holds another ensemble.*chunk: 10 there, 20 now.*options: .*rtol") as error:
        sd.ensemble(module, drawn(), T, chunk=20, path=folder, resume=True, rtol=1e-6)
    assert len(str(error.value).splitlines()) == 3
    (folder / "chunks").mkdir()  # as after a kill just before they were removed
    assert sd.ensemble(module, drawn(), T, path=folder, resume=True).n_resumed == 40 and not (folder / "chunks").exists()
    (tmp_path / "c").mkdir()
    (tmp_path / "c" / ".manifest.json.tmp").write_text("{")  # as after a kill at the very beginning
    assert sd.ensemble(module, drawn(), T, path=tmp_path / "c").file.read_bytes() == first.file.read_bytes()
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "letter.txt").write_text("dear")
    with pytest.raises(ArgumentError, match="is not empty, and holds no ensemble"):
        sd.ensemble(module, drawn(), T, path=tmp_path / "b")
    (folder / "manifest.json").write_text("{")
    with pytest.raises(ArgumentError, match=r"manifest.json cannot be read"):
        sd.ensemble(module, drawn(), T, path=folder, resume=True)


def test_a_changed_function_is_another_ensemble(module, tmp_path):
    def asked(factor):
        return {"widest": lambda solution: factor * solution["q1"].max()}

    first = sd.ensemble(module, drawn(), T, asked(1), path=tmp_path / "a")
    assert sd.ensemble(module, drawn(), T, asked(1), path=tmp_path / "a", resume=True).n_resumed == first.count
    differ = r'holds another ensemble.*\n  functions: {"widest": "\w+"} there, {"widest": "\w+"} now$'
    with pytest.raises(ArgumentError, match=differ):
        sd.ensemble(module, drawn(), T, asked(2), path=tmp_path / "a", resume=True)


def test_one_run_at_a_time_in_a_folder(module, tmp_path):
    folder, told = tmp_path / "deep" / "a", []

    def other(solution):
        if not told:
            with pytest.raises(ArgumentError, match=r"another run is at work in .*a: .*wait until it has ended, or name another"):
                sd.ensemble(module, drawn(), T, path=folder, resume=True)
            told.append(True)
        return solution["q1"].max()

    sd.ensemble(module, drawn(), T, {"widest": other}, path=folder, executor=ThreadPoolExecutor(1))
    assert told and sd.ensemble(module, drawn(), T, {"widest": other}, path=folder, resume=True).n_resumed == 40
    (tmp_path / "file").write_text("")
    for path, message in ((tmp_path / "file", r"the folder .*file cannot be used \(File exists\)"),
                          (3, r"the path is 3; pass that of a folder"), ("a\0b", r"the path is 'a\\x00b'")):
        with pytest.raises(ArgumentError, match=message):
            sd.ensemble(module, drawn(), T, path=path)
    with pytest.raises(ArgumentError, match="holds another"):
        sd.ensemble(module, drawn(), T, path=folder, resume=True)
    with pytest.raises(ArgumentError, match="none of 1 samples"):
        sd.ensemble(module, {"m1": [np.nan]}, T, path=tmp_path / "b")
    assert folder.exists() and not (tmp_path / "b").exists()  # where nothing was written nothing is left


def test_a_forked_worker_does_not_hold_the_lock(tmp_path):
    ready, tell = os.pipe()
    with OneRun(tmp_path):
        child = os.fork()
        if child == 0:
            os.write(tell, b"!")
            time.sleep(30)
            os._exit(0)
        assert os.read(ready, 1) == b"!"
    try:
        with OneRun(tmp_path), pytest.raises(ArgumentError, match="another run"), OneRun(tmp_path):
            pass
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)


def test_results_are_read_with_numpy_alone(module, tmp_path):
    done = sd.ensemble(module, drawn(), T, ["end q1", "trace q2"], chunk=7, path=tmp_path / "a")
    with np.load(tmp_path / "a" / "ensemble.npz") as file:
        assert set(file.files) == {"samples", "end q1", "trace q2", "failed", "t", "about"}
        assert np.array_equal(file["end q1"], done["end q1"])
    assert sorted(p.name for p in (tmp_path / "a").iterdir()) == ["ensemble.npz", "failures.jsonl", "manifest.json"]
    assert np.array_equal(thinned(done.file, "trace q2", 3), done["trace q2"][::3])
    with pytest.raises(ArgumentError, match="did you mean end q1"):
        done["ende q1"]
    assert "40 members" in repr(done)


def test_a_temporary_folder_goes_with_the_result(module):
    done = sd.ensemble(module, {"q1": [0.1, 0.2]}, T)
    folder = done.path
    assert folder.is_dir()
    del done
    assert not folder.exists()


def test_a_bar_counts_samples(module, capsys):
    sd.ensemble(module, {"q1": [0.1, 0.2, 0.3]}, T, progress=True)
    assert "3/3" in capsys.readouterr().err


def test_the_picture_has_quantiles_and_points(module, tmp_path):
    done = sd.ensemble(module, drawn(), np.linspace(0, 1, 11), ["trace q1", "end q2", "mean energy"])
    figure = done.plot(tmp_path / "a.png", [("l1", "end q2"), ("end q2", "mean energy")])
    over_time, points, other = figure.axes
    assert np.allclose(over_time.lines[0].get_ydata(), np.median(done["trace q1"], axis=0))
    assert np.array_equal(points.lines[0].get_xydata(), np.column_stack([done["l1"], done["end q2"]]))
    assert other.get_ylabel() == "mean energy [J]" and (tmp_path / "a.png").stat().st_size > 10_000
    assert len(done.plot().axes) == 1 + 2 * 3
    with pytest.raises(ArgumentError, match="trace q1: points need"):
        done.plot(scatter=[("l1", "trace q1")])


def test_ctrl_c_keeps_what_was_done(module, tmp_path, monkeypatch):
    whole = sd.ensemble(module, drawn(), T, chunk=10)
    put, seen = store.Store.put, []

    def interrupted(self, done):
        if len(seen) == 2:
            raise KeyboardInterrupt
        seen.append(done)
        put(self, done)

    monkeypatch.setattr(store.Store, "put", interrupted)
    with pytest.raises(KeyboardInterrupt, match="interrupted; 20 of 40 samples are kept in"):
        sd.ensemble(module, drawn(), T, chunk=10, path=tmp_path)
    monkeypatch.undo()
    again = sd.ensemble(module, drawn(), T, path=tmp_path, resume=True)
    assert again.n_resumed == 20 and again.file.read_bytes() == whole.file.read_bytes()


# -- modules that are sent


class Sending(ThreadPoolExecutor):
    """Its arguments go through bytes, as between processes."""

    def submit(self, function, chunk):
        return super().submit(function, pickle.loads(pickle.dumps(chunk)))


def test_what_a_worker_lacks_is_no_fault_of_its_members(module, monkeypatch):
    here = sd.ensemble(module, drawn(), T, ["max energy"])
    assert sd.ensemble(module, drawn(), T, ["max energy"], executor=Sending(1)).file.read_bytes() == here.file.read_bytes()

    def nothing():
        raise CompilerNotFound("there is no C compiler")

    monkeypatch.setattr(texts, "require_compiler", nothing)
    portable._module.cache_clear()
    with pytest.raises(EnsembleStopped, match="tried 3 times: CompilerNotFound: there is no C compiler"):
        sd.ensemble(module, drawn(), T, ["max energy"], executor=Sending(1))


def test_a_function_that_was_not_sent_is_named(module):
    bare = portable.PortableModule(recall("double_pendulum", {}), ["rhs"])
    arrived = pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(bare))))  # handed on by a scheduler
    assert np.array_equal(arrived.module.rhs(0, [0.1, 0.2, 0, 0]), module.rhs(0, [0.1, 0.2, 0, 0]))
    with pytest.raises(portable.NotSent, match="double_pendulum: mass_matrix was not sent along"):
        arrived.module.mass_matrix([0.1, 0.2])


# -- several at once


def test_motions_on_vectors_have_the_outcomes_of_single_ones(module, monkeypatch):
    angles = np.linspace(-1, 1, 20)
    angles[7] = np.nan
    samples = {"q1": angles, "l1": np.linspace(0.5, 1.5, 20)}
    outcomes = {"end": "end q1", "mean": "mean q2", "at": "q2_dot at 0.2", "all": "trace q1", "energy": "max energy"}
    one = sd.ensemble(module, samples, np.linspace(0, 0.5, 6), outcomes, chunk=9)
    monkeypatch.setattr(plan, "VECTORS_FROM", 1)
    monkeypatch.setattr(chunk, "NUMBERS", 150)  # six motions at a time
    monkeypatch.setattr(chunk, "motion", None)  # which would simulate one alone
    several = sd.ensemble(module, samples, np.linspace(0, 0.5, 6), outcomes, chunk=9)
    assert several.failures() == one.failures() and {f["index"] for f in one.failures()} == {7}
    for label in ("end", "at", "all", "energy"):
        assert np.array_equal(one[label], several[label], equal_nan=True), label
    np.testing.assert_allclose(several["mean"], one["mean"], rtol=1e-13)


@pytest.mark.parametrize("method", ["dop853", "bs54"])
def test_functions_get_motions_of_their_own_however_many_samples_there_are(monkeypatch, method):
    four_bar = recall("four_bar", {})
    outcomes = {"moved": lambda sol: sol.corrections.position, "evaluations": lambda sol: sol.nfev, "fine": middle,
                "rtol": lambda sol: sol.tolerances[0], "method": lambda sol: float(sol.method == method)}
    monkeypatch.setattr(plan, "VECTORS_FROM", 4)
    few, many = (sd.ensemble(four_bar, {"g": np.linspace(9, 10, 5)[:n]}, (0, 0.1), outcomes, method=method) for n in (3, 5))
    assert few.n_failed == many.n_failed == 0 and (many["method"] == 1).all() and (many["rtol"] == 1e-8).all()
    motion = four_bar.simulate((0, 0.1), params={"g": 10.0}, method=method)
    assert many["evaluations"][4] == motion.nfev > 0 and many["moved"][4] == motion.corrections.position > 0
    for label in outcomes:
        assert np.array_equal(many[label][:3], few[label]), label


def middle(solution):
    return solution(np.linspace(0, 0.1, 7))[:, 0].max()


def test_motions_on_vectors_that_cannot_be_computed_are_failures(module, monkeypatch):
    monkeypatch.setattr(plan, "VECTORS_FROM", 1)
    done = sd.ensemble(module, {"m1": [1.0, 0.0, 1.0], "m2": [1.0, 0.0, 2.0], "I1": [0.1, 0.0, 0.1], "I2": [0.1, 0.0, 0.1]}, T)
    assert done.failed.tolist() == [False, True, False]
    assert "double_pendulum" in done.failures()[0]["message"]


@pytest.mark.parametrize("name, options, expected", [
    ("double_pendulum", {"rtol": 1e-6}, True), ("double_pendulum", {"max_steps": 5}, False), ("four_bar", {}, True),
    ("four_bar", {"stabilization": "none"}, False), ("double_pendulum", {"method": "bs54"}, True),
    ("double_pendulum", {"method": "radau"}, False)])
def test_vectors_serve_where_they_take_the_same_steps(name, options, expected):
    assert chunk.vectors_serve(recall(name, {}), False, options, ()) is expected
    assert not chunk.vectors_serve(recall(name, {}), False, options, [Measure("far", "function", function=farthest)])


def test_vectors_serve_events_that_outcomes_need_no_times_of():
    z = sd.coordinates("z")
    served = []
    for stop in (False, True):
        system = sd.System("ball", gravity=[0, 0, -10])
        system.add_joint(sd.Prismatic("fall", system.ground, system.add_body("ball", mass=1), z, axis=[0, 0, 1]))
        system.add_event("floor", z, direction=-1, stop=stop, reset={} if stop else {z.dot: -z.dot / 2})
        module = system.embedding().compile(backend="c")
        served += [chunk.vectors_serve(module, False, options, take_measures(outcomes, module)) for options, outcomes in (
            ({}, ["end z"]), ({}, ["end z", "mean energy"]), ({"events": False}, ["mean energy"]))]
    assert served == [True, False, True, False, False, True]


# -- far tails and larger counts


@pytest.mark.parametrize("low, high", [
    (9, 12), (-12, -9), (-1, 2), (-1, 40), (30, 31), (-31, -30), (30, 30.01), (-40, 40), (38, 1e6)])
def test_truncated_normal_is_exact_in_every_tail(low, high):
    """Mean, variance and distribution function against 40 digits; the standard deviation is 0.5, the mean 2."""
    own = mpmath.mp.clone()
    own.dps = 40
    ends = {"from": 2 + low / 2, "to": 2 + high / 2}
    n = 400
    axis = read_axis({"distribution": "truncated_normal", "mean": 2, "std": 0.5, **ends}, "x", [])
    values = axis.quantile((np.arange(n) + 0.5) / n)
    a, b = ((own.mpf(ends[end]) - 2) * 2 for end in ("from", "to"))
    mirrored = a > 0

    def below(z):
        return own.erfc(z / own.sqrt(2)) / -2 if mirrored else own.erfc(-z / own.sqrt(2)) / 2

    whole = below(b) - below(a)
    distances = [abs(float((below((own.mpf(float(v)) - 2) * 2) - below(a)) / whole - own.mpf(2 * k + 1) / (2 * n)))
                 for k, v in enumerate(values)]
    assert max(distances) < 5e-12
    mean = float(2 + (own.npdf(a) - own.npdf(b)) / whole / 2)
    assert values.mean() == pytest.approx(mean, abs=2e-3 * float(values.max() - values.min()))
    assert ends["from"] <= values.min() < values.max() <= ends["to"] and len(set(values)) == n


def test_the_upper_tail_has_the_published_mean():
    """phi(9)/(1 - Phi(9)) = 9.10852..., from 9 to 12 the same to 1e-13."""
    drawn = sd.Samples({"x": {"distribution": "truncated_normal", "mean": 0, "std": 1, "from": 9, "to": 12}}, count=4000, seed=3)
    x = drawn.block(0, 4000)[:, 0]
    assert x.mean() == pytest.approx(9.1085231, abs=4 * 0.1068 / np.sqrt(4000)) and (x < 12).all()


@pytest.mark.parametrize("sampling, same", [("random", True), ("sobol", True), ("latin_hypercube", False)])
def test_which_samples_stay_with_a_larger_count(sampling, same):
    few, many = (sd.Samples({"x": {"from": 0, "to": 1}, "y": {"from": 2, "to": 3}}, sampling, count=count, seed=4).block(0, 16)
                 for count in (16, 64))
    assert np.array_equal(few, many) is same
    assert "Latin hypercube depends on" in " ".join(sd.Samples.__doc__.split())
