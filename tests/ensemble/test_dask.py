"""Ensembles on clusters: Dask with a worker that is killed, and the executor of mpi4py."""

from __future__ import annotations

import itertools
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import symdyn as sd
from symdyn.cli import main
from symdyn.ensembles import dispatch, run
from symdyn.ensembles.plan import plan
from symdyn.ensembles.progress import read_status
from symdyn.runtime.building.recall import recall

COUNT = 400


def samples():
    return sd.Samples({"q1": {"from": -1, "to": 1}, "l1": {"from": 0.5, "to": 1.5}}, "latin_hypercube", COUNT, 2)


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
                                  silence_logs=50) as local:
        yield local


@pytest.mark.skipif(os.name != "posix", reason="kill -9 is of POSIX")
def test_dask_loses_nothing_when_a_worker_is_killed(cluster, tmp_path):
    module = recall("double_pendulum", {})
    here = sd.ensemble(module, samples(), (0, 1), chunk=10)
    killed = []

    def kill():
        while len(list((tmp_path / "chunks").glob("0*.npz"))) < 10:
            time.sleep(0.002)
        worker = next(iter(cluster.workers.values()))
        killed.append(len(list((tmp_path / "chunks").glob("0*.npz"))))
        os.kill(worker.pid, signal.SIGKILL)

    with cluster.get_client() as client:
        killer = threading.Thread(target=kill)
        killer.start()
        done = sd.ensemble(module, samples(), (0, 1), chunk=10, path=tmp_path, executor=client.get_executor())
        killer.join()
    assert 10 <= killed[0] < 40
    assert done.n_failed == 0 and np.isfinite(done["end q1"]).all()
    assert np.array_equal(done.samples, samples().block(0, COUNT))  # all of them, each once
    assert done.file.read_bytes() == here.file.read_bytes()


def test_sweep_on_a_cluster(cluster, tmp_path, capsys):
    (tmp_path / "a.toml").write_text('system = "double_pendulum"\nt = [0, 0.1]\n[initial]\nq1 = [0.1, 0.2]\n')
    asked = ["sweep", str(tmp_path / "a.toml"), "--no-picture", "--output", str(tmp_path / "out"), "--dask"]
    assert main([*asked, cluster.scheduler_address]) == 0
    assert "2 samples of q1, 2 in" in capsys.readouterr().out
    assert main([*asked, "tcp://127.0.0.1:9", "--dask-timeout", "0.2"]) == 1
    assert "--dask tcp://127.0.0.1:9: no scheduler there" in capsys.readouterr().err


def test_a_line_of_the_file_names_the_cluster(cluster, tmp_path, capsys, monkeypatch):
    text = '{line}\nsystem = "double_pendulum"\nt = [0, 0.1]\n[initial]\nq1 = [0.1, 0.2]\n'
    for name, line, address in (("a", f'dask = "{cluster.scheduler_address}"', ""),
                                ("b", 'cluster = "dask"', cluster.scheduler_address)):
        monkeypatch.setitem(dask_config(), "scheduler-address", address)
        (tmp_path / f"{name}.toml").write_text(text.format(line=line))
        assert main(["sweep", str(tmp_path / f"{name}.toml"), "--no-picture", "--output", str(tmp_path / name)]) == 0
        assert "2 samples of q1, 2 in" in capsys.readouterr().out
    assert (tmp_path / "a" / "ensemble.npz").read_bytes() == (tmp_path / "b" / "ensemble.npz").read_bytes()
    (tmp_path / "c.toml").write_text(text.format(line='dask = "tcp://127.0.0.1:9"'))
    assert main(["sweep", str(tmp_path / "c.toml"), "--output", str(tmp_path / "c"), "--dask-timeout", "0.2"]) == 1
    assert "--dask tcp://127.0.0.1:9: no scheduler there" in capsys.readouterr().err


def dask_config():
    """Dask's configuration, by which it finds a scheduler where none is named."""
    import dask

    return dask.config.config


def test_all_workers_of_dask_are_shown_by_the_one_who_asked(cluster, tmp_path, monkeypatch):
    seen = []
    put = run.Store.put
    monkeypatch.setattr(run.Progress, "add", lambda self, done, n, add=run.Progress.add: (add(self, done, n), self.write()))
    monkeypatch.setattr(run.Store, "put", lambda self, done: (put(self, done), seen.append(read_status(tmp_path))))
    with cluster.get_client() as client:
        sd.ensemble(recall("double_pendulum", {}), samples(), (0, 0.1), chunk=10, path=tmp_path, executor=client.get_executor())
    last = seen[-1]
    assert (last.n_done, last.count, last.complete) == (COUNT, COUNT, False)
    assert len(last.workers) == 2 and sum(w.samples for w in last.workers) == COUNT - 10  # the last one is not counted yet
    assert not any(w.lost for w in last.workers) and all(w.samples > 0 for w in last.workers)


def chunks(enough):
    """Chunks of one motion, until there are enough, or a minute is over."""
    asked = plan(recall("double_pendulum", {}), samples(), (0, 0.1), chunk=1).tried()
    end = time.monotonic() + 60
    for k in itertools.count():
        if enough() or time.monotonic() > end:
            return
        yield asked.chunk(k % COUNT, 1)


def test_workers_that_join_get_chunks_and_those_that_leave_get_none(monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(dispatch, "RECOUNT", 0.02)
    handed, outstanding, done = 0, [], []

    def counted(todo):
        nonlocal handed
        for chunk in todo:
            handed += 1
            outstanding.append(handed - len(done))
            yield chunk

    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0",
                                  silence_logs=50) as local, local.get_client() as client:
        def grown():
            return outstanding and outstanding[-1] > dispatch.AHEAD

        def busy():
            return sum(worker.state.executed_count > 0 for worker in local.workers.values())

        for found in dispatch.run_chunks(counted(chunks(lambda: grown() and busy() > 1)), client.get_executor, False):
            done.append(found)
            if len(done) == 1:
                assert max(outstanding) == dispatch.AHEAD
                local.scale(3)
        assert busy() > 1 and dispatch.AHEAD < max(outstanding) <= 3 * dispatch.AHEAD and len(done) == handed
        local.scale(1)
        before = len(outstanding)
        for found in dispatch.run_chunks(counted(chunks(lambda: len(client.nthreads()) == 1 and len(outstanding) > before + 30)),
                                         client.get_executor, False):
            done.append(found)
        assert max(outstanding[-5:]) <= dispatch.AHEAD


CLUSTER = """
import sys, time
from distributed import LocalCluster

with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=":0",
                  silence_logs=50) as cluster:
    print(cluster.scheduler_address, flush=True)
    time.sleep(600)
"""


@pytest.mark.skipif(os.name != "posix", reason="kill -9 is of POSIX")
def test_a_scheduler_that_is_gone_is_reported_in_one_line(tmp_path, capsys):
    pytest.importorskip("distributed")
    path, out = tmp_path / "a.toml", tmp_path / "out"
    path.write_text('system = "double_pendulum"\nt = [0, 1]\nsampling = "random"\ncount = 600\nchunk = 2\n[initial]\n'
                    "q1 = {from = -1, to = 1}\n")
    asked = ["sweep", str(path), "--no-picture", "--output", str(out)]
    over_there = [sys.executable, "-m", "symdyn", *asked, "--dask-timeout", "4"]
    with subprocess.Popen([sys.executable, "-c", CLUSTER], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as there:
        address = there.stdout.readline().strip()
        with subprocess.Popen([*over_there, "--dask", address], stderr=subprocess.PIPE, text=True) as sweep:
            while sweep.poll() is None and len(list((out / "chunks").glob("0*.npz"))) < 20:
                time.sleep(0.002)
            there.kill()
            said = sweep.communicate()[1]
    assert sweep.returncode == 1
    found = re.fullmatch(rf"symdyn: double_pendulum: the ensemble stopped: Dask's scheduler at {address} is gone; "
                         rf"start one again; (\d+) of 600 samples are kept in {out}; "
                         r"pass resume=True \(--resume\) to go on from there\n", said)
    assert found, said
    kept = int(found[1])
    assert 40 <= kept < 600 and len(list((out / "chunks").glob("0*.npz"))) == kept // 2
    assert main([*asked, "--resume", "--jobs", "1"]) == 0
    assert f"600 samples of q1, {kept} of them computed before" in capsys.readouterr().out


LOSS = """
import os, signal, sys, time
from argparse import Namespace
from symdyn.cli.sweep import _executor

process, address = int(sys.argv[1]), sys.argv[2]
with _executor(Namespace(dask=address, dask_timeout=2.0, join=False), None) as executor:
    os.kill(process, signal.SIGKILL)
    for number in range(200):
        executor.submit(abs, number, pure=False)
        time.sleep(0.001)
    time.sleep(1)
"""


@pytest.mark.skipif(os.name != "posix", reason="kill -9 is of POSIX")
def test_what_dask_still_sends_to_a_scheduler_that_is_gone_prints_nothing():
    pytest.importorskip("distributed")
    with subprocess.Popen([sys.executable, "-c", CLUSTER], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as there:
        address = there.stdout.readline().strip()
        asked = [sys.executable, "-c", LOSS, str(there.pid), address]
        assert subprocess.run(asked, capture_output=True, text=True, check=True).stderr == ""


class Client:
    """Stand-in for Dask's: `lost` of its futures have no end when its scheduler is lost, after which it is as `then` says."""

    def __init__(self, lost, then="running"):
        self.lost, self.then, self.status, self.scheduler_comm, self.asked = lost, then, "running", object(), []
        self.scheduler, self.loop = SimpleNamespace(address="tcp://far:1"), self

    def nthreads(self):
        return {"a": 1}

    def submit(self, function, chunk):
        self.asked.append(chunk.index)
        return function, chunk

    def add_callback(self, follow, asked, result):
        if len(self.asked) > self.lost:
            result.set_result(asked[0](asked[1]))
        elif len(self.asked) == self.lost:
            self.status = "connecting"
            threading.Timer(0.05, self.connect).start()

    def connect(self):
        self.status, self.scheduler_comm = self.then, object()

    def get_executor(self):
        return SimpleNamespace(_client=self, _kwargs={})


def test_a_scheduler_that_comes_back_gets_all_chunks_again(monkeypatch):
    monkeypatch.setattr(dispatch, "RECOUNT", 0.1)
    client, todo = Client(3), [next(chunks(lambda: False)) for _ in range(5)]
    todo = [replace(chunk, index=k) for k, chunk in enumerate(todo)]
    found = sorted(done.index for done in dispatch.run_chunks(iter(todo), client.get_executor, False))
    assert found == [0, 1, 2, 3, 4] and sorted(client.asked) == [0, 0, 1, 1, 2, 2, 3, 4]


def test_another_scheduler_is_asked_for_where_there_is_a_function_that_gives_one(monkeypatch):
    monkeypatch.setattr(dispatch, "RECOUNT", 0.1)
    todo = [replace(next(chunks(lambda: False)), index=k) for k in range(5)]
    clients = [Client(3, "closed"), Client(0)]
    made = iter(clients)
    assert len(list(dispatch.run_chunks(iter(todo), lambda: next(made).get_executor(), True))) == 5
    assert sorted(clients[1].asked) == [0, 1, 2, 3, 4]
    dead = (Client(1, "closed") for _ in range(9))
    with pytest.raises(dispatch.ExecutorFailed, match=r"samples 0 to 0 cannot be computed, tried 3 times: ConnectionError: "
                                                      "no scheduler at tcp://far:1"):
        list(dispatch.run_chunks(iter(todo[:1]), lambda: next(dead).get_executor(), True))


SCRIPT = """
import sys
from mpi4py.futures import MPIPoolExecutor
import symdyn as sd
from symdyn.runtime.building.recall import recall

if __name__ == "__main__":
    drawn = sd.Samples({"q1": {"from": -1, "to": 1}}, "random", 40, 2)
    with MPIPoolExecutor() as pool:
        sd.ensemble(recall("double_pendulum", {}), drawn, (0, 0.2), chunk=5, path=sys.argv[1], executor=pool)
        print(pool.num_workers, "workers")
"""


def test_the_executor_of_mpi4py(tmp_path):
    pytest.importorskip("mpi4py")
    launcher = shutil.which("mpiexec", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))
    if launcher is None:
        pytest.skip("there is no mpiexec")
    (tmp_path / "script.py").write_text(SCRIPT)
    run = subprocess.run([launcher, "-n", "2", sys.executable, "-m", "mpi4py.futures", str(tmp_path / "script.py"),
                          str(tmp_path / "out")], capture_output=True, text=True, timeout=120)
    assert run.returncode == 0 and "1 workers" in run.stdout, run.stderr[-2000:]
    drawn = sd.Samples({"q1": {"from": -1, "to": 1}}, "random", 40, 2)
    here = sd.ensemble(recall("double_pendulum", {}), drawn, (0, 0.2), chunk=5)
    assert (tmp_path / "out" / "ensemble.npz").read_bytes() == here.file.read_bytes()
