"""Sweeps on clusters: lines of the file and what contradicts itself in them, jobs under Slurm, what is predicted and shown."""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import stat
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import symdyn as sd
from symdyn.cli import main, sweep_on_cluster
from symdyn.ensembles import prediction, run, slurm
from symdyn.ensembles.claims import Claims
from symdyn.ensembles.cluster import Cluster, in_time, read_cluster
from symdyn.ensembles.exports import EXPORTS, Export
from symdyn.ensembles.plan import plan
from symdyn.ensembles.samples import Samples
from symdyn.ensembles.sweep_file import read_sweep
from symdyn.errors import EnsembleStopped
from symdyn.runtime.building.recall import recall

SWEEP = """
system = "double_pendulum"
t = [0, 1]
sampling = "latin_hypercube"
count = {count}
chunk = {chunk}
outcomes = ["end q1", "max q2"]
{more}
[parameters]
l1 = {{from = 0.5, to = 1.5}}
[initial]
q1 = {{from = -1, to = 1}}
{table}
"""


@pytest.fixture(autouse=True)
def short_measurements(monkeypatch):
    """Dry runs within tests measure for a moment: what they predict need not be exact."""
    monkeypatch.setattr(prediction, "LEAST", 0.01)
    monkeypatch.setattr(prediction, "TRIAL_BYTES", 2**21)


def write(folder, more="", table="", count=400, chunk=20):
    path = folder / "sweep.toml"
    path.write_text(SWEEP.format(more=more, table=table, count=count, chunk=chunk))
    return str(path)


def read(**content):
    faults = []
    return read_cluster(content, faults), faults


# -- the lines of the file


@pytest.mark.parametrize("content, expected", [
    ({}, None),
    ({"cluster": "slurm"}, Cluster("slurm", 16, 1)),
    ({"cluster": "folder"}, Cluster("folder")),
    ({"cluster": "dask"}, Cluster("dask")),
    ({"dask": "tcp://a:1"}, Cluster("dask", address="tcp://a:1")),
    ({"dask": "tcp://a:1", "cluster": {"kind": "dask", "workers": 3}}, Cluster("dask", 3, address="tcp://a:1")),
    ({"cluster": {"kind": "slurm", "workers": 4, "cores": 2, "memory": "1.5 GB", "time": "1-02:03:04", "partition": "a-b",
                  "account": "x_1", "qos": "q", "lease": 30, "price": 0.5}},
     Cluster("slurm", 4, 2, 1_500_000_000, 93784.0, "a-b", "x_1", "q", False, 30.0, 0.5)),
    ({"cluster": {"kind": "slurm", "nodes": 3}}, Cluster("slurm", 3, None, nodes=True)),
    ({"cluster": {"kind": "slurm", "nodes": 3, "gpus": 4}}, Cluster("slurm", 3, None, nodes=True, gpus=4)),
])
def test_lines_about_a_cluster(content, expected):
    assert read(**content) == (expected, [])


@pytest.mark.parametrize("content, messages", [
    ({"cluster": "slrum"}, ["cluster: there is no 'slrum', did you mean slurm?"]),
    ({"cluster": "pbs"}, ["cluster: there is no 'pbs'; there are slurm, dask, folder"]),
    ({"cluster": 3}, ["cluster: must be one of slurm, dask, folder, or a table with such a kind, found 3"]),
    ({"cluster": {"workers": 3}}, ["cluster.kind: is missing; there are slurm, dask, folder"]),
    ({"dask": 3}, ["dask: must be the address of a scheduler such as \"tcp://host:8786\", found 3"]),
    ({"cluster": "slurm", "dask": "tcp://a:1"}, ["cluster and dask: slurm and Dask are both asked for; keep one of the lines"]),
    ({"cluster": {"kind": "dask", "address": "tcp://b:1"}, "dask": "tcp://a:1"},
     ["cluster.address and dask: two schedulers are asked for, 'tcp://b:1' and 'tcp://a:1'; keep one of them"]),
    ({"cluster": {"kind": "dask", "time": "01:00:00", "partition": "a", "memory": "1 GB", "lease": 3}},
     ["cluster.time: does not go with dask: only Slurm ends workers at a time; leave it out",
      "cluster.partition: does not go with dask: it is of Slurm; leave it out",
      "cluster.memory: does not go with dask: Dask's workers have theirs already; leave it out",
      "cluster.lease: does not go with dask: Dask itself notices workers that are lost; leave it out"]),
    ({"cluster": {"kind": "folder", "gpus": 2}}, ["cluster.gpus: does not go with folder: it is of Slurm; leave it out"]),
    ({"cluster": {"kind": "slurm", "address": "tcp://a:1"}},
     ["cluster.address: does not go with slurm: it is of Dask; leave it out"]),
    # All that is wrong at once.
    ({"dask": "tcp://a:1", "cluster": {
        "kind": "slurm", "workers": 0, "cores": True, "memory": "4", "time": 3600, "partition": "a; rm -rf /", "nodes": -1,
        "acount": "a", "lease": 0, "price": "x", "account": "a\nb", "qos": "-x"}},
     ["cluster and dask: slurm and Dask are both asked for; keep one of the lines",
      "cluster.workers: must be a whole number from 1 on, below 1e+18, found 0",
      "cluster.cores: must be a whole number from 1 on, below 1e+18, found True",
      "cluster.memory: must be a size such as \"4 GB\", below 1e+18 bytes, found '4'",
      "cluster.time: must be a time such as \"04:00:00\" (hours, minutes, seconds) or \"2-12:00:00\" (with days, 99999 at the "
      "most), found 3600",
      "cluster.partition: must be a name of letters, digits and _ . , @ + -, found 'a; rm -rf /'",
      "cluster.nodes: must be a whole number from 1 on, below 1e+18, found -1",
      "cluster.acount: not known, did you mean account?",
      "cluster.lease: must be a number of seconds from 1 to 1e+07, found 0",
      "cluster.price: must be a positive number below 1e+18, found 'x'",
      "cluster.account: must be a name of letters, digits and _ . , @ + -, found 'a\\nb'",
      "cluster.qos: must be a name of letters, digits and _ . , @ + -, found '-x'",
      "cluster.nodes and cluster.workers: nodes asks for whole nodes, with one worker on each that uses all of its cores; "
      "leave workers out, or leave nodes out",
      "cluster.nodes and cluster.cores: nodes asks for whole nodes, with one worker on each that uses all of its cores; "
      "leave cores out, or leave nodes out"]),
])
def test_lines_that_contradict_themselves(content, messages):
    assert read(**content) == (None, messages)


def test_numbers_that_are_too_large_are_rejected_with_their_bound():
    many = "9" * 400
    _, faults = read(cluster={"kind": "slurm", "workers": int(many), "memory": f"{many} GB", "lease": 1e308, "price": 1e18,
                              "time": f"{many}-00:00:00"})
    for what, bound in (("workers", "a whole number from 1 on, below 1e+18, found a whole number of about 401 digits"),
                        ("lease", "a number of seconds from 1 to 1e+07, found 1e+308"),
                        ("memory", "a size such as \"4 GB\", below 1e+18 bytes, found '99"),
                        ("price", "a positive number below 1e+18, found 1e+18"),
                        ("time", "(with days, 99999 at the most), found '99")):
        assert any(fault.startswith(f"cluster.{what}: must be ") and bound in fault for fault in faults), faults
    assert len(faults) == 5
    largest = {"kind": "slurm", "workers": 10**18 - 1, "lease": 1e7, "time": "99999-23:59:59", "memory": "999000 TB"}
    assert read(cluster=largest)[1] == []


@pytest.mark.parametrize("workers, cores, chunk, said", [
    (5000, 1, 1, "  idle          4,980 of 5,000 workers, as there are 20 chunks; ask for fewer\n"),
    (2, 3, 20, "  idle          1 of 2 workers, as there is 1 chunk; ask for fewer, or for a smaller chunk\n"),
    (2, 3, 5, "  idle          2 of 6 cores, as there are 4 chunks; ask for fewer, or for a smaller chunk\n"),
    (2, 3, 3, None)])
def test_workers_that_get_no_chunk_are_counted(tmp_path, capsys, workers, cores, chunk, said):
    path = write(tmp_path, table=f"[cluster]\nkind = \"folder\"\nworkers = {workers}\ncores = {cores}\n", count=20, chunk=chunk)
    assert main(["sweep", path, "--dry-run", "--output", str(tmp_path / "out")]) == 0
    found = capsys.readouterr().out
    assert said in found if said else "idle" not in found, found


def test_faults_of_the_cluster_are_among_the_others(tmp_path, capsys):
    path = write(tmp_path, "tt = 1\ndask = \"tcp://a:1\"\nformats = [\"hdf5\"]",
                 "[cluster]\nkind = \"slurm\"\nworkers = 0\ntime = 04:00:00\n")
    assert main(["sweep", path]) == 2
    said = capsys.readouterr().err
    for fault in ("has 4 faults", "tt: not known", "formats: must be of parquet, zarr, found ['hdf5']; ensemble.npz is written",
                  "cluster and dask: slurm and Dask are both",
                  "cluster.workers: must be a whole number from 1 on, below 1e+18, found 0"):
        assert fault in said, said


@pytest.mark.parametrize("more, arguments, message", [
    ("", ["--workers", "3"],
     "--workers 3: the file names no cluster; give it a line such as cluster = \"slurm\", or pass --jobs"),
    ("cluster = \"slurm\"", ["--dask", "tcp://a:1"], "cluster: slurm is asked for, and --dask tcp://a:1 too; leave out one"),
    ("cluster = \"slurm\"", ["--jobs", "3"],
     "cluster: slurm is asked for, but --jobs is for this machine; write cores and workers"),
    ("cluster = \"dask\"", [], "cluster: dask is asked for, but no scheduler; write dask = \"tcp://host:8786\""),
    ("dask = \"tcp://far.example:1\"", [], "dask: 'tcp://far.example:1' is on another machine, and a scheduler can run programs "
     "here, which a sweep file must not: confirm it, by --dask tcp://far.example:1 or in DASK_SCHEDULER_ADDRESS"),
    ("", ["--dry-run", "--status"], "--dry-run and --status ask for different things; give one of them"),
    ("", ["--join", "--dask", "tcp://a:1"], "--join computes here, --dask on a cluster; give one of them"),
    ("", ["--stay"], "--stay goes with --join"),
    ("", ["--count", "5"], "--count goes with --dry-run; for the run itself write the count into the file"),
    ("", ["--status"], "holds no ensemble: nothing has begun there yet"),
    ("device = \"gpu\"", ["--jobs", "2"], "device: a GPU is asked for, but --jobs 2 is for cores; leave --jobs out, and start a "
     "worker for each GPU by --join"),
    ("cluster = {kind = \"slurm\", gpus = 2}", [], "cluster.gpus: motions are computed by cores; give the file the line device"),
])
def test_a_command_that_contradicts_the_file_or_itself(tmp_path, capsys, monkeypatch, more, arguments, message):
    monkeypatch.delenv("DASK_SCHEDULER_ADDRESS", raising=False)
    assert main(["sweep", write(tmp_path, more), "--output", str(tmp_path / "out"), *arguments]) == 2
    said = capsys.readouterr().err
    assert message in said and not (tmp_path / "out").exists(), said


@pytest.mark.parametrize("address, here", [
    ("tcp://127.0.0.1:8786", True), ("localhost:8786", True), ("tls://[::1]:8786", True), ("tcp://127.0.0.1.example:1", False),
    ("tcp://localhost:1@far:2", False), ("tcp://far://127.0.0.1:1", False), ("inproc://10.0.0.1/1/1", False), ("far", False),
    ("tcp://localhost@far:1", False)])
def test_which_schedulers_a_file_may_name(address, here, monkeypatch):
    monkeypatch.delenv("DASK_SCHEDULER_ADDRESS", raising=False)
    given = argparse.Namespace(workers=3, dask=None, dry_run=False, join=False)
    for confirmed, fine in ((None, here), (address, True)):
        faults = []
        given.dask = confirmed
        found = sweep_on_cluster.with_scheduler(given, Cluster("dask", address=address), faults)
        assert (not faults) == fine and found.address == address and found.workers == 3


@pytest.mark.parametrize("text", ["0", "-1", "x", "1.5", "1e30", "nan"])
def test_numbers_of_workers_and_samples(tmp_path, capsys, text):
    with pytest.raises(SystemExit):
        main(["sweep", write(tmp_path), "--dry-run", "--count", text])
    assert f"must be a whole number from 1 on, below 1e+18, such as 64 or 1e9, found '{text}'" in capsys.readouterr().err


# -- Slurm


def test_the_script_has_what_the_file_asks_for():
    text = slurm.script(Cluster("slurm", 8, 4, 2**31, 5400.0, "batch", "me", "fast"), "swing", Path("/a b"), ["symdyn", "x y"])
    lines = text.splitlines()
    assert lines[0] == "#!/bin/sh" and lines[-1] == "exec symdyn 'x y' --jobs 4 \"$@\""
    for line in ("job-name=symdyn-swing", "array=0-7", "nodes=1", "ntasks=1", "cpus-per-task=4", "mem=2048M", "time=0-01:30:00",
                 "partition=batch", "account=me", "qos=fast", "output='/a b/logs/%A_%a.txt'", "requeue"):
        assert f"#SBATCH --{line}" in lines
    whole = slurm.script(Cluster("slurm", 3, nodes=True), "swing", Path("/a"), ["symdyn"]).splitlines()
    assert "#SBATCH --exclusive" in whole and "#SBATCH --array=0-2" in whole
    assert whole[-1] == 'exec symdyn --jobs "${SLURM_CPUS_ON_NODE:-1}" "$@"'
    assert not [line for line in whole if "cpus-per-task" in line or "time=" in line or "gres" in line]
    one = slurm.script(Cluster("slurm", 3, 4), "swing", Path("/a"), ["symdyn"], device=True).splitlines()
    assert "#SBATCH --gres=gpu:1" in one and one[-1] == 'exec symdyn "$@"'


@pytest.mark.skipif(os.name != "posix", reason="Slurm is of POSIX")
@pytest.mark.parametrize(("cluster", "given", "used"), [
    (Cluster("slurm", 2, nodes=True, gpus=4), "0,2,5,7", "0 2 5 7"), (Cluster("slurm", 2, nodes=True), None, "0"),
    (Cluster("slurm", 2, 8, gpus=2), "3,1", "1 3")])
def test_every_gpu_of_a_job_has_a_worker(tmp_path, cluster, given, used):
    """All workers get the sign that the time is over, and their failure is that of the job."""
    worker = tmp_path / "worker"
    worker.write_text("#!/bin/sh\ntrap 'echo ends > $1.ended; exit 130' TERM\n"
                      'echo "$CUDA_VISIBLE_DEVICES" > "$1.$CUDA_VISIBLE_DEVICES"\n'
                      'if [ "$2" = fails ]; then exit "$CUDA_VISIBLE_DEVICES"; fi\nsleep 30 & wait\n')
    worker.chmod(stat.S_IRWXU)
    text = slurm.script(cluster, "swing", tmp_path, [str(worker), str(tmp_path / "gpu")], device=True)
    assert f"#SBATCH --gres=gpu:{cluster.gpus or 1}" in text.splitlines()
    path = tmp_path / "slurm.sh"
    path.write_text(text)
    environment = {k: v for k, v in os.environ.items() if k != "CUDA_VISIBLE_DEVICES"}
    environment |= {"CUDA_VISIBLE_DEVICES": given} if given else {}
    job = subprocess.Popen(["sh", str(path)], env=environment)
    for gpu in used.split():
        waited(tmp_path / f"gpu.{gpu}")
    job.terminate()
    assert job.wait(20) in (130, 143) and (tmp_path / "gpu.ended").exists()
    assert sorted(p.name for p in tmp_path.glob("gpu.[0-9]")) == [f"gpu.{gpu}" for gpu in used.split()]
    assert subprocess.run(["sh", str(path), "fails"], env=environment, check=False).returncode in map(int, used.split())


SBATCH = """#!{python}
import os, re, subprocess, sys, time
from pathlib import Path

spool = Path({spool!r})
known = {{"job-name", "array", "nodes", "ntasks", "cpus-per-task", "mem", "time", "partition", "account", "qos", "output",
         "open-mode", "signal", "requeue", "exclusive", "gres", "dependency", "parsable"}}
given = [a for a in sys.argv[1:] if a.startswith("--") and a != "--stay"]
script, *more = [a for a in sys.argv[1:] if a not in given]
lines = [line.split(" ", 1)[1] for line in Path(script).read_text().splitlines() if line.startswith("#SBATCH")]
options = dict((a[2:].split("=", 1) + [""])[:2] for a in lines + given)
assert set(options) <= known, options
if options.get("partition") == "full":
    sys.exit("sbatch: error: invalid partition specified: full")
job = str(len(list(spool.glob("*.begun"))) + 1)
(spool / (job + ".begun")).touch()
print(job + ";cluster")
sys.stdout.flush()
if os.fork():
    os._exit(0)
os.setsid()
for handle in (0, 1, 2):
    os.dup2(os.open(os.devnull, os.O_RDWR), handle)
if "dependency" in options:
    first = options["dependency"].removeprefix("afterany:")
    while not (spool / (first + ".done")).exists():
        time.sleep(0.02)
ends = options["array"].split("-")
tasks = []
for k in range(int(ends[0]), int(ends[-1]) + 1):
    with open(options["output"].replace("%A", job).replace("%a", str(k)), "a") as log:
        tasks.append(subprocess.Popen(["sh", script, *more], stdout=log, stderr=log, env={{
            **os.environ, "SLURM_ARRAY_JOB_ID": job, "SLURM_ARRAY_TASK_ID": str(k)}}))
    (spool / f"{{job}}_{{k}}.pid").write_text(str(tasks[-1].pid))
for task in tasks:
    task.wait()
(spool / (job + ".done")).touch()
"""

SQUEUE = """#!{python}
import sys
from pathlib import Path

spool = Path({spool!r})
for job in next(a for a in sys.argv if a.startswith("--jobs=")).removeprefix("--jobs=").split(","):
    if not (spool / (job + ".done")).exists():
        print("RUNNING" if list(spool.glob(job + "_*.pid")) else "PENDING")
"""


@pytest.fixture
def queue(tmp_path, monkeypatch):
    """A folder with stand-ins for sbatch and squeue, which run tasks as processes of this machine."""
    if os.name != "posix":
        pytest.skip("Slurm is of POSIX")
    spool, commands = tmp_path / "spool", tmp_path / "commands"
    spool.mkdir()
    commands.mkdir()
    for name, text in (("sbatch", SBATCH), ("squeue", SQUEUE)):
        (commands / name).write_text(text.format(python=sys.executable, spool=str(spool)))
        (commands / name).chmod(stat.S_IRWXU)
    monkeypatch.setenv("PATH", f"{commands}{os.pathsep}{os.environ['PATH']}")
    return spool


def waited(path, seconds=60):
    end = time.monotonic() + seconds
    while not path.exists() and time.monotonic() < end:
        time.sleep(0.02)
    assert path.exists(), [p.name for p in path.parent.iterdir()]


@pytest.mark.slow
def test_a_sweep_under_slurm_is_the_same_with_a_worker_that_is_killed(tmp_path, capsys, queue):
    asked = {"count": 1200, "chunk": 20, "table": "[cluster]\nkind = \"slurm\"\nworkers = 2\nlease = 1\ntime = 00:10:00\n"}
    path, out = write(tmp_path, **asked), tmp_path / "out"
    assert main(["sweep", path, "--output", str(out), "--no-picture"]) == 0
    said = capsys.readouterr().out
    assert "Slurm's job 1 with 2 workers computes 1200 samples in 60 chunks" in said and "scancel 1 stops it" in said
    waited(queue / "1_1.pid")
    while not (queue / "1.done").exists() and (
            len(list((out / "chunks").glob("0*.npz"))) < 5 or len(list((out / "workers").glob("*.json"))) < 2):
        time.sleep(0.002)
    os.kill(int((queue / "1_1.pid").read_text()), signal.SIGKILL)
    assert main(["sweep", path, "--output", str(out), "--status"]) == 0
    shown = capsys.readouterr().out
    assert "of 1200 samples are done (" in shown and "(job 1_0)" in shown and "(job 1_1)" in shown
    assert "Slurm's jobs 1 and 2: 1 pending, 1 running" in shown, shown
    waited(queue / "2.done")
    assert main(["sweep", path, "--output", str(out), "--status"]) == 0
    assert "all 1200 samples are done; the results are in" in capsys.readouterr().out
    assert main(["sweep", path, "--output", str(out), "--resume", "--no-picture"]) == 0
    assert "1200 of them computed before" in capsys.readouterr().out
    alone = write(tmp_path, count=1200, chunk=20)
    assert main(["sweep", alone, "--output", str(tmp_path / "alone"), "--no-picture"]) == 0
    assert (out / "ensemble.npz").read_bytes() == (tmp_path / "alone" / "ensemble.npz").read_bytes()
    assert not [name for name in ("chunks", "claims", "workers") if (out / name).exists()]
    assert len(list((out / "logs").iterdir())) == 3


def test_what_slurm_rejects_is_reported_in_its_own_words(tmp_path, capsys, queue, monkeypatch):
    path = write(tmp_path, table="[cluster]\nkind = \"slurm\"\npartition = \"full\"\n")
    assert main(["sweep", path, "--output", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "sbatch rejects the job: sbatch: error: invalid partition specified: full; correct [cluster] in the sweep file" in said
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(["sweep", path, "--output", str(tmp_path / "out"), "--resume", "--backend", "numpy"]) == 2
    assert "holds another ensemble" in capsys.readouterr().err
    assert main(["sweep", path, "--output", str(tmp_path / "new"), "--backend", "numpy"]) == 2
    assert "there is no command sbatch here; run this where jobs are submitted" in capsys.readouterr().err


def test_workers_are_not_submitted_twice(tmp_path, capsys, queue):
    path, out = write(tmp_path, "cluster = \"slurm\""), tmp_path / "out"
    begun(path, out)
    assert main(["sweep", path, "--output", str(out)]) == 2
    assert "holds an ensemble already; pass resume=True (--resume)" in capsys.readouterr().err
    with Claims(out, "other") as other:
        other.take(["00000004"])
        assert main(["sweep", path, "--output", str(out), "--resume"]) == 2
    said = capsys.readouterr().err
    assert "1 chunk of" in said and "is being computed by workers; --status shows them, and sbatch" in said
    assert not list(queue.iterdir())


def test_only_the_formats_that_are_missing_are_submitted(tmp_path, capsys, queue):
    """Also those that a worker was killed at: the results next to them are no sign that all is done."""
    pytest.importorskip("pyarrow")
    out, asked = tmp_path / "out", {"table": "[cluster]\nkind = \"slurm\"\nworkers = 3\n"}
    assert main(["sweep", write(tmp_path, "cluster = \"folder\""), "--output", str(out), "--no-picture"]) == 0
    path = write(tmp_path, "formats = [\"parquet\"]", **asked)
    with Claims(out, "other") as other:
        other.take([run.MERGE])
        assert main(["sweep", path, "--output", str(out), "--resume"]) == 2
    assert f"the results of {out} are being put together by a worker; wait until it has ended" in capsys.readouterr().err
    assert not list(queue.iterdir()) and not (out / "ensemble.parquet").exists()
    assert main(["sweep", path, "--output", str(out), "--resume", "--no-picture"]) == 0
    said = capsys.readouterr().out
    assert said == "double_pendulum: Slurm's job 1 with 1 worker writes parquet; all 400 samples are done\n"
    waited(queue / "2.done")
    assert (out / "ensemble.parquet").is_file() and len(list((out / "logs").iterdir())) == 2
    assert main(["sweep", path, "--output", str(out), "--resume", "--no-picture"]) == 0
    assert "400 of them computed before" in capsys.readouterr().out


@pytest.mark.parametrize("table, messages", [
    ("time = 00:00:01\nmemory = \"1 MB\"", ["has 2 faults", "cluster.time: 1 s are asked for, but a worker is predicted to take",
     "for one chunk of 20 motions: it would end before anything is kept; ask for more time, or a smaller chunk",
     "cluster.memory: 1 MB (1000000 bytes) are asked for, but a worker is predicted to take"]),
    ("memory = \"2 MB\"", ["sweep.toml: cluster.memory: 2 MB"])])
def test_what_the_cluster_gives_and_does_not_suffice(tmp_path, capsys, queue, monkeypatch, table, messages):
    measure = prediction.measure
    monkeypatch.setattr(prediction, "measure", lambda *given: replace(measure(*given), start=2.0, memory=10**8))
    path = write(tmp_path, table=f"[cluster]\nkind = \"slurm\"\n{table}\n")
    for command in (["--dry-run"], []):
        assert main(["sweep", path, "--output", str(tmp_path / "out"), *command]) == 2
        said = capsys.readouterr().err
        assert all(message in said for message in messages if "sweep.toml" not in message and "has 2" not in message), said
    assert all(message in said for message in messages), said
    assert not list(queue.iterdir()) and not (tmp_path / "out").exists()


def test_a_time_limit_that_is_too_short_for_all_is_no_fault(tmp_path, capsys, queue, monkeypatch):
    monkeypatch.setattr(slurm, "submit", lambda folder, text: "7")
    predict, measure = prediction.predict, prediction.measure
    monkeypatch.setattr(prediction, "measure", lambda *given: replace(measure(*given), start=2.0))  # since this process began
    monkeypatch.setattr(prediction, "predict", lambda *given: replace(predict(*given), wall=1000.0))
    path = write(tmp_path, table="[cluster]\nkind = \"slurm\"\ntime = 00:05:00\n")
    assert main(["sweep", path, "--output", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "the time limit of 5 min ends before: go on with --resume, about 4 times in all, or ask for more workers" in said


@pytest.mark.skipif(shutil.which("nvidia-smi") is not None, reason="there may be a GPU")
def test_a_sweep_on_gpus_is_submitted_where_there_is_none(tmp_path, capsys, queue):
    """The worker finds out what it lacks."""
    table = "[cluster]\nkind = \"slurm\"\nworkers = 1\ntime = 00:10:00\ngpus = 2\n"
    path, out = write(tmp_path, "device = \"gpu\"", table, chunk=20), tmp_path / "out"
    assert main(["sweep", path, "--output", str(out), "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert "400 motions for 2 workers of 1 GPU, predicted from 10 of them" in said
    assert "s of a core of this machine; times on a GPU are not predicted: this machine has none that answers" in said
    assert "20 chunks of 20" in said and "nan" not in said and "a year" not in said and "time limit of" not in said, said
    assert main(["sweep", path, "--output", str(out), "--no-picture"]) == 0
    said = capsys.readouterr().out
    assert "computes 400 samples in 20 chunks\n  times on a GPU are not predicted: this machine has none" in said, said
    waited(queue / "2.done")
    assert all("device='gpu' was asked for, but this machine has no CUDA device that answers" in log.read_text()
               or "device='gpu' needs the package cuda-bindings" in log.read_text() for log in (out / "logs").iterdir())
    assert len(list((out / "logs").iterdir())) == 2 and not (out / "chunks").exists()
    assert main(["sweep", path, "--output", str(out), "--resume"]) == 0  # submits again
    waited(queue / "4.done")


@pytest.mark.skipif(shutil.which("nvidia-smi") is not None, reason="there may be a GPU")
@pytest.mark.parametrize("path", [None, "new"])
def test_a_machine_without_a_gpu_reports_it_before_anything_is_written(tmp_path, path):
    asked = {} if path is None else {"path": tmp_path / path}
    with pytest.raises(sd.ArgumentError, match="device='gpu:1' was asked for, but this machine has no CUDA device that answers"):
        sd.ensemble(recall("double_pendulum", {}), {"q1": [0.1, 0.2]}, (0, 0.1), device="gpu:1", **asked)
    assert not list(tmp_path.iterdir())
    with ThreadPoolExecutor(1) as pool, pytest.raises(EnsembleStopped, match="tried 3 times: NoDevice: double_pendulum: device="):
        sd.ensemble(recall("double_pendulum", {}), {"q1": [0.1, 0.2]}, (0, 0.1), device="gpu:1", executor=pool)


# -- what is predicted


@pytest.fixture(scope="module")
def planned():
    samples = Samples({"q1": {"from": -1, "to": 1}, "l1": {"from": 0.5, "to": 1.5}}, "random", 600, 1)
    return plan(recall("double_pendulum", {}), samples, np.linspace(0, 1, 11), ["end q1", "trace q2"], chunk=50).tried()


@pytest.fixture(scope="module")
def measured(planned, tmp_path_factory):
    return prediction.measure(planned, tmp_path_factory.mktemp("dry"), 1, ())


def test_bytes_and_files_are_those_of_a_run(planned, measured, tmp_path, monkeypatch):
    found = prediction.predict(planned, measured, 600, 1, 1)
    at_the_end = []
    monkeypatch.setattr(run.Store, "clear", lambda self: at_the_end.append(
        [p.stat().st_size for p in self.folder.rglob("*.npz")]))
    run.run(planned, tmp_path / "a", run.How(), False)
    assert found.files == len(at_the_end[0]) - 1 == 12
    result = (tmp_path / "a" / "ensemble.npz").stat().st_size
    assert found.result == pytest.approx(result, rel=0.05) and found.result == 600 * (8 * (2 + 12) + 1)
    assert found.written == pytest.approx(sum(at_the_end[0]), rel=0.15)


def test_a_prediction_is_arithmetic_for_any_number_of_motions(planned, measured):
    free = replace(planned, size=None)
    some, many = (prediction.predict(free, measured, n, 64, 4) for n in (10**8, 10**9))
    assert many.core == pytest.approx(10 * some.core) and many.result == 10 * some.result
    assert many.core == pytest.approx(1e9 * measured.motion) and many.workers * many.cores == 256
    assert many.wall >= many.core / 256 and many.files == 10_000 and many.size * free.row < 2**26
    large = replace(free, setting=replace(free.setting, shapes=((), (1001,))))
    traces = prediction.predict(large, measured, 10**9, 64, 4)
    assert traces.size == 2**26 // large.row and traces.files == -(-10**9 // traces.size)
    twice = prediction.predict(free, measured, 10**9, 128, 4)
    assert twice.wall - twice.merge == pytest.approx((many.wall - many.merge) / 2, rel=0.1)
    slow = replace(measured, serial=0.5)
    assert slow.speedup(1) == 1 and slow.speedup(4) == pytest.approx(1.6) and measured.speedup(3) > 0


def test_times_of_merging_are_those_of_chunks_bytes_and_what_is_done_once(planned, tmp_path, monkeypatch):
    """By a clock that goes on only where something is written, by known amounts."""
    now, loaded = [0.0], []
    made = run.Store(tmp_path, 1, 1, {})

    def put(self, done):
        now[0] += 1e-3 + 2e-9 * sum(column.nbytes for column in done.columns.values())

    def finish(self, about, times, block):
        nonlocal made
        made = self
        now[0] += 0.05 + 4e-3 * self.n_chunks + 1e-9 * self.count * planned.row

    def export(ensemble, path):
        now[0] += 0.02 + 5e-9 * made.count * planned.row + 3.0 * (not loaded)
        loaded.append(made)
        path.touch()

    monkeypatch.setattr(prediction, "clock", argparse.Namespace(perf_counter=lambda: now[0]))
    monkeypatch.setattr(prediction, "Ensemble", lambda folder: folder)
    monkeypatch.setattr(run.Store, "put", put)
    monkeypatch.setattr(run.Store, "finish", finish)
    monkeypatch.setitem(EXPORTS, "slow", Export("ensemble.slow", "numpy", "", export))
    for once in (0.05 + 0.02 + 3.0, 0.05 + 0.02):  # the package of the format is loaded by the first of them
        put_seconds, merge, _ = prediction._disk(planned, tmp_path, ("slow",))
        assert put_seconds == pytest.approx((1e-3, 2e-9), rel=1e-3)
        assert merge == pytest.approx((once, 4e-3, 6e-9), rel=1e-3)
    measured = prediction.Measured(np.ones(2), 1.0, 0.0, put_seconds, merge, 1.0, 0.0, 0, 0.0)
    few, many = (prediction.predict(replace(planned, size=size), measured, 10**6, 1, 1) for size in (1000, 100))
    assert many.merge - few.merge == pytest.approx(9000 * 4e-3, rel=1e-3)


def test_chunks_for_a_cluster_are_lost_without_harm(planned, measured):
    free, slow = replace(planned, size=None), replace(measured, motion=20.0)
    assert prediction.fitted(planned, slow, 4, 1).size == 50  # as it was asked for
    assert prediction.fitted(free, slow, 4, 1).size == 30  # ten minutes
    assert prediction.fitted(free, slow, 4, 1, 2000.0).size == 10  # a tenth of the time limit
    assert prediction.fitted(free, slow, 64, 4).size == 1  # each core has some
    assert prediction.fitted(free, replace(measured, motion=1e9), 1, 1).size == 1


def test_limits_are_sorted_and_lie_where_the_prediction_passes_them(planned, measured, tmp_path):
    cluster = Cluster("slurm", 4, 1, memory=10**9, time=3600.0)
    found = prediction.limits(replace(planned, size=None), measured, cluster, tmp_path / "no" / "folder", 4, 1)
    numbers = [limit.motions for limit in found]
    assert numbers == sorted(numbers) and len({limit.what for limit in found}) == len(found) >= 5
    by_time = next(limit for limit in found if "time limit of 1 h" in limit.what)
    below, above = (prediction.predict(replace(planned, size=None), measured, int(n), 4, 1).wall
                    for n in (0.99 * by_time.motions, by_time.motions))
    assert below <= 3600.0 < above
    assert any("a reader that takes a whole outcome" in limit.what for limit in found)
    few = prediction.limits(planned, measured, cluster, tmp_path, 4, 1)
    files = next(limit for limit in few if "files in a folder" in limit.what)
    assert files.motions == pytest.approx(50 * 100_000, rel=0.01) and "leave chunk out" in files.remedy


def test_what_needs_more_time_to_be_put_together_than_there_is(planned, measured):
    found = prediction.predict(replace(planned, size=None), replace(measured, merge=(0.0, 0.0, 1.0)), 600, 4, 1)
    faults = prediction.contradictions(found, measured, Cluster("slurm", 4, 1, time=100.0), False)
    assert faults == [f"cluster.time: 100 s are asked for, but to put the results together is predicted to take "
                      f"{in_time(found.merge)}; ask for more time"]
    one = replace(found, size=1, chunk=500.0)
    assert "for one chunk of 1 motion: it would end before anything is kept; ask for more time, or a shorter motion" in (
        prediction.contradictions(one, measured, Cluster("slurm", 4, 1, time=100.0), True)[0])


def test_a_dry_run_for_a_thousand_million_motions_makes_none_of_them(tmp_path, capsys):
    path = write(tmp_path, "cluster = \"slurm\"\nformats = [\"parquet\"]")
    Path(path).write_text(Path(path).read_text().replace("chunk = 20\n", ""))
    pytest.importorskip("pyarrow")
    before, out = prediction.resident(), str(tmp_path / "out")
    assert main(["sweep", path, "--dry-run", "--count", "1e9", "--workers", "64", "--output", out]) == 0
    said = capsys.readouterr().out
    for part in ("1,000,000,000 motions for 64 workers of 1 core, predicted from 10 of them", "core hours",
                 "10000 chunks of 100,000", "First limits", "at the most", "a worker"):
        assert part in said, said
    assert prediction.resident() - before < 400e6  # 1e9 samples of two numbers are 16 GB
    assert sorted(p.name for p in tmp_path.iterdir()) == ["sweep.toml"]


def test_a_grid_has_the_count_of_its_file(tmp_path, capsys):
    path = tmp_path / "a.toml"
    path.write_text('system = "double_pendulum"\nsampling = "grid"\nt = [0, 0.1]\n[cluster]\nkind = "folder"\nworkers = 3\n'
                    'cores = 2\nprice = 0.1\n[initial]\nq1 = [1, 2, 3]\n')
    assert main(["sweep", str(path), "--dry-run", "--count", "7"]) == 2
    assert "the grid has 3 samples, but the count is 7" in capsys.readouterr().err
    assert main(["sweep", str(path), "--dry-run", "--output", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "3 motions for 3 workers of 2 cores, predicted from 3 of them" in said and ", cost " in said


# -- a folder


def test_runs_that_share_a_folder(tmp_path, capsys):
    path, out = write(tmp_path, "cluster = \"folder\"\nformats = [\"parquet\"]"), str(tmp_path / "out")
    pytest.importorskip("pyarrow")
    assert main(["sweep", path, "--output", out, "--no-picture"]) == 0
    assert "400 samples of l1, q1" in capsys.readouterr().out and (tmp_path / "out" / "ensemble.parquet").is_file()
    assert main(["sweep", path, "--output", out, "--no-picture", "--join"]) == 0
    assert "400 of them computed before" in capsys.readouterr().out
    assert json.loads((tmp_path / "out" / "manifest.json").read_text())["chunk"] == 20


def test_a_worker_that_joins_leaves_the_rest_to_the_others(tmp_path, capsys):
    path, out = write(tmp_path), tmp_path / "out"
    begun(path, out)
    with Claims(out, "other") as other:
        other.take(["00000004"])
        assert main(["sweep", path, "--output", str(out), "--no-picture", "--join"]) == 0
        assert "nothing is left to begin; other workers have 20 of 400 samples at work" in capsys.readouterr().out
    with Claims(out, "other") as other:
        other.take(["00000004"])
        os.utime(other._own["00000004"], (0, 0))
        assert main(["sweep", path, "--output", str(out), "--no-picture", "--join", "--stay"]) == 0
        assert "380 of them computed before, 20 in" in capsys.readouterr().out


def test_there_is_nothing_to_join_in_a_mistyped_folder(tmp_path, capsys):
    path, out = write(tmp_path), tmp_path / "out"
    begun(path, out)
    assert main(["sweep", path, "--output", str(tmp_path / "typo"), "--join"]) == 2
    said = capsys.readouterr().err
    assert "typo holds no ensemble: there is nothing to join; start it without --join, or name its folder by --output" in said
    assert not (tmp_path / "typo").exists()


def begun(path, out):
    """The folder of the sweep of a file, without any chunk."""
    faults = []
    asked = read_sweep(Path(path), faults)
    assert not faults
    run.prepare(plan(recall("double_pendulum", {}), **asked.arguments(recall("double_pendulum", {}))), out, False)


def test_many_workers_are_listed_up_to_a_number(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sweep_on_cluster, "LISTED", 2)
    path, out = write(tmp_path), tmp_path / "out"
    (out / "workers").mkdir(parents=True)
    (out / "manifest.json").write_text(json.dumps({"system": "swing", "chunk": 10, "samples": {"count": 40}}))
    for k in range(5):
        (out / "workers" / f"w{k}.json").write_text(json.dumps(
            {"state": "at work" if k else "has left", "begun": 0.0, "now": 10.0, "count": {f"w{k}": k}, "failed": 0, "task": ""}))
    assert main(["sweep", path, "--output", str(out), "--status"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0] == "swing: 0 of 40 samples are done (0 %)"
    assert said[1] == "4 workers at work: 1 samples a second, about 40 s are left"
    assert len(said) == 5 and said[2].startswith("  w4: 4 samples, at work, heard of") and said[4] == "  and 3 more"
