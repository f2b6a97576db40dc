"""Added mass and flexible bodies in all formulations, against Lagrange's equations of their own kinetic energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ModelError, SymdynError
from symdyn.formulation.equations import Equations
from symdyn.tape.differentiate import forward
from symdyn.tape.evaluate import evaluate
from symdyn.tape.tape import Tape
from tests.helpers import swept

BEAM = sd.Beam([0, 1, 2.5, 4], [3, 2.5, 2, 1.5], ([300, 250, 200, 100], [400, 300, 250, 200]), 3, axis="z", damping_ratio=0.02)


def added_mass() -> list[list[float]]:
    half = np.random.default_rng(1).normal(size=(6, 6))
    return (half @ half.T).tolist()


def ship(orientation: Any = None, carries: bool = True, water: bool = True, **options: Any) -> sd.System:
    """A floating body with water around it, a flexible mast, and a yawing head on the mast."""
    g, m, kappa = sd.parameters("g m kappa")
    system = sd.System("ship", gravity=[0, 0, -g])
    hull = system.add_body("hull", mass=m, inertia=[1, 2, 3], com=[0.1, 0.2, -0.3])
    system.add_joint(sd.Free("sea", system.ground, hull, orientation=orientation or sd.EulerAngles("ZYX"), **options))
    if water:
        system.add_load(sd.AddedMass(hull, added_mass(), point=[0.1, -0.2, 0.3]))
    mast = system.add_flexible_body("mast", BEAM, stiffness=kappa, carries=carries)
    system.add_joint(sd.Fixed("step", hull, mast.root, parent_point=[0.3, 0.1, 0.2],
                              parent_rotation=sp.rot_ccw_axis1(sp.Rational(3, 10))))
    if carries:
        head = system.add_body("head", mass=2, inertia=[0.3, 0.2, 0.1], com=[0.1, 0.2, 0.3])
        system.add_joint(sd.Revolute("yaw", mast.tip, head, axis=[0, 0, 1]))
    return system.set_defaults({g: 9.81, m: 5, kappa: 1})


def state(equations: Equations, seed: int = 0) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    s = equations.symbols
    values = {a.name: rng.uniform(-0.8, 0.8) for a in (*s.coordinates, *s.speeds, *[u.dot for u in s.speeds])}
    return {**values, **{p.name: v for p, v in s.defaults.items()}, "t": 0.0}


def against_lagrange(equations: Equations) -> float:
    """k_tilde less the derivatives of the kinetic energy along the motion, relative; speeds must be rates of coordinates."""
    s, recorder, leaves = equations.symbols, equations.recorder, equations.leaves
    M, T = equations.quantity("M_tilde"), equations.quantity("energy")[0]
    q, u = [leaves[a] for a in s.coordinates], [leaves[a] for a in s.speeds]
    momentum = [forward(recorder, [T], {speed: 1})[0] for speed in u]
    along = forward(recorder, momentum, dict(zip(q, u, strict=True)))
    slopes = [forward(recorder, [T], {coordinate: 1})[0] for coordinate in q]
    found = evaluate(Tape.of(recorder, k=equations.quantity("k_tilde"), along=along, slopes=slopes, momentum=momentum, M=M),
                     state(equations))
    speeds = np.array([state(equations)[a.name] for a in s.speeds])
    assert np.abs(found["momentum"] - found["M"] @ speeds).max() < 1e-25 * np.abs(found["momentum"]).max()
    wanted = found["along"] - found["slopes"]
    return float(np.abs(found["k"] - wanted).max() / np.abs(wanted).max())


@pytest.mark.parametrize("options", [{}, {"carries": False}, {"water": False}])
def test_forces_are_those_of_lagrange(options: dict[str, bool]) -> None:
    assert against_lagrange(ship(**options).embedding()) < 1e-25


def test_gravity_and_elasticity_are_gradients() -> None:
    equations = ship().embedding()
    s, recorder = equations.symbols, equations.recorder
    V = equations.quantity("energy")[1]
    slopes = [forward(recorder, [V], {equations.leaves[q]: 1})[0] for q in s.coordinates]
    at_rest = {**state(equations), **{u.name: 0.0 for u in s.speeds}}
    found = evaluate(Tape.of(recorder, F=equations.quantity("F_tilde"), slopes=slopes), at_rest)
    assert np.abs(found["F"] + found["slopes"]).max() < 1e-25 * np.abs(found["F"]).max()


def test_recursive_form_gives_the_same() -> None:
    embedded, recursive = ship().embedding(), ship().recursive()
    a, b = (evaluate(eq.tape("accelerations"), state(eq))["accelerations"] for eq in (embedded, recursive))
    assert np.abs(a - b).max() < 1e-24 * np.abs(a).max()


@pytest.mark.parametrize("form", [*swept(["embedding"]), "recursive"])
def test_quasi_velocities(form: str) -> None:
    equations = getattr(ship(sd.EulerParameters(), velocity="body"), form)()
    assert equations.verify(states=1).passed


def test_absolute_coordinates_give_the_same() -> None:
    """Elastic coordinates stay; every rigid body and every clamped end has coordinates of its own."""
    system = ship()
    names = [*[f"q_sea_{k}" for k in range(1, 7)], "mast_mode_1", "mast_mode_2", "mast_mode_3", "q_yaw"]
    rng = np.random.default_rng(2)
    system.initial = {name: rng.uniform(-0.5, 0.5) * (0.1 if name.startswith("mast") else 1)
                      for name in (*names, *[f"{n}_dot" for n in names])}
    relative, absolute = system.recursive(), system.augmented("absolute")
    rates = []
    for equations in (relative, absolute):
        module = equations.compile(backend="numpy")
        names, initial = module.metadata.x, module.metadata.initial
        x_dot = module.rhs(0.0, [initial.get(n, 0.0) for n in names])
        rates.append([x_dot[names.index(f"{n}_dot")] for n in system.initial if n.startswith("mast") and f"{n}_dot" in names])
    assert len(rates[0]) == 3
    assert np.abs(np.subtract(*rates)).max() < 1e-11 * np.abs(rates[0]).max()


def test_report_reports_what_is_not_rigid() -> None:
    equations = ship().recursive()
    assert "no pages of links" in str(equations.compile(backend="numpy").report())
    with pytest.raises(SymdynError, match="has added mass or elastic bodies"):
        equations.base_parameters()


def test_explanation_adds_up() -> None:
    equations = ship(carries=False).embedding()
    parts = equations.explain("M_tilde", 2, 2, simplify=False)
    assert "added mass and deflection" in {c.body for c in parts.contributions}
    values = dict(zip(equations.symbols.coordinates, np.linspace(0.1, 0.9, 9), strict=True))
    numbers = {**values, **equations.symbols.defaults}
    assert float(parts.total.subs(numbers) - equations.explicit("M_tilde", simplify=False)[2, 2].subs(numbers)) == pytest.approx(
        0, abs=1e-12)


def test_unsymmetric_added_mass() -> None:
    system = ship(water=False)
    A = np.eye(6)
    A[0, 4] = 0.5
    system.add_load(sd.AddedMass("hull", A))
    with pytest.raises(ModelError, match=r"A is not symmetric: A\[5, 1\] = 0.*A\[1, 5\] = 0.5"):
        system.check()


ADDED_MASS_FAULTS: dict[str, tuple[Any, dict[str, Any], str]] = {
    "negative": ([1, 2, -3, 4, 5, 6], {}, "A has the eigenvalue -3, so that the water would have a negative kinetic energy"),
    "coupled too strongly": (np.eye(6) + 2 * (np.eye(6, k=4) + np.eye(6, k=-4)), {}, "A has the eigenvalue -1, so that"),
    "point in a plane": ([1] * 6, {"point": [1, 2]}, "point has 2 components; pass 3$"),
}


@pytest.mark.parametrize("name", ADDED_MASS_FAULTS)
def test_added_mass_that_cannot_be(name: str) -> None:
    A, options, message = ADDED_MASS_FAULTS[name]
    system = ship(water=False)
    system.add_load(sd.AddedMass("hull", A, **options))
    with pytest.raises(ModelError, match=f"added mass on hull: {message}"):
        system.check()


def test_a_load_that_is_added_twice() -> None:
    system = ship(water=False)
    water = system.add_load(sd.AddedMass("hull", [1, 2, 0, 4, 5, 6]))
    system.add_load(water)
    with pytest.raises(ModelError, match=f"{water.label} was added 2 times; add it once"):
        system.check()


def test_added_mass_of_the_wrong_size() -> None:
    system = ship(water=False)
    system.add_load(sd.AddedMass("hull", [1, 2, 3]))
    with pytest.raises(ModelError, match=r"A is not a 6 x 6 matrix; pass 6 rows of 6, or the 6 diagonal entries"):
        system.check()


def test_load_on_the_ground_and_what_is_no_load() -> None:
    system = ship(water=False)
    system.add_load(sd.AddedMass("ground", [1] * 6))
    system.add_load("wind")
    with pytest.raises(ModelError, match=r"(?s)add_load was given 'wind'.*acts on the ground"):
        system.check()


def test_beam_that_is_none() -> None:
    with pytest.raises(ModelError, match=r"flexible body 'mast': beam is 3; pass sd\.Beam"):
        sd.System("a", gravity=[0, 0, -1]).add_flexible_body("mast", 3)


def test_elastic_coordinates_must_be_symbols() -> None:
    system = sd.System("a", gravity=[0, 0, -1])
    q = sd.coordinates("q")
    mast = system.add_flexible_body("mast", BEAM, coordinates=[q, 2 * q, 0])
    system.add_joint(sd.Fixed("clamp", system.ground, mast.root))
    with pytest.raises(ModelError, match="elastic coordinates must be symbols"):
        system.check()


def test_far_deflection_is_reported() -> None:
    system = sd.System("rod", gravity=[0, 0, 0])
    rod = system.add_flexible_body("rod", BEAM)
    system.add_joint(sd.Fixed("clamp", system.ground, rod.root))
    module = system.embedding().compile(backend="numpy")
    with pytest.warns(sd.SimulationWarning, match=r"in this motion: rod_bends: the free end goes 0\.\d+ of the length aside"):
        module.simulate((0, 0.1), q={"rod_mode_1": 0.9})
