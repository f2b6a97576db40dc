"""Ensembles on clusters: Dask with a worker that is killed, and the executor of mpi4py."""

from __future__ import annotations

import itertools
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

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

        for found in dispatch.run_chunks(counted(chunks(lambda: grown() and len({d.worker for d in done}) > 1)),
                                         client.get_executor, False):
            done.append(found)
            if len(done) == 1:
                assert max(outstanding) == dispatch.AHEAD
                local.scale(3)
        assert dispatch.AHEAD < max(outstanding) <= 3 * dispatch.AHEAD and len(done) == handed
        local.scale(1)
        before = len(outstanding)
        for found in dispatch.run_chunks(counted(chunks(lambda: len(client.nthreads()) == 1 and len(outstanding) > before + 30)),
                                         client.get_executor, False):
            done.append(found)
        assert max(outstanding[-5:]) <= dispatch.AHEAD


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
