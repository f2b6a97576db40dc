"""The Stewart platform: its leg forces against Pinocchio's constraint dynamics, along a motion of the platform."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import symdyn as sd
from symdyn.runtime.building.compiler import find_compiler
from symdyn.systems.platforms import BASE, PLATFORM

TOLERANCE = 1e-12
TIMES = (0.0, 0.37, 1.1, 2.9)

# A value with its first two derivatives by time.
Jet = tuple[np.ndarray, np.ndarray, np.ndarray]


@functools.cache
def platform(backend: str) -> Any:
    return sd.systems.stewart_platform().augmented().compile(backend=backend)


@functools.cache
def numbers() -> dict[str, float]:
    return {str(p): float(v) for p, v in sd.systems.stewart_platform().defaults.items()}


# -- a motion of the platform, and the legs that follow it, by closed forms


def times(a: Jet, b: Jet) -> Jet:
    """The product of two matrices."""
    return a[0] @ b[0], a[1] @ b[0] + a[0] @ b[1], a[2] @ b[0] + 2 * a[1] @ b[1] + a[0] @ b[2]


def turned(axis: int, angle: float, rate: float, acceleration: float) -> Jet:
    """Rotation about a coordinate axis."""
    K = np.cross(np.eye(3)[axis], np.eye(3)).T
    R = np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * (K @ K)
    return R, rate * R @ K, acceleration * R @ K + rate**2 * R @ K @ K


def around(radius: float, degrees: float) -> np.ndarray:
    return radius * np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees)), 0.0])


def driven(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q, u, ud of all joints: x, y, z, a, b, c go as sines; a leg of length s points along (sin b, -sin a cos b, cos a cos b)."""
    size = np.array([0.15, -0.1, 0.12, 0.2, -0.15, 0.25])
    rate, phase = np.array([2.0, 3.0, 2.5, 1.7, 2.2, 3.1]), np.array([0.3, 1.0, -0.5, 0.2, 0.9, -1.2])
    wave = [size * np.sin(rate * t + phase), size * rate * np.cos(rate * t + phase), -size * rate**2 * np.sin(rate * t + phase)]
    wave[0][2] += 1.2
    R = functools.reduce(times, [turned(k, *(w[3 + k] for w in wave)) for k in range(3)])
    legs = []
    for base, tip in zip(BASE, PLATFORM, strict=True):
        at = around(numbers()["r_p"], tip)
        d, v, a = (wave[k][:3] + R[k] @ at for k in range(3))
        d = d - around(numbers()["r_b"], base)
        s = np.linalg.norm(d)
        s_1 = d @ v / s
        s_2 = (v @ v + d @ a - s_1**2) / s
        n_0, n_1 = d[0] / s, v[0] / s - d[0] * s_1 / s**2
        n_2 = a[0] / s - 2 * v[0] * s_1 / s**2 - d[0] * s_2 / s**2 + 2 * d[0] * s_1**2 / s**3
        b_0 = math.asin(n_0)
        b_1 = n_1 / math.cos(b_0)
        b_2 = (n_2 + n_0 * b_1**2) / math.cos(b_0)
        square, a_0 = d[1]**2 + d[2]**2, math.atan2(-d[1], d[2])
        a_1 = (d[1] * v[2] - v[1] * d[2]) / square
        a_2 = (d[1] * a[2] - a[1] * d[2] - 2 * a_1 * (d[1] * v[1] + d[2] * v[2])) / square
        legs.append(((a_0, b_0, s), (a_1, b_1, s_1), (a_2, b_2, s_2)))
    names = [*"xyzabc", *[f"{kind}{i + 1}" for i in range(6) for kind in ("alpha", "beta", "s")]]
    order = [names.index(n) for n in platform("numpy").metadata.q]
    q, u, ud = (np.concatenate([wave[k], *[leg[k] for leg in legs]])[order] for k in range(3))
    return q, u, ud


# -- the same mechanism in Pinocchio


class Reference:
    """Joints one by one with massless bodies between; three loop constraints for every tip."""

    def __init__(self) -> None:
        n, model = numbers(), pin.Model()
        model.gravity.linear = np.array([0.0, 0.0, -n["g"]])
        still = pin.SE3.Identity()

        def chain(joints: list[Any], start: pin.SE3, names: list[str]) -> int:
            last = 0
            for k, (joint, name) in enumerate(zip(joints, names, strict=True)):
                last = model.addJoint(last, joint, start if k == 0 else still, name)
            return last

        def body(joint: int, mass: float, z: float, across: float, along: float) -> None:
            model.appendBodyToJoint(joint, pin.Inertia(mass, np.array([0, 0, z]), np.diag([across, across, along])), still)

        moving = [pin.JointModelPX(), pin.JointModelPY(), pin.JointModelPZ(), pin.JointModelRX(), pin.JointModelRY(),
                  pin.JointModelRZ()]
        top = chain(moving, still, list("xyzabc"))
        body(top, n["m_p"], n["h_p"], n["I_px"], n["I_pz"])
        self.constraints = []
        for i, (base, tip) in enumerate(zip(BASE, PLATFORM, strict=True)):
            foot = pin.SE3(np.eye(3), around(n["r_b"], base))
            names = [f"{kind}{i + 1}" for kind in ("alpha", "beta", "s")]
            cylinder = chain([pin.JointModelRX(), pin.JointModelRY()], foot, names[:2])
            body(cylinder, n["m_c"], n["l_c"], n["Ic_t"], n["Ic_a"])
            rod = model.addJoint(cylinder, pin.JointModelPZ(), still, names[2])
            body(rod, n["m_r"], -n["l_r"], n["Ir_t"], n["Ir_a"])
            self.constraints.append((top, pin.SE3(np.eye(3), around(n["r_p"], tip)), rod))
        self.pin, self.data = model, model.createData()
        contacts = pin.StdVec_RigidConstraintModel()
        for parent, at, child in self.constraints:
            contacts.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, parent, at, child, still, pin.LOCAL))
        self.contacts = contacts
        self.contact_data = pin.StdVec_RigidConstraintData()
        for contact in contacts:
            self.contact_data.append(contact.createData())
        self.names = list(model.names)[1:]

    def vector(self, values: np.ndarray) -> np.ndarray:
        """From symdyn's order."""
        known = platform("numpy").metadata.q
        return np.array([values[known.index(n)] for n in self.names])

    def leg_forces(self, q: np.ndarray, u: np.ndarray, ud: np.ndarray) -> np.ndarray:
        """By Pinocchio's inverse dynamics of the tree and its Jacobians of the tips: tau = S F + J^T f."""
        tau = pin.rnea(self.pin, self.data, self.vector(q), self.vector(u), self.vector(ud))
        pin.computeJointJacobians(self.pin, self.data, self.vector(q))
        still, axes = pin.SE3.Identity(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        J = np.vstack([pin.getFrameJacobian(self.pin, self.data, parent, at, axes)[:3]
                       - pin.getFrameJacobian(self.pin, self.data, child, still, axes)[:3]
                       for parent, at, child in self.constraints])
        pushed = np.zeros((len(self.names), 6))
        for i in range(6):
            pushed[self.names.index(f"s{i + 1}"), i] = 1.0
        return np.linalg.solve(np.hstack([pushed, J.T]), tau)[:6]

    def accelerations(self, q: np.ndarray, u: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """By Pinocchio's constraint dynamics, in its order."""
        tau = np.zeros(len(self.names))
        for i, force in enumerate(forces):
            tau[self.names.index(f"s{i + 1}")] = force
        pin.initConstraintDynamics(self.pin, self.data, self.contacts, self.contact_data)
        settings = pin.ProximalSettings(1e-14, 1e-12, 100)
        found = pin.constraintDynamics(self.pin, self.data, self.vector(q), self.vector(u), tau, self.contacts,
                                       self.contact_data, settings)
        return np.array(found)


@functools.cache
def reference() -> Reference:
    return Reference()


@pytest.mark.every_value
@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=pytest.mark.skipif(find_compiler() is None,
                                                                                          reason="no C compiler here"))])
@pytest.mark.parametrize("t", TIMES)
def test_leg_forces_are_pinocchios(backend: str, t: float) -> None:
    q, u, ud = driven(t)
    found = platform(backend).actuation(t, q, u, ud)
    expected = reference().leg_forces(q, u, ud)
    assert found.rank == found.freedoms == 6 and found.unique and found.condition < 20
    assert np.linalg.norm(found.inputs - expected) <= TOLERANCE * np.linalg.norm(expected)
    assert found.residual <= TOLERANCE * np.linalg.norm(expected)


@pytest.mark.parametrize("t", TIMES)
def test_pinocchios_constraint_dynamics_under_these_forces_makes_the_motion(t: float) -> None:
    q, u, ud = driven(t)
    found = reference().accelerations(q, u, np.asarray(platform("numpy").actuation(t, q, u, ud).inputs))
    wanted = reference().vector(ud)
    assert np.linalg.norm(found - wanted) <= TOLERANCE * np.linalg.norm(wanted)


def test_legs_follow_a_platform_that_is_kept() -> None:
    """Coordinates, speeds and accelerations of the platform alone; those of the legs are projected, and are the closed forms."""
    q, u, ud = driven(1.1)
    metadata = platform("numpy").metadata
    moved = [n for n in metadata.x if n.removesuffix("_dot") in [*"xyzabc"]]
    given = [{n: v for n, v in zip(metadata.names(group), values, strict=True) if n in moved}
             for group, values in (("q", q), ("u", u), ("u", ud))]
    found = platform("numpy").actuation(1.1, *given, project=True, keep=moved)
    assert np.allclose(found.q, q, atol=1e-11) and np.allclose(found.u, u, atol=1e-10) and np.allclose(found.ud, ud, atol=1e-9)
    assert np.allclose(found.inputs, reference().leg_forces(q, u, ud), rtol=1e-9)
    with pytest.raises(sd.ArgumentError, match="keep names what stays in a projection; pass project=True, too"):
        platform("numpy").actuation(1.1, q, u, ud, keep=moved)


def test_the_initial_forces_hold_the_platform() -> None:
    """The closed form in the catalogue, from moments about the feet and the balance of the platform."""
    module = platform("numpy")
    q = np.array([module.metadata.initial.get(n, 0.0) for n in module.metadata.q])
    held = module.actuation(0.0, q, np.zeros(24), np.zeros(24))
    initial = [module.metadata.initial[n] for n in module.metadata.inputs]
    assert np.allclose(held.inputs, initial, rtol=1e-13)
    assert np.abs(module.rhs(0.0, [*q, *np.zeros(24)])[24:]).max() < 1e-11


def test_leg_forces_in_a_simulation_keep_the_motion() -> None:
    """The forces at every instant, sampled at 1 kHz, follow the motion to what holding them between instants costs."""

    def law(t: float, x: np.ndarray) -> np.ndarray:
        return np.asarray(platform("numpy").actuation(t + 5e-4, *driven(t + 5e-4)).inputs)

    q, u, _ = driven(0.0)
    sol = platform("numpy").simulate([0.0, 0.02], q, u, inputs=sd.Sampled(law, 1e-3), rtol=1e-8)
    end = driven(0.02)
    assert np.abs(sol.q[-1] - end[0]).max() < 1e-7 and np.abs(sol.u[-1] - end[1]).max() < 1e-5
