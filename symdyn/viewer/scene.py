"""Scene that a page draws, as plain data: solids by rules, shapes of the user's, water."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.colors import to_hex

from symdyn.pictures.bending import Bending
from symdyn.pictures.looks import PALETTE, Item, Mechanism, color_of_body, looks_of
from symdyn.pictures.mechanism import filled
from symdyn.pictures.meshes import Part, beam, parts_of
from symdyn.pictures.solids import Water, color_of, water_of
from symdyn.viewer.arrays import plain, text_of

_GROUND_COLOR = "#9ca3af"
# Radius of a line a point of print wide, as a part of the mechanism's length.
_THREAD = 0.0012


def scene_of(m: Mechanism, records: Sequence[Mapping[str, Any]], lengths: np.ndarray, bent: Mapping[int, Bending],
             name: str) -> dict[str, Any]:
    """Items, meshes and water of a mechanism.

    records   shapes of the user's, with `lengths` in place of None; bent: flexible bodies by their index
    """
    with np.errstate(all="ignore"):
        items, length = looks_of(m)
    meshes, threads, water = [], [], None
    names = [*m.bodies, "ground"]
    for record in filled(records, lengths):
        if record["kind"] == "water":
            water = _water(water_of(record, name))
            continue
        body = names.index(record["body"])
        to = names.index(record["to"]) if record.get("to") is not None else None
        color = to_hex(color_of(record["color"], name)) if record["color"] is not None else (
            _GROUND_COLOR if body == len(m.bodies) else PALETTE[body % len(PALETTE)])
        for part in parts_of(record, body, (0.0, 0.0, 0.0), to, body in bent):
            if len(part.faces):
                meshes.append(_mesh(part, m, color, bent.get(body), length))
            else:
                threads += _threads(part, m, color, length)
    drawn = {mesh["body"] for mesh in meshes}
    for part in m.around.parts:
        color = to_hex(part.color)
        if len(part.faces):
            meshes.append({**_mesh(part, m, color, None, length), "ground": part.ground})
        else:
            threads += _threads(part, m, color, length)
    for body, bending in bent.items():
        if body not in drawn:
            part = beam(body, (0.0, 0.0, 0.0), bending.points, length)
            meshes.append(_mesh(part, m, color_of_body(body), bending, length))
    return {"bodies": list(m.bodies), "planar": m.planar,
            "length": length, "up": list(m.up), "items": [*map(_plain, items), *threads],
            "meshes": meshes, "water": water, "palette": list(PALETTE), "joints": [list(j) for j in m.joints],
            "n_points": len(m.points),
            "grounds": [[*map(_short, normal), _short(level)] for normal, level in m.around.planes]}


def _plain(item: Item) -> dict[str, Any]:
    result: dict[str, Any] = {"kind": item.kind, "ends": [_ref(end) for end in item.ends], "color": item.color, "name": item.name,
                              "size": [_short(v) for v in item.size], "body": item.body}
    if item.axis >= 0:
        result["axis"] = item.axis
    if item.turn:
        result["turn"] = [_short(v) for v in item.turn]
    if item.layer:
        result["layer"] = item.layer
    return result


def _ref(ref: Any) -> Any:
    return [_ref(v) for v in ref] if isinstance(ref, tuple) else _short(ref) if isinstance(ref, (float, np.floating)) else ref


def _short(value: Any) -> float:
    return float(f"{float(value):.7g}")


def _body_of(index: int, m: Mechanism) -> int:
    return -1 if index == len(m.bodies) else index


def _mesh(part: Part, m: Mechanism, color: str, bending: Bending | None, length: float) -> dict[str, Any]:
    triangles = [(face[0], a, b) for face in part.faces for a, b in pairwise(face[1:])]
    body = _body_of(part.body, m)
    result = {"body": body, "color": color, "name": m.bodies[body] if body >= 0 else "ground", "vertices": plain(part.vertices),
              "triangles": text_of(np.array(triangles, dtype="<u2"))}
    if bending is not None:
        stations, which = np.unique(part.stations, axis=0, return_inverse=True)
        of = bending.at_stations(stations)
        n = len(stations)
        result["bend"] = {"station": text_of(which.ravel().astype("<u2")), "shapes": plain(of.shapes.reshape(n, -1)),
                          "second": plain(of.second.reshape(n, -1)), "eta": list(bending.coordinates)}
    return result


def _threads(part: Part, m: Mechanism, color: str, length: float) -> list[dict[str, Any]]:
    """A line as thin rods from vertex to vertex; the last vertex may be on another body."""
    body, last = _body_of(part.body, m), len(part.vertices) - 1
    name = m.bodies[body] if body >= 0 else "ground"
    result = []
    for a, b, *_ in part.edges:
        end = body if part.to is None or b != last else _body_of(part.to, m)
        result.append(Item("thread", ((body, *part.vertices[a]), (end, *part.vertices[b])), (_THREAD * part.width * length,),
                           color, f"line of {name}", body))
    return [_plain(item) for item in result]


def _water(water: Water) -> dict[str, Any]:
    return {"level": water.level, "color": to_hex(water.color), "waves": water.waves,
            "reach": None if water.reach is None else [[float(v) for v in row] for row in water.reach]}
