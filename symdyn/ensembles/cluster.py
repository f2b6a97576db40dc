"""The lines of a sweep file about a cluster, and what contradicts itself in them.

    cluster = "slurm"                   # an array of 16 workers of one core, with the defaults of the site
    dask = "tcp://host:8786"            # the workers of a Dask scheduler
    cluster = "folder"                  # every `symdyn sweep FILE` that is started shares the work, on whatever machine

    [cluster]                           # the same in full
    kind = "slurm"
    workers = 64
    cores = 4                           # of each worker
    memory = "4 GB"                     # of each worker
    time = "04:00:00"                   # after which Slurm ends a worker
    partition = "batch"
    account = "ab0123"
    qos = "normal"
    nodes = 8                           # in place of workers and cores: whole nodes
    gpus = 4                            # of each worker, or of each node, where the device is a GPU; default: 1
    lease = 120                         # s without a sign of life after which others take over what a worker has
    price = 0.03                        # of a core for an hour, for --dry-run
    address = "tcp://host:8786"         # with kind = "dask"
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import time as time_of_day
from typing import Any

from symdyn.ensembles.claims import LEASE
from symdyn.shown import shown

KINDS = ("slurm", "dask", "folder")
# Key -> kinds of clusters that take it.
KEYS = {**dict.fromkeys(("kind", "workers", "cores", "price"), KINDS), **dict.fromkeys(("memory", "lease"), ("slurm", "folder")),
        **dict.fromkeys(("time", "partition", "account", "qos", "nodes", "gpus"), ("slurm",)), "address": ("dask",)}
WHY = {"memory": "Dask's workers have theirs already", "lease": "Dask itself notices workers that are lost",
       "time": "only Slurm ends workers at a time", "address": "it is of Dask",
       **dict.fromkeys(("partition", "account", "qos", "nodes", "gpus"), "it is of Slurm")}
# Workers of one line.
WORKERS = 16
# Seconds of a lease at the most: the waiting times of some systems are counted in 32 bits.
LONGEST = 1e7
# Numbers in the table are below this.
LARGEST = 1e18
# Names of partitions and accounts stand in a script of the shell.
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.,@+-]*")
SIZES = {"MB": 10**6, "GB": 10**9, "TB": 10**12, "MiB": 2**20, "GiB": 2**30, "TiB": 2**40}


@dataclass(frozen=True)
class Cluster:
    """Where a sweep is computed.

    cores    of each worker; None: those of its node
    memory   of each worker, bytes;  time: after which a worker is ended, s;  price: of a core for an hour
    nodes    whole nodes are requested, one for each worker
    gpus     that each worker asks for, where the device is a GPU; None: one
    """

    kind: str
    workers: int | None = None
    cores: int | None = None
    memory: int | None = None
    time: float | None = None
    partition: str | None = None
    account: str | None = None
    qos: str | None = None
    nodes: bool = False
    lease: float = LEASE
    price: float | None = None
    address: str | None = None
    gpus: int | None = None


def read_cluster(content: Mapping[str, Any], faults: list[str]) -> Cluster | None:
    """The cluster that a sweep file names; what is wrong is added to the faults."""
    before = len(faults)
    given, dask = content.get("cluster"), content.get("dask")
    if dask is not None and not (isinstance(dask, str) and dask):
        faults.append(f"dask: must be the address of a scheduler such as \"tcp://host:8786\", found {shown(dask, 80)}")
        dask = None
    if given is None:
        return None if dask is None else Cluster("dask", address=dask)
    table: Mapping[str, Any] = {"kind": given} if isinstance(given, str) else given
    if not isinstance(table, Mapping):
        faults.append(f"cluster: must be one of {', '.join(KINDS)}, or a table with such a kind, found {shown(given, 80)}")
        return None
    kind = table.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        near = difflib.get_close_matches(str(kind), KINDS, 1)
        where = "cluster" if isinstance(given, str) else "cluster.kind"
        faults.append(f"{where}: " + ("is missing" if kind is None else f"there is no {shown(kind, 80)}")
                      + (f", did you mean {near[0]}?" if near else f"; there are {', '.join(KINDS)}"))
        kind = None
    elif dask is not None and kind != "dask":
        faults.append(f"cluster and dask: {kind} and Dask are both asked for; keep one of the lines")
    elif dask is not None and table.get("address", dask) != dask:
        faults.append(f"cluster.address and dask: two schedulers are asked for, {shown(table['address'], 80)} and "
                      f"{shown(dask, 80)}; keep one of them")
    values = _values(table, kind, faults)
    for other in ("workers", "cores"):
        if "nodes" in table and other in table:
            faults.append(f"cluster.nodes and cluster.{other}: nodes asks for whole nodes, with one worker on each that uses all "
                          f"of its cores; leave {other} out, or leave nodes out")
    if kind is None or len(faults) > before:
        return None
    if "nodes" in values:
        return Cluster(**{**values, "workers": values["nodes"], "nodes": True})
    if kind == "slurm":
        values = {"workers": WORKERS, "cores": 1, **values}
    if dask is not None:
        values["address"] = dask
    return Cluster(**values)


def _values(table: Mapping[str, Any], kind: str | None, faults: list[str]) -> dict[str, Any]:
    """Values of the table's keys, as Cluster holds them."""
    values: dict[str, Any] = {}
    for key, value in table.items():
        where = f"cluster.{key}"
        if key not in KEYS:
            near = difflib.get_close_matches(key, KEYS, 1)
            faults.append(f"{where}: not known" + (f", did you mean {near[0]}?" if near else f"; known are {', '.join(KEYS)}"))
        elif kind is not None and kind not in KEYS[key]:
            faults.append(f"{where}: does not go with {kind}: {WHY[key]}; leave it out")
        elif (result := _value(key, value)) is None:
            faults.append(f"{where}: must be {WANTED[key]}, found {shown(value, 80)}")
        else:
            values[key] = result
    return values


WANTED = {"lease": f"a number of seconds from 1 to {LONGEST:.0e}", "price": f"a positive number below {LARGEST:.0e}",
          "memory": f'a size such as "4 GB", below {LARGEST:.0e} bytes',
          "kind": f"one of {', '.join(KINDS)}", "address": 'an address such as "tcp://host:8786"',
          "time": 'a time such as "04:00:00" (hours, minutes, seconds) or "2-12:00:00" (with days, 99999 at the most)',
          **dict.fromkeys(("workers", "cores", "nodes", "gpus"), f"a whole number from 1 on, below {LARGEST:.0e}"),
          **dict.fromkeys(("partition", "account", "qos"), "a name of letters, digits and _ . , @ + -")}


def _value(key: str, value: Any) -> Any:
    """The value of a key; None if it is not as it must be."""
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if key in ("workers", "cores", "nodes", "gpus"):
        return value if number and isinstance(value, int) and 1 <= value < LARGEST else None
    if key == "lease":
        return float(value) if number and 1 <= value <= LONGEST else None
    if key == "price":
        return float(value) if number and 0 < value < LARGEST else None
    if key == "time":
        return _seconds(value)
    if not isinstance(value, str):
        return None
    if key == "memory":
        match = re.fullmatch(rf"(\d+(?:\.\d+)?) ?({'|'.join(SIZES)})", value)
        size = float(match[1]) * SIZES[match[2]] if match else 0.0
        return round(size) or None if size < LARGEST else None
    return value if (key in ("kind", "address") and value) or NAME.fullmatch(value) else None


def _seconds(value: Any) -> float | None:
    """Seconds of a time limit."""
    if isinstance(value, time_of_day):  # TOML's 04:00:00 without quotes
        value = value.strftime("%H:%M:%S")
    match = re.fullmatch(r"(?:(\d{1,5})-)?(\d{1,4}):(\d\d):(\d\d)", value) if isinstance(value, str) else None
    if match is None:
        return None
    days, hours, minutes, seconds = (int(part or 0) for part in match.groups())
    return 86400.0 * days + 3600 * hours + 60 * minutes + seconds or None


def in_time(seconds: float) -> str:
    """A duration in words."""
    for limit, unit, size in ((120, "s", 1), (7200, "min", 60), (172800, "h", 3600)):
        if seconds < limit:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 86400:.3g} days"
