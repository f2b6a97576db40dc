"""The record of what generated code is: made once, to JSON and back, and nothing else taken for it."""

from __future__ import annotations

import functools
import json
from typing import Any

import pytest

import symdyn as sd
from symdyn.backend.metadata import Chart, EventRecord, Metadata, ModuleMetadata
from symdyn.errors import SymdynError


@functools.cache
def ball() -> ModuleMetadata:
    """A body that turns by Euler angles, with an event that resets, a constraint, an output and a load that jumps."""
    m, c = sd.parameters("m c", positive=True)
    system = sd.System("ball", gravity=[0, 0, -9.81])
    body = system.add_body("b", mass=m, inertia=[[1, 0, 0], [0, 2, 0], [0, 0, 3]])
    system.add_joint(sd.Free("hull", parent=system.ground, child=body, coordinates=sd.coordinates("x y z a b g"),
                             orientation=sd.EulerAngles("ZYX")))
    x = next(q for q in system.joints[0].coordinates if q.name == "x")
    system.add_constraint(x - 1, name="wall")
    system.add_force(body, [0, 0, -c * sd.velocity(body)[2] / abs(sd.velocity(body)[2])])
    z = next(q for q in system.joints[0].coordinates if q.name == "z")
    system.add_event("floor", z, direction=-1, reset={z.dot: -z.dot})
    system.add_output("height", z)
    return system.augmented().compile("numpy").metadata


def test_it_goes_to_json_and_back() -> None:
    record = ball()
    back = ModuleMetadata.of_plain(json.loads(json.dumps(record.as_plain())))
    assert back == record and hash(back.names("x")) == hash(record.x)
    assert record.constraints == ("wall",) and record.holonomic == (True,) and record.outputs == (("height", ()),)
    assert record.events == (EventRecord("floor", -1, False, (record.x.index("z_dot"),), True, (), ()),)
    assert record.charts == (Chart("hull", "ZYX", "rates", "b"),) and len(record.switches) == 1


def test_names_and_sizes_belong_together() -> None:
    record = ball()
    for group in ("q", "u", "z", "ud", "inputs", "x"):
        assert getattr(record.sizes, group) == len(record.names(group))
    assert record.sizes.p == len(record.names("parameters"))
    assert list(record.initial_values("q")) == list(record.q)
    with pytest.raises(ValueError, match="there is no group 'p' of names; there are q, u, z, ud, inputs, parameters, x"):
        record.names("p")


@pytest.mark.parametrize(("change", "message"), [
    ({"q": "x"}, r"Metadata\.q of a module's metadata is 'x', where tuple\[str, \.\.\.\] is wanted; write the module again"),
    ({"n_c": 1.5}, r"Metadata\.n_c of a module's metadata is 1\.5, where <class 'int'> is wanted"),
    ({"n_c": True}, r"Metadata\.n_c of a module's metadata is True"),
    ({"shapes": {"rhs": [2.5]}}, r"Metadata\.shapes\['rhs'\]\[0\] of a module's metadata is 2\.5"),
    ({"initial": {"x": "1"}}, r"Metadata\.initial\['x'\] of a module's metadata is '1'"),
    ({"events": [["floor", -1]]}, r"Metadata\.events\[0\] of a module's metadata is \['floor', -1\], where name, dir"),
])
def test_what_is_no_such_record_is_rejected(change: dict[str, Any], message: str) -> None:
    with pytest.raises(SymdynError, match=message):
        ModuleMetadata.of_plain({**ball().as_plain(), **change})


def test_missing_entries_are_named() -> None:
    with pytest.raises(SymdynError, match=r"Metadata of a module's metadata: .*'units'; write the module again"):
        Metadata.of_plain({k: v for k, v in ball().as_plain().items() if k != "units"})
    with pytest.raises(SymdynError, match="Metadata of a module's metadata is 3, where names with values are wanted"):
        Metadata.of_plain(3)  # type: ignore[arg-type]
