"""Programs in processes of their own, without the time of their imports."""

from __future__ import annotations

import multiprocessing
import os
import runpy
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

# Modules that most programs come to import; it takes a second and a half.
PRELOADED = ["symdyn.choice", "symdyn.pipeline", "symdyn.pictures", "symdyn.runtime.integrating.simulate", "symdyn.systems",
             "scipy.integrate", "scipy.optimize"]


def run_program(script: Path) -> subprocess.CompletedProcess[str]:
    """Run a file of Python in its folder. Where processes can be copied, it runs in a copy of one that has imported what most
    programs need, and nothing else."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return subprocess.run([sys.executable, str(script)], cwd=script.parent, capture_output=True, text=True, check=False)
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(PRELOADED)
    process = context.Process(target=_execute, args=(str(script), dict(os.environ)))
    process.start()
    process.join()
    assert process.exitcode is not None
    stdout, stderr = (script.with_suffix(ending).read_text(encoding="utf-8") for ending in (".stdout", ".stderr"))
    return subprocess.CompletedProcess(str(script), process.exitcode, stdout, stderr)


def passes_apart(check: Callable[[], None]) -> bool:
    """Whether a function at the top of a file of tests returns, in a process that holds nothing of other tests."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        process = multiprocessing.get_context("spawn").Process(target=check)
    else:
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload(PRELOADED)
        process = context.Process(target=check)  # type: ignore[assignment]
    process.start()
    process.join()
    return process.exitcode == 0


def _execute(script: str, environment: dict[str, str]) -> None:
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(Path(script).parent)
    for stream in (sys.stdout, sys.stderr):
        with open(Path(script).with_suffix(f".{stream.name.strip('<>')}"), "w") as file:
            os.dup2(file.fileno(), stream.fileno())
    sys.argv, sys.path[0] = [script], str(Path(script).parent)
    runpy.run_path(script, run_name="__main__")
