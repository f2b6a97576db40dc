"""A sweep that is killed goes on, and ends with the same file, to the byte."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from symdyn.cli import main

SWEEP = """
system = "double_pendulum"
t = [0, 1]
sampling = "latin_hypercube"
count = 400
chunk = 5
outcomes = ["end q1", "max q2"]
[parameters]
l1 = {from = 0.5, to = 1.5}
[initial]
q1 = {from = -1, to = 1}
"""


def asked(folder, out):
    return ["sweep", str(folder / "sweep.toml"), "--no-picture", "--output", str(folder / out)]


@pytest.mark.skipif(os.name != "posix", reason="kill -9 is of POSIX")
def test_a_run_that_is_killed_at_any_moment_ends_as_an_undisturbed_one(tmp_path, capsys):
    (tmp_path / "sweep.toml").write_text(SWEEP)
    assert main(asked(tmp_path, "whole")) == 0
    chunks = tmp_path / "part" / "chunks"
    enough = np.random.default_rng(6).integers(1, 60)
    run = subprocess.Popen([sys.executable, "-m", "symdyn", *asked(tmp_path, "part")], stdout=subprocess.DEVNULL)
    while run.poll() is None and len(list(chunks.glob("0*.npz"))) < enough:
        time.sleep(0.001)
    run.send_signal(signal.SIGKILL)
    assert run.wait() == -signal.SIGKILL
    there = len(list(chunks.glob("0*.npz")))
    assert enough <= there < 80 and not (tmp_path / "part" / "ensemble.npz").exists()
    assert main([*asked(tmp_path, "part"), "--resume"]) == 0
    assert f"{5 * there} of them computed before" in capsys.readouterr().out
    assert (tmp_path / "part" / "ensemble.npz").read_bytes() == (tmp_path / "whole" / "ensemble.npz").read_bytes()
    assert not chunks.exists()
