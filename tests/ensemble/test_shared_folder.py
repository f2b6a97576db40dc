"""Workers that share a folder: claims that end, workers that are killed and that come late, and nothing that is counted twice."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter

import numpy as np
import pytest

import symdyn as sd
from symdyn.ensembles import exports, run
from symdyn.ensembles.claims import ATTEMPTS, Claims, Heartbeat
from symdyn.ensembles.lock import OneRun
from symdyn.ensembles.progress import read_status
from symdyn.errors import ArgumentError, EnsembleStopped, SimulationWarning
from symdyn.runtime.building.recall import recall


def age(claims, piece, seconds):
    """Let a claim be as old as if its worker had been silent for so long."""
    path = claims._own[piece]
    os.utime(path, (time.time() - seconds,) * 2)


def test_a_piece_is_claimed_once_however_many_try(tmp_path):
    pieces = [str(k) for k in range(120)]
    taken = []

    def work(name):
        with Claims(tmp_path, name) as claims:
            while (piece := claims.take(pieces)) is not None:
                taken.append(piece)
            ready.wait()

    ready = threading.Barrier(6)
    threads = [threading.Thread(target=work, args=(str(k),)) for k in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(taken) == sorted(pieces)
    assert not list((tmp_path / "claims").iterdir())  # what was claimed was given back


def test_a_claim_ends_with_its_lease_and_not_before(tmp_path):
    with Claims(tmp_path, "a", 60) as a, Claims(tmp_path, "b", 60) as b:
        assert a.take(["1", "2"]) == "1" and b.take(["1", "2"]) == "2"
        assert b.take(["1", "2"]) is None and b.at_work() == ["1"]
        age(a, "1", 50)
        assert b.take(["1"]) is None
        age(a, "1", 70)
        a.touch()
        assert b.take(["1"]) is None
        age(a, "1", 70)
        assert b.at_work() == [] and b.take(["1"]) == "1"
        a.release("1")  # that of a alone
        assert a.take(["1"]) is None


def test_a_piece_that_ends_its_workers_is_given_up(tmp_path):
    with Claims(tmp_path, "a", 60) as judge:
        for k in range(ATTEMPTS):
            assert judge.given_up() == []
            worker = Claims(tmp_path, f"w{k}", 60).__enter__()
            assert worker.take(["7"]) == "7"
            age(worker, "7", 70)
        assert judge.given_up() == ["7"] and judge.take(["7"]) is None
        judge.forget_ended()
        assert judge.take(["7"]) == "7"


def test_a_heartbeat_ends_with_its_context():
    beats = []
    with Heartbeat(0.01, lambda: beats.append(1)):
        while len(beats) < 3:
            time.sleep(0.005)
    n = len(beats)
    time.sleep(0.05)
    assert len(beats) == n


def test_those_who_share_a_folder_keep_others_out(tmp_path):
    with OneRun(tmp_path, shared=True), OneRun(tmp_path, shared=True), OneRun(tmp_path, shared=True), \
            pytest.raises(ArgumentError, match=r"another run is at work in .*two would write the same files"), OneRun(tmp_path):
        pass
    with OneRun(tmp_path), OneRun(tmp_path / "other"), \
            pytest.raises(ArgumentError, match=r"another run is at work in .*it does not share its work"), \
            OneRun(tmp_path, shared=True):
        pass


SCRIPT = """
import os, sys, time
import symdyn as sd
from symdyn.ensembles import run
from symdyn.runtime.building.recall import recall

run.LEASE, run.LOOK = 1.0, 0.05
folder = sys.argv[1]


def end(solution):
    time.sleep(float(os.environ["SLOW"]))
    line = f"{solution.q[0, 0]:.17g} {os.getpid()}\\n"
    os.write(log, line.encode())
    return solution.q[-1, 0]


log = os.open(folder + ".log", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
drawn = sd.Samples({"q1": {"from": -1, "to": 1}}, "random", 60, 2)
from concurrent.futures import ThreadPoolExecutor
done = sd.ensemble(recall("double_pendulum", {}), drawn, (0, 0.1), {"end": end}, chunk=3, path=folder, shared=True,
                   executor=lambda: ThreadPoolExecutor(1))
print(done.count)
"""


def worker(tmp_path, slow):
    (tmp_path / "script.py").write_text(SCRIPT)
    return subprocess.Popen([sys.executable, str(tmp_path / "script.py"), str(tmp_path / "out")], stdout=subprocess.PIPE,
                            env={**os.environ, "SLOW": str(slow)})


def chunks_in(folder):
    return len(list((folder / "chunks").glob("0*.npz")))


@pytest.mark.skipif(os.name != "posix", reason="kill -9 is of POSIX")
def test_a_killed_worker_is_replaced_and_a_late_one_helps(tmp_path):
    out = tmp_path / "out"
    first, second = worker(tmp_path, 0.02), worker(tmp_path, 0.05)
    # One motion of each process is tried in advance.
    while first.poll() is None and second.poll() is None and (
            chunks_in(out) < 4 or min(Counter(pid for _, pid in lines(tmp_path))[k.pid] for k in (first, second)) < 2):
        time.sleep(0.005)
    second.send_signal(signal.SIGKILL)
    second.wait()
    status = read_status(out)
    assert not status.complete and 12 <= status.n_done < 60 and len(status.workers) == 2
    late = worker(tmp_path, 0.02)
    said = [process.communicate(timeout=60)[0] for process in (first, late)]
    assert said == [b"60\n", b"60\n"]
    assert sorted(p.name for p in out.iterdir()) == ["ensemble.npz", "failures.jsonl", "manifest.json"]
    by = Counter(pid for _, pid in lines(tmp_path))
    assert set(by) == {first.pid, second.pid, late.pid}
    # Each once, but for the one that is tried in advance, and the chunk that was begun by the one that was killed.
    drawn = sd.Samples({"q1": {"from": -1, "to": 1}}, "random", 60, 2)
    again = {start for start, n in Counter(start for start, _ in lines(tmp_path)).items() if n > 1}
    assert len(again - {drawn.block(0, 1)[0, 0]}) <= 3 and len({start for start, _ in lines(tmp_path)}) == 60
    here = sd.ensemble(recall("double_pendulum", {}), drawn, (0, 0.1), {"end": "end q1"}, chunk=3)
    with np.load(out / "ensemble.npz") as found:
        assert np.array_equal(found["samples"], here.samples) and np.array_equal(found["end"], here["end"])
    assert read_status(out).complete


def lines(tmp_path):
    """Start and process of every motion that was computed."""
    path = tmp_path / "out.log"
    found = [line.split() for line in path.read_text().splitlines()] if path.exists() else []
    return [(float(start), int(pid)) for start, pid in found]


@pytest.fixture(scope="module")
def module():
    return recall("double_pendulum", {})


def drawn():
    return sd.Samples({"q1": {"from": -1, "to": 1}}, "random", 40, 2)


def test_a_damaged_chunk_is_computed_again_before_all_is_put_together(module, tmp_path, monkeypatch):
    whole = sd.ensemble(module, drawn(), (0, 0.1), chunk=10)
    finish, seen = run._Run._finish, []

    def damaging(self):
        seen.append(True)
        finish(self)

    put, spoiled = run.Store.put, []

    def put_badly(self, done):
        put(self, done)
        if done.index == 2 and not spoiled:
            spoiled.append(True)
            content = bytearray(self._path(2).read_bytes())
            content[200] ^= 1
            self._path(2).write_bytes(bytes(content))

    monkeypatch.setattr(run._Run, "_finish", damaging)
    monkeypatch.setattr(run.Store, "put", put_badly)
    done = sd.ensemble(module, drawn(), (0, 0.1), chunk=10, path=tmp_path, shared=True)
    assert spoiled and len(seen) == 1 and done.file.read_bytes() == whole.file.read_bytes()


def test_a_chunk_that_has_ended_three_workers_stops_those_who_share_it(module, tmp_path, monkeypatch):
    asked = run.plan(module, drawn(), (0, 0.1), chunk=10)
    run.prepare(asked, tmp_path, False)
    for k in range(ATTEMPTS):
        dead = Claims(tmp_path, f"dead{k}").__enter__()
        assert dead.take(["00000003"])
        age(dead, "00000003", 500)
    with pytest.raises(EnsembleStopped, match=r"3 workers ended while they computed samples 30 to 39, which nobody tries again"
                       r": .*fewer samples in a chunk.*; 30 of 40 samples are kept in"):
        sd.ensemble(module, drawn(), (0, 0.1), chunk=10, path=tmp_path, shared=True)


def test_results_are_put_together_by_another_worker_than_the_one_that_was_killed(module, tmp_path):
    asked = run.plan(module, drawn(), (0, 0.1), chunk=10)
    run.prepare(asked, tmp_path, False)
    with Claims(tmp_path, "other", 60) as other:
        assert other.take([run.MERGE]) == run.MERGE
        with pytest.raises(run.StillAtWork, match="nothing is left to begin; other workers have begun to put the results"):
            run.run(asked, tmp_path, run.How(lease=60.0, stays=False), True)
        age(other, run.MERGE, 70)
        assert run.run(asked, tmp_path, run.How(lease=60.0), True).count == 40
    run.prepare(asked, tmp_path / "again", False)
    for k in range(ATTEMPTS):
        dead = Claims(tmp_path / "again", f"dead{k}").__enter__()
        dead.take([run.MERGE])
        age(dead, run.MERGE, 500)
    with pytest.raises(EnsembleStopped, match=r"3 workers ended while they put the results together, which nobody tries again"):
        run.run(asked, tmp_path / "again", run.How(lease=60.0), True)


@pytest.fixture
def exported(monkeypatch):
    """Workers that have begun to write a format of these tests, which takes a while."""
    begun = []

    def write(ensemble, path):
        begun.append(threading.get_ident())
        time.sleep(0.3)
        path.write_bytes(ensemble.file.read_bytes())

    monkeypatch.setitem(exports.EXPORTS, "copy", exports.Export("ensemble.copy", "numpy", "", write))
    monkeypatch.setattr(run, "LOOK", 0.02)
    return begun


def test_workers_that_come_late_leave_the_export_to_the_one_that_has_begun_it(module, tmp_path, exported):
    asked = run.plan(module, drawn(), (0, 0.1), chunk=10)
    first = threading.Thread(target=lambda: run.run(asked, tmp_path, run.How(formats=("copy",), lease=60.0), True))
    first.start()
    while not exported:
        time.sleep(0.002)
    with pytest.raises(run.StillAtWork, match="nothing is left to begin; other workers have begun to put the results together"):
        run.run(asked, tmp_path, run.How(formats=("copy",), lease=60.0, stays=False), True)
    found = []
    late = [threading.Thread(target=lambda: found.append(run.run(asked, tmp_path, run.How(formats=("copy",), lease=60.0), True)))
            for _ in range(3)]
    for thread in late:
        thread.start()
    for thread in [first, *late]:
        thread.join()
    assert len(exported) == 1 and len(found) == 3 and all(done.n_resumed == 40 for done in found)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["ensemble.copy", "ensemble.npz", "failures.jsonl", "manifest.json"]


def test_the_export_of_a_worker_that_was_killed_is_taken_over_when_its_claim_ends(module, tmp_path, exported, monkeypatch):
    asked = run.plan(module, drawn(), (0, 0.1), chunk=10)
    run.run(asked, tmp_path, run.How(lease=60.0), True)  # chunks and claims are gone
    monkeypatch.setattr(run, "run_chunks", None)  # none is computed again
    how = run.How(formats=("copy",), lease=60.0, stays=False)
    with Claims(tmp_path, "killed", 60) as killed:
        assert killed.take([run.MERGE])
        with pytest.raises(run.StillAtWork, match="other workers have begun to put the results together"):
            run.run(asked, tmp_path, how, True)
        assert not exported
        age(killed, run.MERGE, 70)
        assert run.run(asked, tmp_path, how, True).n_resumed == 40
    assert len(exported) == 1 and (tmp_path / "ensemble.copy").is_file()


def test_the_bar_of_each_counts_what_all_have_done(module, tmp_path, capsys):
    asked = run.plan(module, drawn(), (0, 0.1), chunk=10)
    run.prepare(asked, tmp_path, False)
    with Claims(tmp_path, "other", 60) as other:
        other.take(["00000001"])
        with pytest.raises(run.StillAtWork):
            run.run(asked, tmp_path, run.How(lease=60.0, stays=False, progress=True), True)
    assert "30/40" in capsys.readouterr().err
    sd.ensemble(module, drawn(), (0, 0.1), chunk=10, path=tmp_path, shared=True, progress=True)
    assert "40/40" in capsys.readouterr().err


def test_a_warning_is_given_where_the_ensemble_was_asked_for(module, tmp_path, monkeypatch):
    monkeypatch.setattr(run._Run, "_doubts", lambda self: "doubtful")
    for path in (None, tmp_path / "a"):
        with pytest.warns(SimulationWarning, match="double_pendulum: doubtful") as record:
            sd.ensemble(module, drawn(), (0, 0.1), path=path)
        assert [warning.filename for warning in record] == [__file__]


def test_a_worker_that_does_not_stay_leaves_what_others_have(module, tmp_path):
    asked = run.plan(module, drawn(), (0, 0.1), chunk=10)
    run.prepare(asked, tmp_path, False)
    with Claims(tmp_path, "other") as other:
        assert other.take(["00000001"])
        with pytest.raises(run.StillAtWork, match="nothing is left to begin; other workers have 10 of 40 samples at work"):
            run.run(asked, tmp_path, run.How(lease=60.0, stays=False), True)
    assert chunks_in(tmp_path) == 3
    assert run.run(asked, tmp_path, run.How(lease=60.0, stays=False), True).count == 40


def test_another_ensemble_does_not_join(module, tmp_path):
    sd.ensemble(module, drawn(), (0, 0.1), chunk=10, path=tmp_path, shared=True)
    with pytest.raises(ArgumentError, match="holds another ensemble"):
        sd.ensemble(module, drawn(), (0, 0.2), chunk=10, path=tmp_path, shared=True)
    with pytest.raises(ArgumentError, match="shared=True without a path; pass that of a folder that all processes reach"):
        sd.ensemble(module, drawn(), (0, 0.1), shared=True)


def test_status_counts_what_all_workers_have_done(module, tmp_path):
    with pytest.raises(ArgumentError, match="holds no ensemble: nothing has begun there yet; start it without --status"):
        read_status(tmp_path)
    asked = run.plan(module, drawn(), (0, 0.1), chunk=10)
    run.prepare(asked, tmp_path, False)
    assert read_status(tmp_path).n_done == 0
    (tmp_path / "chunks").mkdir()
    for k in (0, 3):
        (tmp_path / "chunks" / f"{k:08d}.npz").touch()
    (tmp_path / "workers").mkdir()
    for name, n, silent in (("a-1-x", 20, 0), ("b-2-x", 10, 500)):
        path = tmp_path / "workers" / f"{name}.json"
        path.write_text(json.dumps({"state": "at work", "begun": 100.0, "now": 110.0, "count": {name[:3]: n}, "failed": 1,
                                    "task": "7_1"}))
        os.utime(path, (time.time() - silent,) * 2)
    status = read_status(tmp_path)
    assert (status.count, status.n_done, status.n_failed, status.complete) == (40, 20, 2, False)
    assert [(w.name, w.samples, w.rate, w.lost, w.task) for w in status.workers] == [("a-1", 20, 2.0, False, "7_1"),
                                                                                     ("b-2", 10, 1.0, True, "7_1")]
    assert status.rate == 2.0
    (tmp_path / "manifest.json").write_text("{")
    with pytest.raises(ArgumentError, match=r"manifest.json cannot be read"):
        read_status(tmp_path)
