"""Sweep files: a TOML text that names the system, what varies and what is kept. Every fault is reported with its key.

A sweep file is data, which may come from anyone: it runs no program, and its results stay in the folder it lies in.

    system = "double_pendulum"          # of the catalogue; or leave it out and name a Python file on the command line
    options = {n = 2}                   # of the system
    t = [0, 10]                         # s; or {from = 0, to = 10, count = 101}
    rtol = 1e-8
    device = "gpu"                      # default: the processor
    precision = "single"                # of a GPU; default: double
    sampling = "latin_hypercube"        # or random, sobol, grid, paired
    count = 1000
    seed = 1
    outcomes = ["end q1", "max q2", "mean energy", "q1 at 2.5", "trace q1"]
    output = "results/my_sweep"         # inside the folder of this file; --output of the command line names any folder
    formats = ["parquet"]               # written next to ensemble.npz; or "zarr"
    cluster = "slurm"                   # see symdyn.ensembles.cluster; default: this machine

    [parameters]
    m1 = 1.5                            # the same for all
    m2 = [1, 2, 3]
    l1 = {from = 0.5, to = 1.5}         # with a count: evenly spaced values
    g = {distribution = "normal", mean = 9.81, std = 0.01}

    [initial]
    q1 = {distribution = "uniform", from = -1, to = 1}
"""

from __future__ import annotations

import difflib
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

import numpy as np

from symdyn.backend.metadata import ModuleMetadata
from symdyn.ensembles.axes import read_axis
from symdyn.ensembles.cluster import Cluster, read_cluster
from symdyn.ensembles.exports import EXPORTS
from symdyn.ensembles.samples import SAMPLINGS, Samples
from symdyn.errors import ArgumentError
from symdyn.runtime.batches.precision import PRECISIONS
from symdyn.shown import shown

TABLES = {"parameters": ("parameters",), "initial": ("q", "u", "z"), "inputs": ("inputs",)}
# Key -> what its value must be.
KEYS = {"system": "text", "options": "table", "formulation": "text", "coordinates": "text", "t": "times", "rtol": "positive",
        "atol": "positive", "method": "text", "max_steps": "whole", "max_step": "positive", "stabilization": "text",
        "device": "text", "precision": "text", "consistent": "true or false", "sampling": "text", "count": "whole",
        "seed": "whole", "chunk": "whole", "outcomes": "texts", "sensitivities": "texts", "scatter": "pairs",
        "output": "folder", "formats": "texts", "cluster": "cluster", "dask": "cluster", **dict.fromkeys(TABLES, "table")}
OPTIONS = ("rtol", "atol", "method", "max_steps", "max_step", "stabilization", "sensitivities", "device", "precision")
# No double is larger; whole numbers of TOML have any number of digits.
LARGEST = sys.float_info.max
CHOICES = {"formulation": ("auto", "embedding", "recursive", "augmented"), "coordinates": ("relative", "absolute"),
           "sampling": SAMPLINGS, "stabilization": ("projection", "baumgarte", "none"), "precision": tuple(PRECISIONS)}


@dataclass
class Sweep:
    """Sweep that a file requests.

    values   the texts, numbers and tables that stood there and are right
    folder   where results go: the file's `output`, inside the folder of the file; None without one
    cluster  where motions are computed; None: on this machine
    """

    values: dict[str, Any]
    folder: Path | None = None
    samples: Samples | None = None
    cluster: Cluster | None = None
    fixed: dict[str, dict[str, float]] = field(default_factory=dict)
    varied: dict[str, list[str]] = field(default_factory=dict)

    def arguments(self, module: Any) -> dict[str, Any]:
        """Arguments of `ensemble`. The names have been checked."""
        metadata, start = module.metadata, self.fixed.get("initial", {})
        states = {group: {n: v for n, v in start.items() if n in metadata.names(group)} or None for group in ("q", "u", "z")}
        return {"samples": self.samples, "t": self.values.get("t"), "outcomes": self.values.get("outcomes"), **states,
                "params": self.fixed.get("parameters") or None, "inputs": self.fixed.get("inputs") or None,
                "chunk": self.values.get("chunk"), "consistent": self.values.get("consistent", False),
                **{k: self.values[k] for k in OPTIONS if k in self.values}}

    def unknown_names(self, metadata: ModuleMetadata) -> list[str]:
        """Faults: names that the mechanism does not have."""
        faults = []
        for table, groups in TABLES.items():
            known = [n for g in groups for n in metadata.names(g)]
            for name in [*self.fixed.get(table, {}), *self.varied.get(table, [])]:
                if name not in known:
                    near = difflib.get_close_matches(name, known, 3)
                    hint = f", did you mean {' or '.join(near)}?" if near else f"; it has {', '.join(known) or 'none'}"
                    faults.append(f"{table}.{name}: {metadata.name} has no such name{hint}")
        return faults


def read_sweep(path: Path, faults: list[str], count: int | None = None) -> Sweep:
    """Read a sweep file; what is wrong with it is added to the faults.

    count   of samples, in place of that of the file
    """
    try:
        with path.open("rb") as file:
            content = tomllib.load(file)
    except FileNotFoundError:
        faults.append("there is no such file")
        return Sweep({})
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        faults.append(f"not TOML: {error}")
        return Sweep({})
    except OSError as error:
        faults.append(f"cannot be read: {error.strerror or error}")
        return Sweep({})
    if count is not None:
        content["count"] = count
    values: dict[str, Any] = {}
    for key, value in content.items():
        if KEYS.get(key) == "cluster":
            continue
        if key not in KEYS:
            near = difflib.get_close_matches(key, KEYS, 1)
            faults.append(f"{key}: not known" + (f", did you mean {near[0]}?" if near else f"; known are {', '.join(KEYS)}"))
            continue
        before = len(faults)
        taken = _value(key, value, KEYS[key], faults)
        if len(faults) == before:
            values[key] = taken
    sweep = Sweep(values, _inside(path.parent, values["output"], faults) if "output" in values else None)
    sweep.cluster = read_cluster(content, faults)
    _take_samples(sweep, content, faults)
    return sweep


def _value(key: str, value: Any, kind: str, faults: list[str]) -> Any:
    """A value of the kind, or a fault."""
    number = isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= LARGEST
    if kind == "times":
        return _times(key, value, faults)
    text = isinstance(value, str) and bool(value)
    fits = {"text": text, "folder": text, "table": isinstance(value, dict),
            "positive": number and value > 0, "whole": number and isinstance(value, int) and value >= (key != "seed"),
            "true or false": isinstance(value, bool), "texts": _are_texts(value),
            "pairs": isinstance(value, list) and all(_are_texts(v) and len(v) == 2 for v in value)}[kind]
    wanted = {"text": "a text", "folder": "the path of a folder, a text", "table": "a table",
              "positive": "a positive number", "true or false": "true or false",
              "whole": f"a whole number from {int(key != 'seed')} on", "texts": 'a list of texts such as ["max q1"]',
              "pairs": 'a list of pairs such as [["l1", "max q1"]]'}[kind]
    if not fits:
        faults.append(f"{key}: must be {wanted}, found {shown(value, 80)}")
    elif key in CHOICES and value not in CHOICES[key]:
        faults.append(f"{key}: must be one of {', '.join(CHOICES[key])}, found {shown(value, 80)}")
    elif key == "formats" and not set(value) <= set(EXPORTS):
        faults.append(f"formats: must be of {', '.join(EXPORTS)}, found {shown(value, 80)}; ensemble.npz is written always")
    elif key == "options":
        faults += [f"options.{k}: must be a number, a text or true or false, found {shown(v, 80)}" for k, v in value.items()
                   if not isinstance(v, (bool, int, float, str))]
    return value


def _inside(home: Path, output: str, faults: list[str]) -> Path | None:
    """The folder for results of a file that lies in `home`; a fault if it is not below it, links followed."""
    folder = None
    if output.isprintable() and ".." not in PurePosixPath(output).parts + PureWindowsPath(output).parts:
        try:
            folder = (home / output).resolve()
        except (OSError, RuntimeError):  # a circle of links, or a name longer than the disk takes
            folder = None
    if folder is None or PureWindowsPath(output).drive or home.resolve() not in folder.parents:
        faults.append("output: must be a folder below the one of the sweep file, such as \"results\", found "
                      f"{shown(output, 80)}; "
                      "a sweep file is data, and writes nowhere else. Any folder can be named on the command line: --output DIR")
        return None
    return home / output


def _are_texts(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(v, str) for v in value)


def _times(key: str, value: Any, faults: list[str]) -> Any:
    """(start, end), or output times."""
    before = len(faults)
    if isinstance(value, dict) and "count" not in value:
        faults.append(f"{key}.count: is missing")
        return None
    axis = read_axis(value, key, faults) if isinstance(value, (dict, list)) else None
    if len(faults) > before:
        return None
    times = axis.values if axis is not None else None
    if times is None or len(times) < 2 or not np.isfinite(times).all() or not (np.diff(times) > 0).all():
        faults.append(f"{key}: must be [start, end], a list of increasing times or {{from, to, count}}, found {shown(value, 80)}")
        return None
    return tuple(times.tolist()) if len(times) == 2 else times


def _take_samples(sweep: Sweep, content: Mapping[str, Any], faults: list[str]) -> None:
    """Numbers are the same for all members, the rest varies."""
    free: dict[str, Any] = {}
    before = len(faults)
    for table in TABLES:
        entries = content.get(table, {})
        if not isinstance(entries, dict):
            continue
        sweep.fixed[table], sweep.varied[table] = {}, []
        for name, value in entries.items():
            where = f"{table}.{name}"
            numbers = value if isinstance(value, list) else [value]
            if any(isinstance(v, (int, float)) and not abs(v) <= LARGEST for v in numbers):
                faults.append(f"{where}: must be finite, and within the range of double precision, found {shown(value, 80)}")
            elif isinstance(value, (int, float)) and not isinstance(value, bool):
                sweep.fixed[table][name] = float(value)
            elif name in free:
                faults.append(f"{where}: {name} varies in another table already")
            elif read_axis(value, where, faults) is not None:
                free[name] = value
                sweep.varied[table].append(name)
    if len(faults) > before:
        return
    if not free:
        faults.append("nothing varies: give a value in parameters, initial or inputs as a list, {from, to, count} or "
                      "{distribution, ...}")
        return
    if any(key in content and key not in sweep.values for key in ("sampling", "count", "seed")):
        return
    try:
        sweep.samples = Samples(free, **{k: sweep.values[k] for k in ("sampling", "count", "seed") if k in sweep.values})
    except ArgumentError as error:
        faults += str(error).splitlines()
