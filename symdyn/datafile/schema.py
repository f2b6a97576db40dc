"""The JSON schema of data files, by which editors complete and check them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from symdyn.datafile.forms import (
    ASSUMPTIONS,
    BEAM,
    DRAWN,
    ORIENTATIONS,
    OUTPUT_POINTS,
    PLAIN,
    SHAPES,
    SYMBOLS,
    TABLES,
    Form,
)
from symdyn.datafile.write import FORMAT

Schema = dict[str, Any]
_TEXT: Schema = {"type": "string"}
_FLAG: Schema = {"type": "boolean"}
_VALUE: Schema = {"type": ["number", "string"], "description": "a number, or an expression in quotation marks"}
_LIST: Schema = {"type": "array", "items": _VALUE}
_ROWS: Schema = {"type": "array", "items": {"anyOf": [_VALUE, _LIST]}}
_ONE_OR_MORE: Schema = {"anyOf": [_VALUE, _LIST]}
_TEXTS: Schema = {"type": "array", "items": _TEXT}
_SIMPLE: dict[str, Schema] = {
    **dict.fromkeys(("text", "symbol"), _TEXT), "flag": _FLAG, "whole": {"type": "integer"},
    "body": {"type": "string", "description": "the name of a body, or ground"},
    "joint": {"type": "string", "description": "the name of a joint"},
    **dict.fromkeys(("expression", "thrust"), _VALUE), **dict.fromkeys(("expressions", "vector"), _LIST), "matrix": _ROWS,
    **dict.fromkeys(("values", "friction"), _ONE_OR_MORE),
    **dict.fromkeys(("symbols", "texts", "bodies"), _TEXTS)}


def data_file_schema() -> dict[str, object]:
    """The JSON schema (draft 7) of data files of `sd.read_system`, as a dictionary; `symdyn schema` prints it.

    >>> sorted(sd.data_file_schema()["required"])
    ['format', 'name']
    """
    numbers = {"type": "object", "additionalProperties": {"type": "number"}}
    properties: Schema = {
        "format": {"const": FORMAT}, "name": _TEXT, "planar": _FLAG, "gravity": _LIST, "duration": {"type": "number"},
        "parameter_order": _SIMPLE["symbols"], "extra_coordinates": _SIMPLE["symbols"],
        "ground_motion": _table({"position": _LIST, "angles": _LIST, "sequence": _TEXT}),
        "chosen_speeds": {"type": "object", "additionalProperties": _VALUE},
        **{table: {"type": "object", "additionalProperties": {"anyOf": [{"type": "number"}, _symbol(words)]}}
           for table, words in SYMBOLS.items()},
        "initial": numbers, "units": {"type": "object", "additionalProperties": _TEXT},
        **{table: {"type": "array", "items": _one_of(forms)} for table, forms in TABLES.items()},
        "states": _tables({"symbol": _TEXT, "rate": _VALUE}, "symbol", "rate"),
        "constraints": _tables({"name": _TEXT, "expression": _VALUE}, "expression"),
        "outputs": _tables({"name": _TEXT, "value": _VALUE, "values": _LIST, "quantity": {"enum": list(OUTPUT_POINTS)},
                            "body": _SIMPLE["body"], "point": _LIST}, "name"),
        "events": _tables({"name": _TEXT, "value": _VALUE, "direction": {"enum": [-1, 0, 1]}, "stop": _FLAG,
                           "reset": {"type": "object", "additionalProperties": _VALUE}}, "name", "value"),
        "shapes": {"type": "array", "items": {"anyOf": [_drawn(kind) for kind in DRAWN]}}}
    return {"$schema": "http://json-schema.org/draft-07/schema#", "title": "A mechanism for symdyn",
            **_table(properties, "format", "name")}


def _table(properties: Mapping[str, Schema], *required: str) -> Schema:
    return {"type": "object", "properties": dict(properties), "required": list(required), "additionalProperties": False}


def _tables(properties: Mapping[str, Schema], *required: str) -> Schema:
    return {"type": "array", "items": _table(properties, *required)}


def _symbol(words: tuple[str, ...]) -> Schema:
    numbers = {word: _TEXT if word == "unit" else {"type": "number"} for word in words}
    return _table({**numbers, **dict.fromkeys(ASSUMPTIONS, _FLAG)})


def _one_of(forms: list[Form]) -> Schema:
    return _form(forms[0], False) if len(forms) == 1 else {"anyOf": [_form(form, True) for form in forms]}


def _form(form: Form, typed: bool) -> Schema:
    properties = {**({"type": {"const": form.word}} if typed else {}),
                  **{name: _kind(entry.kind) for name, entry in form.entries.items()}}
    required = [*(["type"] if typed else []), *(name for name, entry in form.entries.items() if entry.required)]
    return {"description": form.about, **_table(properties, *required)}


def _kind(kind: str) -> Schema:
    if kind in _SIMPLE:
        return _SIMPLE[kind]
    shape = _one_of(SHAPES)
    angles, parameters = ORIENTATIONS
    special: dict[str, Schema] = {"boxes": {"type": "array", "items": _form(PLAIN["boxes"], False)},
            "shape": {"type": "array", "items": shape, "maxItems": 2}, "spheres": {"type": "array", "items": shape},
            "planes": {"type": "array", "items": shape},
            "orientation": _table({"type": {"enum": [angles.__name__, parameters.__name__]}, "sequence": _TEXT,
                                   "speeds": {"enum": ["rates", "body"]}}, "type"),
            "beam": {"type": "object", "required": list(BEAM)}}
    return special.get(kind) or _form(PLAIN[kind], False)


def _drawn(kind: str) -> Schema:
    lengths, others = DRAWN[kind]
    return _table({"body": _SIMPLE["body"], "kind": {"const": kind}, "color": {}, **dict.fromkeys(lengths, _ROWS),
                   **{name: {"type": ["number", "string"]} for name in others}}, "body", "kind")
