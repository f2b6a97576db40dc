"""Systems with flexible bodies whose motion or vibration is known another way, and what is measured of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import sympy as sp
from scipy.optimize import brentq

import symdyn as sd
from symdyn.flexible.modal_body import ModalBody
from symdyn.formulation.equations import Equations
from symdyn.lab.turbine import States, values
from symdyn.model.joints.modal import Modal
from symdyn.model.system import System
from symdyn.runtime.module import Module
from symdyn.systems import nrel_5mw_tower
from symdyn.systems.turbine_parts import blade_beam, tower_beam

FORMS = ("embedded", "recursive", "absolute")
_FORMS: dict[str, Callable[[System], Equations]] = {
    "embedded": System.embedding, "recursive": System.recursive, "absolute": lambda system: system.augmented("absolute")}

# Uniform cantilever turning about its root: omega sqrt(m L^4 / EI) of flapping over Omega sqrt(m L^4 / EI); A. D. Wright,
# C. E. Smith, R. W. Thresher, J. L. C. Wang, J. Appl. Mech. 49 (1982) 197-202; modes 2 and 3 by a Ritz series of 12 terms.
SPEEDS = (0, 1, 2, 3, 6, 12)
FLAPPING = np.array([[3.5160, 3.6816, 4.1373, 4.7973, 7.3604, 13.1702], [22.0345, 22.1810, 22.6149, 23.3203, 26.8091, 37.6031],
                     [61.6972, 61.8418, 62.2732, 62.9850, 66.6839, 79.6145]])
# Hz, fore-aft and side-to-side: the tower of the catalogue with its rotor and nacelle as one rigid body, under gravity, by the
# 40 beam elements of tests/flexible/beam_model.py.
TOWER_REFERENCE = (0.316100, 0.313870)
TOWER_QUOTED = (0.324, 0.312)
# Spin-up of a beam: length m, mass per length kg/m, stiffness N m^2. T. R. Kane, R. R. Ryan, A. K. Banerjee, Dynamics of a
# cantilever beam attached to a moving base, J. Guidance, Control and Dynamics 10 (1987) 139-151.
LENGTH, DENSITY, STIFFNESS = 10.0, 1.2, 14_000.0


def equations(system: System, form: str) -> Equations:
    """In one of FORMS."""
    return _FORMS[form](system)


def powers(direction: str, count: int) -> list[sd.Shape]:
    """(x / L)^2, (x / L)^3, ..."""
    return [sd.Shape(direction, [1.0], powers=[k]) for k in range(2, 2 + count)]


# -- rotating beam


def rotor(count: int, free: bool = False) -> System:
    """A uniform beam on a shaft across it, m = L = EI = 1: `count` powers along the shaft (flap), as many in its plane (lag)."""
    Omega = sd.parameters("Omega")
    system = sd.System("rotor", gravity=[0, 0, 0])
    hub = system.add_body("hub", mass=1, inertia=[1, 1, 1])
    angle = sd.coordinates("azimuth") if free else Omega * sd.t
    system.add_joint(sd.Revolute("shaft", system.ground, hub, angle, axis=[0, 1, 0]))
    names = [f"{name}{k}" for name in ("flap", "lag") for k in range(1, count + 1)]
    beam = sd.Beam([0, 1], 1.0, 1.0, powers("y", count) + powers("x", count))
    blade = system.add_flexible_body("blade", beam, sd.coordinates(" ".join(names)), carries=False)
    system.add_joint(sd.Fixed("root", hub, blade.root))
    return system if free else system.set_defaults({Omega: 0.0})


def rotor_frequencies(module: Module, speed: float) -> np.ndarray:
    """The first three of flap and of lag, (2, 3), rad/s, of a module of `rotor`; a free shaft is kept at the speed."""
    if "azimuth" in module.metadata.q:
        linear = module.linearize(at={"azimuth_dot": speed}, fixed={"azimuth": 0.0, "azimuth_dot": speed})
    else:
        params = {"Omega": speed}
        # The beam turns with the hub, and does not swing.
        still = [u for u in module.metadata.u if u.startswith(("flap", "lag"))]
        at = module.consistent(params=params, keep=still) if "p0_hub" in module.metadata.q else None
        linear = module.linearize(at=at, params=params)
    modes = list(linear.modes())
    return np.array([[mode.omega for mode in modes if mode.name.startswith(name)][:3] for name in ("flap", "lag")])


def published(speed: float) -> np.ndarray:
    """Expected result of `rotor_frequencies`; lag is softer than flap by the speed."""
    flap = FLAPPING[:, SPEEDS.index(int(speed))]
    return np.array([flap, np.sqrt(flap**2 - speed**2)])


# -- tower


def rotor_and_nacelle(system: System) -> tuple[float, np.ndarray, np.ndarray]:
    """Bodies on the tower of a land-based turbine at q = 0: mass (kg), centre of mass from the tower's top (m), inertia about
    it (kg m^2), in the axes of the top."""
    model = system.check()
    numbers = dict(model.defaults)
    module = system.embedding().compile(backend="numpy")
    frames = module.evaluate("frames", 0.0, np.zeros(len(module.metadata.x))).reshape(-1, 12)
    top = frames[[b.name for b in model.bodies].index("tower_tip"), :3]
    parts = []
    for frame, body in zip(frames, model.bodies, strict=True):
        if body.name in ("tower", "tower_tip"):
            continue
        R = frame[3:].reshape(3, 3)
        com, inertia = (np.array(a.xreplace(numbers), dtype=float) for a in (body.com, body.inertia))
        parts.append((float(body.mass.xreplace(numbers)), frame[:3] - top + R @ com.ravel(), R @ inertia @ R.T))
    mass = sum(m for m, _, _ in parts)
    center = sum((m * c for m, c, _ in parts), np.zeros(3)) / mass
    total = np.zeros((3, 3))
    for m, c, inertia in parts:
        d = c - center
        total += inertia + m * (d @ d * np.eye(3) - np.outer(d, d))
    return mass, center, total


def tower(shapes: Any, mass: float, center: np.ndarray, inertia: np.ndarray) -> System:
    """The land-based tower in other shapes, with a rigid body on its top."""
    data = nrel_5mw_tower.ONSHORE
    system = sd.System("tower", gravity=[0, 0, -9.80665])
    beam = sd.Beam(data.stations, data.mass_per_length, data.stiffness, shapes, length=data.length)
    flexible = system.add_flexible_body("tower", beam)
    system.add_joint(sd.Fixed("foot", system.ground, flexible.root))
    head = system.add_body("head", mass=mass, com=center.tolist(), inertia=inertia.tolist())
    system.add_joint(sd.Fixed("top", flexible.tip, head))
    return system


def modes_with_head(count: int, mass: float, center: np.ndarray, inertia: np.ndarray) -> list[sd.Shape]:
    """The land-based tower's own modes with a rigid body on its top."""
    return tower_beam().modes(count, tip_mass=mass, tip_com=center, tip_inertia=inertia, gravity=[0, 0, -9.80665])


def tower_frequencies(system: System) -> np.ndarray:
    """Hz, first fore-aft (x) and side-to-side (y) about equilibrium; yaw, where there is one, is held."""
    module, beam = system.embedding().compile(backend="numpy"), beam_of(system)
    keep = {"yaw": 0.0} if "yaw" in module.metadata.q else {}
    result = {}
    for mode in list(module.linearize(module.equilibrium(fixed=keep)).modes())[:2]:
        sway = np.abs(beam.Psi_tip[:2] @ mode.shape[:beam.n])
        result[int(np.argmax(sway))] = mode.frequency
    return np.array([result[0], result[1]])


def beam_of(system: System) -> ModalBody:
    """Beam of the first flexible body."""
    return elastic_joint(system).beam


def elastic_joint(system: System) -> Modal:
    """Joint of the first flexible body; it has the elastic coordinates."""
    return next(joint for joint in system.joints if isinstance(joint, Modal))


# -- spin-up


def spin_up_angle() -> sp.Expr:
    """rad; the speed grows to 6 rad/s within 15 s."""
    t = sd.t
    growing = sp.Rational(2, 5) * (t**2 / 2 + (sp.Rational(15, 2) / sp.pi) ** 2 * (sp.cos(2 * sp.pi * t / 15) - 1))
    return sp.Piecewise((growing, t < 15), (6 * t - 45, True))


def spin_up(beam: ModalBody, tip_mass: float = 0.0) -> System:
    """A beam that is spun up in its plane."""
    system, hub = _spun("spin_up")
    body = system.add_flexible_body("beam", beam)
    system.add_joint(sd.Fixed("root", hub, body.root))
    if tip_mass:
        load = system.add_body("load", mass=tip_mass, inertia=[1e-3] * 3)
        system.add_joint(sd.Fixed("seat", body.tip, load))
    return system


def spin_up_chain(n: int, tip_mass: float = 0.0) -> System:
    """The same beam as n rigid links with springs between them, half a link from the clamp; nothing is linear in it."""
    system, last = _spun("spin_up_chain")
    h = LENGTH / n
    m = DENSITY * h
    for k in range(n):
        link = system.add_body(f"link{k}", mass=m, inertia=[m * h**2 / 12, m * h**2 / 12, 1e-3 * m * h**2], com=[0, 0, h / 2])
        q = sd.coordinates(f"a{k}")
        system.add_joint(sd.Revolute(f"hinge{k}", last, link, q, axis=[0, 1, 0], parent_point=[0, 0, h if k else 0]))
        system.add_joint_force(f"hinge{k}", -STIFFNESS / h * (1 if k else 2) * q)
        last = link
    if tip_mass:
        load = system.add_body("load", mass=tip_mass, inertia=[1e-3] * 3)
        system.add_joint(sd.Fixed("seat", last, load, parent_point=[0, 0, h]))
    return system


def _spun(name: str) -> tuple[System, Any]:
    system = sd.System(name, gravity=[0, 0, 0])
    hub = system.add_body("hub", mass=1, inertia=[1, 1, 1])
    system.add_joint(sd.Revolute("shaft", system.ground, hub, spin_up_angle(), axis=[0, 1, 0]))
    return system, hub


def spin_up_beam(count: int) -> ModalBody:
    """In `count` powers in the plane of rotation."""
    return sd.Beam([0, LENGTH], DENSITY, STIFFNESS, powers("x", count)).modal


def unstiffened(beam: ModalBody) -> ModalBody:
    """Without foreshortening, as a linear theory of deflection has it; for shapes in one direction, x, of a beam along z."""
    S_mX = beam.Me - beam.I2[:, :, 1, 1] / 2
    across = np.eye(3) - np.outer(beam.e, beam.e)
    return replace(beam, H2=0 * beam.H2, I2=beam.I2 + 2 * np.einsum("ij,xy->ijxy", S_mX, across), S_tip=0 * beam.S_tip,
                   S=0 * beam.S)


def deflection(system: System, times: np.ndarray, n: int = 0, rtol: float = 1e-8) -> np.ndarray:
    """Deflection of the tip over time, m, across the root's axis; n: of a chain of n links."""
    solution = (system.recursive() if n else system.embedding()).compile().simulate(t=times, rtol=rtol, atol=1e-9)
    if n:
        return np.asarray(LENGTH / n * np.sin(np.cumsum(solution.q, axis=1)).sum(axis=1))
    return np.asarray(solution.q @ beam_of(system).Psi_tip[0])


# -- thrown turbine


def thrown(orientation: str = "angles", blades: int = 2, modes: tuple[int, int] = (4, 3)) -> System:
    """A small turbine with a flexible tower and blades that falls and tumbles; parameters: kappa multiplies stiffness, delta
    damping.

    modes   how many of the tower, and of each blade
    """
    g, kappa, delta = sd.parameters("g kappa delta")
    system = sd.System("thrown", gravity=[0, 0, -g])
    hull = system.add_body("hull", mass=20, inertia=[8, 9, 10], com=[0.1, 0, -0.5])
    if orientation == "angles":
        joint = sd.Free("sea", system.ground, hull, sd.coordinates("x y z psi theta phi"), sd.EulerAngles("ZYX"))
    else:
        joint = sd.Free("sea", system.ground, hull, sd.coordinates("x y z e0 e1 e2 e3"), sd.EulerParameters(), velocity="body",
                        speeds=sd.speeds("v_x v_y v_z omega_x omega_y omega_z"))
    system.add_joint(joint)
    tower = sd.Beam([0, 2, 4], [3, 2, 1.5], ([900, 700, 500], [800, 650, 500]), modes[0], damping_ratio=0.01)
    blade = sd.Beam([0, 1, 3], [1, 0.6, 0.3], ([600, 400, 200], [1200, 800, 400]), modes[1], twist=[0.3, 0.2, 0],
                    damping_ratio=0.01)
    mast = system.add_flexible_body("tower", tower, stiffness=kappa, damping=delta)
    system.add_joint(sd.Fixed("foot", hull, mast.root, parent_point=[0, 0, 0.2]))
    nacelle = system.add_body("nacelle", mass=2, inertia=[0.3, 0.2, 0.4], com=[0.3, 0, 0.2])
    system.add_joint(sd.Revolute("yaw", mast.tip, nacelle, sd.coordinates("yaw")))
    hub = system.add_body("hub", mass=0.5, inertia=[0.1, 0.1, 0.1])
    system.add_joint(sd.Revolute("shaft", nacelle, hub, sd.coordinates("azimuth"), axis=[1, 0, 0], parent_point=[-0.5, 0, 0.3],
                                 parent_rotation=sp.rot_ccw_axis2(-sp.Rational(1, 10))))
    for k in range(blades):
        root = system.add_flexible_body(f"blade{k}", blade, stiffness=kappa, damping=delta, carries=False).root
        turned = sp.rot_ccw_axis1(k * sp.pi) * sp.rot_ccw_axis2(sp.Rational(1, 20))
        system.add_joint(sd.Fixed(f"root{k}", hub, root, parent_point=turned[:, 2] / 5, parent_rotation=turned))
    return system.set_defaults({g: 9.81, kappa: 1.0, delta: 0.0})


def throw(module: Module, seconds: float = 3.0, **options: Any) -> Any:
    """A motion of `thrown`, the same in both sets of coordinates."""
    speeds = {"azimuth_dot": 3.0, "yaw_dot": 0.5}
    angles = "psi" in module.metadata.q
    speeds |= {"x_dot": 1.0, "psi_dot": 0.6, "theta_dot": -0.4, "phi_dot": 0.5} if angles else {
        "v_x": 1.0, "omega_x": 0.5, "omega_y": -0.4, "omega_z": 0.6}
    return module.simulate(t=np.linspace(0, seconds, 61), u=speeds, rtol=1e-11, atol=1e-12, work=True, **options)


def momenta(module: Module, solution: Any) -> np.ndarray:
    """(n_t, 6) momentum and angular momentum about the origin, n-frame, of `thrown` in Euler parameters: what belongs to the
    hull's velocity and angular velocity in M u."""
    from scipy.spatial.transform import Rotation

    M = np.array([module.mass_matrix(q, solution.params) for q in solution.q])
    along = np.einsum("nij,nj->ni", M, solution.u)[:, :6]
    turn = Rotation.from_quat(solution.q[:, [4, 5, 6, 3]])
    P, L = turn.apply(along[:, :3]), turn.apply(along[:, 3:])
    return np.column_stack([P, L + np.cross(solution.q[:, :3], P)])


def apart(one: Any, other: Any) -> float:
    """Largest difference of the coordinates that two solutions have in common, relative to the largest of each."""
    common = [name for name in one.module.metadata.q if name in other.module.metadata.q]
    return max(float(np.abs(one[name] - other[name]).max() / np.abs(one[name]).max()) for name in common)


# -- agreement of formulations


def random_states(result: Equations, n: int, seed: int = 0) -> States:
    """Places within 3 m, angles up to 60 degrees, any azimuth, tips within some hundredths of the length, speeds up to 1."""
    rng = np.random.default_rng(seed)
    s = result.symbols
    rigid = {"x": 3.0, "y": 3.0, "z": 3.0, "azimuth": np.pi}
    reach = [0.3 * s.reach[q] if q in s.reach else rigid.get(q.name, np.pi / 3) for q in s.coordinates]
    return States(rng.uniform(-1, 1, (n, len(reach))) * reach, rng.uniform(-1, 1, (n, len(s.speeds))))


def in_all_coordinates(system: System, result: Equations, states: States) -> dict[str, np.ndarray]:
    """Coordinates and speeds of every form at states of the embedded one in Euler angles, by name."""
    from scipy.spatial.transform import Rotation

    model, n = system.check(), len(states.q)
    numbers = values(result, states, "frames", "J")
    R, p = numbers["frames"][:, :, 3:].reshape(n, -1, 3, 3), numbers["frames"][:, :, :3]
    com = np.array([[float(e.xreplace(dict(model.defaults))) for e in body.com] for body in model.bodies])
    twists = np.einsum("nij,nj->ni", numbers["J"], states.u).reshape(n, -1, 6)
    v = twists[:, :, :3] - np.cross(twists[:, :, 3:], np.einsum("nkij,kj->nki", R, com))
    v_body, omega = (np.einsum("nkji,nkj->nki", R, w) for w in (v, twists[:, :, 3:]))
    e = Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat().reshape(n, -1, 4)[:, :, [3, 0, 1, 2]]
    s = result.symbols
    given = dict(zip([a.name for a in (*s.coordinates, *s.speeds)], [*states.q.T, *states.u.T], strict=True))
    for k, body in enumerate(model.bodies):
        for i, axis in enumerate("xyz"):
            given |= {f"{axis}_{body.name}": p[:, k, i], f"{axis}_{body.name}_dot": v[:, k, i],
                      f"omega_{axis}_{body.name}": omega[:, k, i]}
        given |= {f"p{i}_{body.name}": e[:, k, i] for i in range(4)}
    given |= {f"e{i}": e[:, 0, i] for i in range(4)}
    return given | {f"{name}_{axis}": w[:, 0, i] for name, w in (("v", v_body), ("omega", omega)) for i, axis in enumerate("xyz")}


def accelerations(result: Equations, states: States) -> dict[str, np.ndarray]:
    """By the names of the speeds."""
    numbers = values(result.singular_fallback or result, states, "accelerations")["accelerations"]
    return dict(zip([u.name for u in result.symbols.speeds], numbers.T, strict=True))


def agreement(system: System, quasi: System, n: int) -> dict[str, float]:
    """Differences of accelerations from the embedded ones at n random states, relative to the largest at each: of all coordinates
    that a form has in common with it. Also "constraints", the largest residual of those of absolute coordinates."""
    embedded = system.embedding()
    states = random_states(embedded, n)
    wanted = accelerations(embedded, states)
    given = in_all_coordinates(system, embedded, states)
    forms = {"recursive": system.recursive(), "recursive, quasi-velocities": quasi.recursive(),
             "embedded, quasi-velocities": quasi.embedding(), "absolute": system.augmented("absolute")}
    errors = {}
    for name, form in forms.items():
        s = form.symbols
        q, u = (np.column_stack([given[a.name] for a in group]) for group in (s.coordinates, s.speeds))
        here = States(q, u)
        result = accelerations(form, here)
        common = [u for u in wanted if u in result]
        a, b = (np.stack([row[u] for u in common]) for row in (result, wanted))
        errors[name] = float((np.abs(a - b).max(axis=0) / np.abs(b).max(axis=0)).max())
        if name == "absolute":
            errors["constraints"] = float(np.abs(values(form, here, "C")["C"]).max())
    return errors


# -- static deflection and buckling


def column(shapes: Sequence[sd.Shape], mass: float, stiffness: Any, tilt: float = 0.0) -> System:
    """A beam of length 1 with a load m at its end, its clamp tilted about y from upright; gravity g."""
    g, m = sd.parameters("g m")
    system = sd.System("column", gravity=[0, 0, -g])
    beam = system.add_flexible_body("beam", sd.Beam([0, 1], mass, stiffness, shapes))
    system.add_joint(sd.Fixed("clamp", system.ground, beam.root, parent_rotation=sp.rot_ccw_axis2(sp.Float(tilt))))
    load = system.add_body("load", mass=m, inertia=[0, 0, 0])
    system.add_joint(sd.Fixed("seat", beam.tip, load))
    return system.set_defaults({g: 1.0, m: 1.0})


def buckling_load(module: Module, least: float, most: float) -> float:
    """Mass (kg) of a load under which the stiffness of an upright `column` is lost; g = 1."""
    def stiffness(m: float) -> float:
        return float(np.linalg.eigvalsh(module.linearize(params={"m": m}).K)[0])

    return float(brentq(stiffness, least, most, xtol=1e-12))


# -- rigid limit


def platform_frequencies(module: Module, params: dict[str, float]) -> np.ndarray:
    """Hz, the lowest six about equilibrium."""
    linear = module.linearize(module.equilibrium(params=params))
    return np.array([mode.frequency for mode in linear.modes()][:6])


def rigid_numbers() -> dict[str, float]:
    """The rigid turbine's parameters by the integrals of the flexible bodies, in place of the sums over elements."""
    result: dict[str, float] = {}
    for letter, beam in (("T", tower_beam().modal), ("B", blade_beam().modal)):
        z = beam.h0[2] / beam.m
        result |= {f"m_{letter}": beam.m, f"z_{letter}": float(z), f"I_{letter}": float(beam.I0[0, 0] - beam.m * z**2)}
    return result
