"""An ensemble as an array of jobs under Slurm: its script, its submission, and what the queue shows of it."""

from __future__ import annotations

import contextlib
import json
import math
import shlex
import subprocess
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from symdyn.ensembles.cluster import Cluster
from symdyn.errors import SymdynError
from symdyn.runtime.building.stored import write_whole

SCRIPT, JOB, LOGS = "slurm.sh", "job.json", "logs"
# Seconds before the end of its time at which a worker gets a sign, and gives back what it has claimed.
NOTICE = 60
# Seconds that a command of Slurm may take.
PATIENCE = 60.0


# A worker for each GPU that Slurm gives the job, which are not all, or more than were requested, on whole nodes.
EACH_GPU = """\
workers=
trap 'kill $workers' TERM
for gpu in $(echo "${{CUDA_VISIBLE_DEVICES:-0}}" | tr , ' '); do
    CUDA_VISIBLE_DEVICES=$gpu {run} &
    workers="$workers $!"
done
status=0
for worker in $workers; do
    wait "$worker" || status=$?
done
wait
exit $status"""


class SlurmFailed(SymdynError):
    """Slurm is not there, or rejects a job; the message has its own words."""


def script(cluster: Cluster, name: str, folder: Path, command: Sequence[str], device: bool = False) -> str:
    """The text of the script for sbatch: each task of the array is a worker.

    command   that a worker is started by; device: motions are computed on GPUs, of which each has a worker of its own
    """
    options = {"job-name": f"symdyn-{name}"[:60], "array": f"0-{(cluster.workers or 1) - 1}", "nodes": "1", "ntasks": "1",
               "cpus-per-task": None if cluster.nodes else str(cluster.cores or 1),
               "mem": None if cluster.memory is None else f"{math.ceil(cluster.memory / 2**20)}M",
               "time": None if cluster.time is None else _time(cluster.time), "partition": cluster.partition,
               "account": cluster.account, "qos": cluster.qos, "gres": f"gpu:{cluster.gpus or 1}" if device else None,
               "output": str(folder / LOGS / "%A_%a.txt"), "open-mode": "append", "signal": f"B:TERM@{NOTICE}"}
    lines = [f"#SBATCH --{key}={shlex.quote(value)}" for key, value in options.items() if value is not None]
    lines += ["#SBATCH --requeue", *["#SBATCH --exclusive"] * cluster.nodes]
    jobs = '"${SLURM_CPUS_ON_NODE:-1}"' if cluster.nodes else str(cluster.cores or 1)
    run = f'{shlex.join(command)} "$@"' if device else f'{shlex.join(command)} --jobs {jobs} "$@"'
    start = EACH_GPU.format(run=run) if device and (cluster.nodes or cluster.gpus) else f"exec {run}"
    return "\n".join([
        "#!/bin/sh", f"# The workers of an ensemble. sbatch {SCRIPT} adds more of them, at any time.", *lines, "",
        "# Each worker has its own threads; numeric libraries would start more.",
        "export OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 MKL_NUM_THREADS=1",
        "# A worker that receives the sign that its time ends gives back what it has claimed.",
        start, ""])


def submit(folder: Path, text: str) -> str:
    """Write the script, and submit it: the array, and after it one more job that computes what workers have left that were
    killed, and puts the results together. Returns the number of the array. Raises SlurmFailed."""
    (folder / LOGS).mkdir(exist_ok=True)
    write_whole(folder / SCRIPT, lambda file: file.write(text.encode()), 0o777)
    array = _sbatch([str(folder / SCRIPT)])
    last = _sbatch([f"--dependency=afterany:{array}", "--array=0", str(folder / SCRIPT), "--stay"])
    record = json.dumps({"jobs": [array, last]})
    write_whole(folder / JOB, lambda file: file.write(record.encode()))
    return array


def queue(folder: Path) -> str:
    """State of the jobs of a folder in the queue, in words; nothing where no job was submitted, or there is no queue."""
    with contextlib.suppress(OSError, ValueError, subprocess.SubprocessError):
        jobs = json.loads((folder / JOB).read_text(encoding="utf-8"))["jobs"]
        run = subprocess.run(["squeue", "--noheader", "--array", "--format=%T", f"--jobs={','.join(jobs)}"], capture_output=True,
                             text=True, timeout=PATIENCE, check=False)
        states = Counter(run.stdout.split()) if run.returncode == 0 else Counter()
        shown = ", ".join(f"{n} {state.lower()}" for state, n in sorted(states.items()))
        return f"Slurm's jobs {' and '.join(jobs)}: {shown or 'none is in the queue'}"
    return ""


def _sbatch(arguments: Sequence[str]) -> str:
    try:
        run = subprocess.run(["sbatch", "--parsable", *arguments], capture_output=True, text=True, timeout=PATIENCE, check=False)
    except FileNotFoundError:
        raise SlurmFailed("the cluster is slurm, but there is no command sbatch here; run this where jobs are submitted, or "
                          "leave cluster out") from None
    except subprocess.TimeoutExpired:
        raise SlurmFailed(f"sbatch has not answered for {PATIENCE:.0f} s; try again with --resume") from None
    if run.returncode:
        raise SlurmFailed(f"sbatch rejects the job: {run.stderr.strip() or 'it gives no reason'}; correct [cluster] in the sweep "
                          "file, and start again with --resume")
    return run.stdout.strip().partition(";")[0]


def _time(seconds: float) -> str:
    """As Slurm writes a time limit."""
    whole = math.ceil(seconds)
    days, rest = divmod(whole, 86400)
    return f"{days}-{rest // 3600:02d}:{rest // 60 % 60:02d}:{rest % 60:02d}"
