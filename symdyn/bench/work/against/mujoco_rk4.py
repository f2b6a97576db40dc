"""MuJoCo with its Runge-Kutta method of order four at fixed steps, from the numbers of bodies and joints."""

from __future__ import annotations

import importlib.util
import time as clock
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from scipy.spatial.transform import Rotation

from symdyn.bench.toolchain import version
from symdyn.bench.work.against.mechanism import Link, Tree, between, calibrated, check_accelerations, tree_of
from symdyn.bench.work.against.peer import Failed, Ran, Runner, fitting

_STAGES, _ORDER = 4, 4
# Inertia that MuJoCo wants of every body, kg m^2.
_LEAST = 2e-14
_OFF = ("constraint", "equality", "frictionloss", "limit", "contact", "clampctrl", "warmstart", "actuation", "sensor",
        "autoreset")


@dataclass(frozen=True)
class Mujoco:
    """The program; a tolerance stands for the number of steps that gives about such an error."""

    name: str = "mujoco RK4"
    bodies = True

    @property
    def title(self) -> str:
        return f"MuJoCo {version('mujoco')} RK4, fixed steps; bodies and joints"

    def available(self) -> bool | str:
        there = importlib.util.find_spec("mujoco") is not None
        return there or "mujoco is not installed; run: pip install 'symdyn[peers]'"

    def prepare(self, equations: Any, params: np.ndarray, x0: np.ndarray, end: float, system: Any = None) -> Runner:
        tree = tree_of(system, equations, params)
        import mujoco

        with fitting("MuJoCo"):
            model = mujoco.MjModel.from_xml_string(text(tree))
        data = mujoco.MjData(model)
        force = np.array([link.force for link in tree.links])
        order = list(_depth_first(_children(tree), -1))  # as MuJoCo numbers its joints
        back = np.argsort(order)
        q0, u0 = tree.split(np.asarray(x0, dtype=float))

        def begin(q: np.ndarray, u: np.ndarray) -> None:
            mujoco.mj_resetData(model, data)
            data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q[order], u[order], force[order]

        def accelerations(q: np.ndarray, u: np.ndarray) -> np.ndarray:
            begin(q, u)
            mujoco.mj_forward(model, data)
            return np.array(data.qacc)[back]

        def motion(n: int, every: list[np.ndarray] | None = None) -> tuple[float, np.ndarray]:
            """n steps, and where it is requested, the state after every one of them."""
            model.opt.timestep = end / n
            begin(q0, u0)
            mujoco.set_mju_user_warning(lambda text: None)  # which it would write into a file; the state at the end shows it
            begun = clock.perf_counter()
            try:
                if every is None:
                    mujoco.mj_step(model, data, nstep=n)
                for _ in range(0 if every is None else n):
                    mujoco.mj_step(model, data)
                    every.append(tree.join(data.qpos[back], data.qvel[back]))  # type: ignore[union-attr]
            finally:
                seconds = clock.perf_counter() - begun
                mujoco.set_mju_user_warning(None)
            return seconds, tree.join(data.qpos[back], data.qvel[back])

        check_accelerations(tree, accelerations, equations, params, "MuJoCo")
        steps = calibrated(motion, _ORDER)

        def run(tolerance: float, times: np.ndarray | None = None) -> Ran:
            n, every = steps(tolerance), None if times is None else [np.asarray(x0, dtype=float)]
            seconds, x = motion(n, every)
            if not np.isfinite(x).all():
                raise Failed(f"MuJoCo with {n} steps: the state is not finite")
            if times is not None and every is not None:
                x = between(np.linspace(0.0, end, n + 1), every, equations, params, times)
            return seconds, _STAGES * n, x

        return run


def text(tree: Tree) -> str:
    """The model in MuJoCo's format; everything that it could do besides is switched off."""
    flags = " ".join(f'{name}="disable"' for name in _OFF)
    children = _children(tree)
    lines = ["<mujoco>", '<compiler angle="radian" inertiafromgeom="false" autolimits="false"/>',
             f'<option integrator="RK4" jacobian="dense" gravity="{_numbers(tree.gravity)}"><flag {flags}/></option>',
             "<worldbody>", *_bodies(tree, children, -1), "</worldbody>", "</mujoco>"]
    return "\n".join(lines)


def _children(tree: Tree) -> dict[int, list[int]]:
    """The links that each carries."""
    children: dict[int, list[int]] = {}
    for k, link in enumerate(tree.links):
        children.setdefault(link.parent, []).append(k)
    return children


def _depth_first(children: dict[int, list[int]], parent: int) -> Iterator[int]:
    for k in children.get(parent, ()):
        yield k
        yield from _depth_first(children, k)


def _bodies(tree: Tree, children: dict[int, list[int]], parent: int) -> Iterator[str]:
    for k in children.get(parent, ()):
        link = tree.links[k]
        turned = Rotation.from_matrix(link.R).as_quat(scalar_first=True)
        yield f'<body name="{k}" pos="{_numbers(link.p)}" quat="{_numbers(turned)}">'
        I = _inertia(link, tree.planar)
        entries = (I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2])
        yield f'<inertial pos="{_numbers(link.com)}" mass="{link.mass!r}" fullinertia="{_numbers(entries)}"/>'
        yield (f'<joint name={quoteattr(link.name)} type="{"hinge" if link.turning else "slide"}" axis="0 0 1" '
               f'stiffness="{link.stiffness!r}" damping="{link.damping!r}"/>')
        yield from _bodies(tree, children, k)
        yield "</body>"


def _inertia(link: Link, planar: bool) -> np.ndarray:
    """Moments of inertia that MuJoCo takes: positive, of a real body. In a plane only the entry about its normal matters."""
    I = link.inertia
    if planar and link.turning:
        return I[2, 2] * np.eye(3) + _LEAST * np.eye(3)
    return I + _LEAST * np.eye(3) if np.linalg.eigvalsh(I)[0] < _LEAST else I


def _numbers(values: Any) -> str:
    return " ".join(repr(float(v)) for v in values)


PEERS = (Mujoco(),)
