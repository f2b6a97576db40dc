"""Sweep files and `symdyn sweep`: what they ask for, every fault with its key, and the files that are written."""

from __future__ import annotations

import argparse
import json
import shlex
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest

import symdyn as sd
from symdyn.cli import main, sweep
from symdyn.runtime.building.recall import recall

GOOD = """
system = "double_pendulum"
t = {from = 0, to = 0.5, count = 11}
sampling = "sobol"
count = 24
seed = 4
rtol = 1e-7
chunk = 5
outcomes = ["end q1", "trace q2", "q1 at 0.25"]
scatter = [["l1", "end q1"]]
[parameters]
m1 = 1.5
l1 = {from = 0.5, to = 1.5}
[initial]
q1 = {distribution = "normal", mean = 1.0, std = 0.1}
q2_dot = 0.3
"""


def write(folder, text, name="sweep.toml"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_a_sweep_is_the_ensemble_of_its_file(tmp_path, capsys):
    assert main(["sweep", write(tmp_path, GOOD), "--jobs", "2", "--output", str(tmp_path / "out")]) == 0
    told = capsys.readouterr().out
    assert "double_pendulum: 24 samples of l1, q1, 24 in" in told and "end q1: mean" in told and "wrote" in told
    assert (tmp_path / "out" / "ensemble.png").stat().st_size > 10_000
    varied = {"l1": {"from": 0.5, "to": 1.5}, "q1": {"distribution": "normal", "mean": 1, "std": 0.1}}
    samples = sd.Samples(varied, "sobol", 24, 4)
    same = sd.ensemble(recall("double_pendulum", {}), samples, np.linspace(0, 0.5, 11), ["end q1", "trace q2", "q1 at 0.25"],
                       params={"m1": 1.5}, u={"q2_dot": 0.3}, rtol=1e-7)
    assert same.file.read_bytes() == (tmp_path / "out" / "ensemble.npz").read_bytes()
    assert main(["sweep", write(tmp_path, GOOD), "--output", str(tmp_path / "out")]) == 2
    assert "holds an ensemble already" in capsys.readouterr().err
    assert main(["sweep", write(tmp_path, GOOD), "--output", str(tmp_path / "out"), "--resume", "--no-picture"]) == 0
    assert "24 of them computed before" in capsys.readouterr().out


def test_failed_members_are_printed(tmp_path, capsys):
    text = 'system = "double_pendulum"\nt = [0, 2]\nmax_steps = 10\n[initial]\nq1 = {from = 0.5, to = 1, count = 5}\n'
    assert main(["sweep", write(tmp_path, text), "--output", str(tmp_path / "out"), "--no-picture"]) == 0
    told = capsys.readouterr().out
    assert "5 samples failed:" in told and "sample 0 (q1 = 0.5): double_pendulum: stopped at t" in told and "and 2 more" in told
    assert len((tmp_path / "out" / "failures.jsonl").read_text().splitlines()) == 5


def test_the_system_of_a_python_file(tmp_path, capsys):
    (tmp_path / "mine.py").write_text("import symdyn as sd\n\n\ndef system(name='pendulum'):\n    return sd.systems.get(name)\n")
    text = 't = [0, 0.1]\noptions = {name = "pendulum"}\n[initial]\nq1 = [0.1, 0.2]\n'
    assert main(["sweep", write(tmp_path, text), "--system", str(tmp_path / "mine.py"), "--output", str(tmp_path / "out"),
                 "--no-picture", "--backend", "numpy", "--jobs", "1"]) == 0
    assert json.loads((tmp_path / "out" / "manifest.json").read_text())["backend"] == "numpy"
    assert "pendulum: 2 samples of q1" in capsys.readouterr().out


EVIL = """import pathlib
pathlib.Path(__file__).with_name("executed").touch()
import symdyn as sd
def system():
    return sd.systems.pendulum()
"""


@pytest.mark.parametrize("name", ["evil.py", "./evil.py", "{folder}/evil.py", "evil", "{folder}/evil", "double_pendulum.py"])
@pytest.mark.parametrize("sub", ["", "deeper"])
def test_a_sweep_file_runs_no_program(tmp_path, capsys, monkeypatch, name, sub):
    monkeypatch.chdir(tmp_path)
    for program in ("evil.py", "evil", "double_pendulum.py"):
        write(tmp_path, EVIL, program)
    (tmp_path / sub).mkdir(exist_ok=True)
    text = f'system = "{name.format(folder=tmp_path.as_posix())}"\nt = [0, 0.1]\n[initial]\nq1 = [0.1, 0.2]\n'
    assert main(["sweep", write(tmp_path / sub, text), "--no-picture"]) == 2
    told = capsys.readouterr().err
    assert not list(tmp_path.rglob("executed")) and not (tmp_path / "generated").exists()
    for part in ("system: must be a system of the catalogue", f"found '{name.format(folder=tmp_path.as_posix())}'"[:80],
                 "runs no program", "--system ", "symdyn.ensemble(system, "):
        assert part in told, (part, told)


def test_the_command_that_the_message_names_runs_the_program(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(tmp_path, EVIL, "evil.py")
    path = write(tmp_path, 'system = "evil.py"\nt = [0, 0.1]\n[initial]\nq1 = [0.1, 0.2]\n')
    assert main(["sweep", path]) == 2
    command = capsys.readouterr().err.split("symdyn sweep ")[1].split(";")[0]
    assert main(["sweep", *shlex.split(command), "--no-picture", "--backend", "numpy", "--jobs", "1"]) == 0
    assert (tmp_path / "executed").exists() and "pendulum: 2 samples of q1" in capsys.readouterr().out


@pytest.mark.parametrize("output", ["..", "../..", "../out", "a/../../out", "{folder}/out", "{folder}", ".", "", "./", "link",
                                    "link/out", "loop/out", "a\\u0000b", "C:/out", "C:out", "//host/share/out", "..\\\\out",
                                    "~/../out"])
def test_a_sweep_file_writes_nowhere_but_below_its_folder(tmp_path, capsys, monkeypatch, output):
    home = tmp_path / "home"
    home.mkdir()
    (tmp_path / "elsewhere").mkdir()
    (home / "link").symlink_to(tmp_path / "elsewhere")
    (home / "loop").symlink_to(home / "loop")
    monkeypatch.chdir(tmp_path)
    output = output.format(folder=(tmp_path / "elsewhere").as_posix())
    text = f'system = "pendulum"\nt = [0, 0.1]\noutput = "{output}"\n[initial]\nq1 = [0.1, 0.2]\n'
    path = write(home, text)
    before = sorted(tmp_path.rglob("*"))
    assert main(["sweep", path, "--no-picture", "--backend", "numpy", "--jobs", "1"]) == 2
    told = capsys.readouterr().err
    assert "output: must be" in told and (not output or ("a folder below" in told and "--output DIR" in told)), told
    assert sorted(tmp_path.rglob("*")) == before


def test_results_of_a_sweep_file_lie_below_its_folder(tmp_path, monkeypatch):
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.chdir(tmp_path)
    path = write(home, 'system = "pendulum"\nt = [0, 0.1]\noutput = "a/b"\n[initial]\nq1 = [0.1, 0.2]\n')
    assert main(["sweep", path, "--no-picture", "--backend", "numpy", "--jobs", "1"]) == 0
    assert (home / "a" / "b" / "ensemble.npz").is_file() and not (tmp_path / "a").exists()
    assert main(["sweep", path, "--no-picture", "--backend", "numpy", "--jobs", "1", "--output", "../elsewhere"]) == 0
    assert (tmp_path.parent / "elsewhere" / "ensemble.npz").is_file()


@pytest.mark.parametrize("backend, jobs, expected", [
    ("c", 3, ThreadPoolExecutor), ("numpy", 3, ProcessPoolExecutor), ("numpy", 1, ThreadPoolExecutor)])
def test_compiled_code_runs_in_threads_and_python_in_processes(backend, jobs, expected):
    with sweep._executor(argparse.Namespace(dask=None, jobs=jobs), SimpleNamespace(backend=backend)) as make, make() as made:
        assert isinstance(made, expected) and made._max_workers == jobs


def test_every_fault_is_reported_with_its_key(tmp_path, capsys):
    text = """
system = "double_pendulum"
tt = 3
t = [3]
rtol = -1
count = 0
seed = "x"
consistent = 1
sampling = "sobbol"
outcomes = "end q1"
scatter = [["l1"]]
options = {n = [2]}
[parameters]
m1 = [1, "a", 3]
l1 = {from = 0.5}
I1 = {distribution = "norml"}
I2 = nan
g = {distribution = "normal", mean = 1, std = -1, sd = 3}
m9 = 4
[initial]
q1 = true
"""
    assert main(["sweep", write(tmp_path, text)]) == 2
    told = capsys.readouterr().err
    for fault in ("tt: not known, did you mean t?", "t: must be [start, end]", "rtol: must be a positive number, found -1",
                  "count: must be a whole number from 1 on, found 0", "seed: must be a whole number from 0 on, found 'x'",
                  "consistent: must be true or false, found 1", "sampling: must be one of paired, grid",
                  "outcomes: must be a list of texts", "scatter: must be a list of pairs", "options.n: must be a number",
                  "parameters.m1: give a number, a list", "parameters.l1.to: is missing", "did you mean normal?",
                  "parameters.I2: must be finite", "parameters.g.sd: not known here, did you mean std?",
                  "parameters.g: normal needs std > 0", "parameters.m9: double_pendulum has no such name", "initial.q1: give a"):
        assert fault in told, fault
    assert "has 18 faults" in told


@pytest.mark.parametrize("text, message", [
    ("t = [", "not TOML: "),
    ('[parameters]\nl1 = [1, 2]\n', "system: is missing"),
    ('system = "double_pendulum"\n', "nothing varies"),
    ('system = "double_pendulm"\n[parameters]\nl1 = [1, 2]\n', "did you mean double_pendulum"),
    ('system = "double_pendulum"\n[parameters]\nl1 = [1, 2]\n[initial]\nq1 = [1, 2, 3]\n', None),
    ('system = "double_pendulum"\nsampling = "paired"\n[parameters]\nl1 = [1, 2]\n[initial]\nq1 = [1, 2, 3]\n',
     "as many of each"),
    ('system = "double_pendulum"\n[parameters]\nl1 = {from = 0, to = 1}\n', "random needs a count"),
    ('system = "double_pendulum"\n[initial]\nl1 = [1, 2]\n', "initial.l1: double_pendulum has no such name"),
    ('system = "double_pendulum"\noutcomes = ["end q9", "q1 at 7"]\nt = [0, 1]\n[initial]\nq1 = [1, 2]\n',
     "2 faults:\n  - outcome 'end q9': there is no 'q9'"),
    ('system = "double_pendulum"\nscatter = [["m1", "end q1"], ["q1", "max q1"]]\n[initial]\nq1 = [1, 2]\n',
     "scatter[1]: 'm1' is neither varied nor an outcome\n  - scatter[2]: 'max q1' is no outcome"),
    ('system = "double_pendulum"\nt = {from = 0, to = 1}\n[initial]\nq1 = [1, 2]\n', "t.count: is missing"),
    ('system = "double_pendulum"\n[parameters]\nq = [1]\n[inputs]\nq = [1]\n', "inputs.q: q varies in another table already"),
    ('system = "double_pendulum"\nsystem = 3\n', "not TOML"),
    ('system = 3\n[initial]\nq1 = [1, 2]\n', "system: must be a text, found 3"),
])
def test_a_file_with_a_fault(tmp_path, capsys, text, message):
    code = main(["sweep", write(tmp_path, text), "--no-picture", "--output", str(tmp_path / "out")])
    told = capsys.readouterr().err
    assert (code, told) == (0, "") if message is None else (code == 2 and message in told), told


def test_arguments_that_do_not_fit(tmp_path, capsys):
    path = write(tmp_path, GOOD)
    assert main(["sweep", path, "--jobs", "0"]) == 2 and "--jobs must be 1 or more" in capsys.readouterr().err
    assert main(["sweep", path, "--jobs", "2", "--dask", "tcp://a"]) == 2 and "one of them" in capsys.readouterr().err
    assert main(["sweep", str(tmp_path / "no.toml")]) == 2 and "there is no such file" in capsys.readouterr().err
    assert main(["sweep", str(tmp_path)]) == 2 and "cannot be read" in capsys.readouterr().err
