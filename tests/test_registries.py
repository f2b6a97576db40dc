"""Kinds of joints, kinds of loads and methods of integration are known wherever they are listed."""

from __future__ import annotations

import inspect
from pathlib import Path

import pytest

import symdyn as sd
from symdyn.backend.methods import METHODS
from symdyn.backend.right_side import METHOD
from symdyn.cli.parser import make_parser
from symdyn.datafile import forms
from symdyn.lab import draft
from symdyn.model import elements, joints
from symdyn.pictures import looks
from symdyn.runtime.module import Module
from tests.formulation import general
from tests.model.joint_motion import drawn

DOCS = Path(__file__).parents[1] / "docs"
# Joints that users write: a joint of assumed modes comes from a beam.
USERS = [kind for kind in joints.KINDS if kind is not joints.Modal]


def test_kinds_are_those_that_files_define() -> None:
    """Classes in the files of the folders, whether they are listed or not."""
    folders = {joints: joints.Joint, elements: elements.Element}
    for package, common in folders.items():
        known, seen = set(package.KINDS), set()
        pending = [common]
        while pending:
            for kind in pending.pop().__subclasses__():
                pending.append(kind)
                if kind.__module__.startswith(package.__name__):
                    seen.add(kind)
        leaves = {kind for kind in seen if not kind.__subclasses__() or kind in known}
        assert leaves == known - {elements.AddedMass}


@pytest.mark.parametrize("kind", joints.KINDS)
def test_a_joint_is_in_data_files(kind: type[joints.Joint]) -> None:
    assert [form.word for form in forms.JOINTS if form.kind is kind] == [kind.__name__]
    assert next(form for form in forms.JOINTS if form.kind is kind).entries["parent"].required


@pytest.mark.parametrize("kind", [kind for kind in USERS if kind is not joints.Custom])
def test_a_joint_is_drawn_by_its_motion(kind: type[joints.Joint]) -> None:
    """Where the origin of the child's frame moves, a rail is drawn if there is an axis, else nothing; where it stays, a joint."""
    joint = kind("joint", "parent", "child", **({"pitch": 0.5} if kind is joints.Helical else {}))
    algebra, s, u = drawn(joint, 1)
    moves = any(d != 0 for d in joint.motion(algebra, s, u).d)
    slides = moves and hasattr(joint, "axis")
    assert (kind.kind in looks._FLOATING, kind.kind in looks._SLIDING) == (moves and not slides, slides)


@pytest.mark.parametrize("kind", USERS)
def test_a_joint_is_in_the_reference_and_in_random_mechanisms(kind: type[joints.Joint]) -> None:
    name = kind.__name__
    assert getattr(sd, name) is kind
    assert f".. autoclass:: symdyn.{name}\n" in (DOCS / "reference" / "joints.rst").read_text(encoding="utf-8")
    assert name in draft.SPATIAL
    if name not in ("Custom", "Fixed"):
        letters = {"Revolute": "Rz", "Prismatic": "Px"}.get(name, name[:2])
        assert type(general.chain(letters).joints[0]) is kind


@pytest.mark.parametrize("kind", elements.KINDS)
def test_a_load_is_in_data_files_and_in_the_reference(kind: type) -> None:
    name = kind.__name__
    assert getattr(sd, name) is kind
    assert [form.word for form in forms.LOADS if form.kind is kind] == [name]
    pages = "".join(page.read_text(encoding="utf-8") for page in (DOCS / "reference").glob("*.rst"))
    assert f".. autoclass:: symdyn.{name}\n" in pages


@pytest.mark.parametrize("name", METHODS)
def test_a_method_is_in_the_command_line_and_in_the_documentation(name: str) -> None:
    simulate = next(action.choices["simulate"] for action in make_parser()._actions if isinstance(action.choices, dict))
    assert f"{name} (" in " ".join(simulate.format_help().split())
    assert f'`"{name}"`' in (DOCS / "choosing_a_method.md").read_text(encoding="utf-8")
    for documented in (Module.simulate, Module.ode_solver):
        assert f'"{name}"' in (inspect.getdoc(documented) or "")


def test_signatures_show_the_method_that_is_the_default() -> None:
    """The site shows a signature as it is written, so each has the name itself."""
    functions = [Module.ode_solver, Module.periodic, sd.fit, sd.systems.pendulum().embedding().write]
    assert {inspect.signature(function).parameters["method"].default for function in functions} == {METHOD}
