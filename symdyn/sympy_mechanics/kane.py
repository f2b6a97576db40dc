"""KanesMethod: what its equations consist of.

SymPy projects the equations of systems with dependent speeds by the inverse of a part of the velocity constraints, which makes
them long, and undefined where that part is singular. The same sums over the bodies without the projection, one equation for each
speed, are short and defined everywhere; with multipliers for the constraints they have the same accelerations. Likewise where
SymPy's solution of the kinematic equations divides by what may vanish.
"""

from __future__ import annotations

import copy
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelError, ModelWarning
from symdyn.formulation.by_hand.matrices import ROUNDING, GivenMatrices, GivenRow, Recorded, at_random_states
from symdyn.formulation.square_systems import LARGEST, blocks
from symdyn.sympy_mechanics.options import Options
from symdyn.sympy_mechanics.taken import Taken, functions_of_time
from symdyn.tape.differentiate import forward


def of_kane(kane: Any, options: Options) -> GivenMatrices:
    """The matrices of a KanesMethod. Raises ModelError for equations that are not formed yet, and for all faults of symbols.

    Warns (ModelWarning) of bodies whose angular velocity contradicts their orientation.
    """
    name = options.name
    if kane._fr is None or kane._frstar is None:
        raise ModelError(["the equations of this KanesMethod are not formed yet; call kanes_equations(bodies, loads) first"],
                         name)
    taken = Taken(name, kane.q, kane.u, options.states)
    taken.vanishing(kane._uaux)
    n_d = len(kane._udep)
    if len(kane._qdep) and not n_d:
        taken.faults.append("this KanesMethod has configuration constraints and no velocity constraints, so that nothing in its "
                            "equations holds the coordinates; add the derivatives of the configuration constraints as "
                            "velocity_constraints, with as many dependent speeds")
    kinematics = (kane._k_kqdot_implicit, kane._k_ku_implicit, kane._f_k_implicit)
    taken.use("the kinematic differential equations", *kinematics)
    if n_d:
        taken.use("the velocity constraints", kane._k_nh, kane._f_nh)
        taken.use("the configuration constraints", kane._f_h)
    mass, forcing, active, inertial = _unprojected(kane)
    taken.use("the mass matrix", mass)
    auxiliary, unknown = _auxiliary(kane, taken)
    taken.use("the forcing", forcing)
    taken.use("the generalized forces", active, inertial, accelerations=True)
    if auxiliary is not None:
        taken.use("the auxiliary equations", auxiliary, without=unknown.values(), accelerations=True)
    options.use(taken)
    symbols = options.symbols(taken)
    rows = [GivenRow(f"configuration_{k + 1}", e) for k, e in enumerate(kane._f_h)]
    rows += [GivenRow(f"velocity_{k + 1}", None, tuple(kane._k_nh.row(k)), kane._f_nh[k]) for k in range(n_d)]
    given = None if not n_d or kane._k_dnh is kane._k_nh else (kane._k_dnh, kane._f_dnh)
    remarks = [] if auxiliary is None or unknown else ["no reactions by auxiliary speeds: their equations do not name as many "
                                                       "forces"]
    result = GivenMatrices(
        name, "kane", symbols, taken.same, mass, forcing, kinematics, (active, inertial), n_d if n_d else None, tuple(rows),
        given, None, options.rates(taken), options.outputs_of(),
        auxiliary if unknown else None, _homogeneous(kane), unknown, tuple(remarks))
    _compare_angular_velocities(kane, result)
    return result


def _unprojected(kane: Any) -> tuple[sp.MatrixBase, sp.MatrixBase, sp.MatrixBase, sp.MatrixBase]:
    """M, f, generalized active and generalized inertia forces, one row for each speed."""
    n, rates = len(kane.u), _rates(kane)
    if not len(kane._udep) and rates is None:
        return kane._k_d, -kane._f_d, kane._fr[:n, 0], kane._frstar[:n, 0]
    whole = copy.copy(kane)
    whole._udep = sp.Matrix()
    whole._qdot_u_map = rates or kane._qdot_u_map
    active = whole._form_fr(kane._forcelist)
    inertial = whole._form_frstar(kane._bodylist)
    return whole._k_d, -whole._f_d, active, inertial


def _rates(kane: Any) -> dict[sp.Expr, sp.Expr] | None:
    """q' in terms of u by determinants, which vanish only where the kinematic equations are singular; None where they are solved
    one after the other, or hold more than three derivatives together, so that SymPy's elimination stays.

    SymPy eliminates without a choice of pivots, and divides by entries such as sin(roll), which vanish elsewhere, too.
    """
    K, A, b = kane._k_kqdot_implicit, kane._k_ku_implicit, kane._f_k_implicit
    right = -(A * kane.u + b)
    try:
        order = blocks(np.array([[e != 0 for e in K.row(i)] for i in range(K.rows)], dtype=bool))
    except ZeroDivisionError:
        return None  # which is a fault that is reported with the equations
    if not 1 < max(len(rows) for rows, _ in order) <= LARGEST:
        return None
    result = sp.zeros(K.rows, 1)
    for rows, columns in order:
        block = K.extract(rows, columns)
        rest = right.extract(rows, [0]) - K.extract(rows, list(range(K.cols))) * result
        solved = block.adjugate() * rest / block.det()
        for index, column in enumerate(columns):
            result[column] = solved[index]
    return dict(zip(kane._qdot, result, strict=True))


def _homogeneous(kane: Any) -> bool:
    """Whether velocities and angular velocities of all bodies vanish with the speeds."""
    N, rest = kane._inertial, dict.fromkeys([*kane.u, *kane._uaux], 0)
    vectors = [v for body in kane.bodies for v in (
        [body.masscenter.vel(N), body.frame.ang_vel_in(N)] if hasattr(body, "central_inertia") else [body.point.vel(N)])]
    return all(e.xreplace(kane._qdot_u_map).xreplace(rest) == 0 for v in vectors for components, _ in v.args for e in components)


def _auxiliary(kane: Any, taken: Taken) -> tuple[sp.MatrixBase | None, Mapping[str, sp.Basic]]:
    """The equations along the auxiliary speeds, and the forces that follow from them: functions of time or symbols that stand
    nowhere else and enter linearly, as many as there are equations."""
    if not len(kane._uaux):
        return None, {}
    rows = kane.auxiliary_eqs
    elsewhere: set[sp.Basic] = set()
    for part in (kane._k_d, kane._f_d, kane._k_nh, kane._f_nh):
        elsewhere |= functions_of_time(part) | part.free_symbols
    functions = sorted((f for f in functions_of_time(rows) - elsewhere if f not in taken.same), key=str)
    others = sorted(((rows.free_symbols - elsewhere) - {taken.t}), key=str)
    for candidates in (functions, [*functions, *others]):
        if len(candidates) == len(rows) and not any(rows.diff(a).has(b) for a in candidates for b in candidates):
            return rows, {getattr(f, "name", "") or f.func.__name__: f for f in candidates}
    return rows, {}


def _compare_angular_velocities(kane: Any, given: GivenMatrices) -> None:
    """Warns of bodies whose angular velocity in the inertial frame is not the one of their orientation."""
    N = kane._inertial
    recorded = Recorded(given, kinematics_only=True)
    wrong: list[str] = []
    for frame in dict.fromkeys(body.frame for body in kane.bodies or () if hasattr(body, "central_inertia")):
        try:
            R, omega = N.dcm(frame), frame.ang_vel_in(N).to_matrix(frame)
        except ValueError:
            continue  # without an orientation to N there is nothing to compare with
        difference = _difference(recorded, R, omega)
        if difference > ROUNDING:
            wrong.append(f"{frame} ({difference:.2g} rad/s)")
    if wrong:
        warnings.warn(f"{given.name}: angular velocities in {N} contradict the orientations of the frames {', '.join(wrong)}, at "
                      f"random states with numbers of size 1; the equations of motion are taken as they are. Orient frames by "
                      f"the coordinates that the speeds belong to, or leave out set_ang_vel", ModelWarning, stacklevel=4)


def _difference(recorded: Recorded, R: sp.MatrixBase, omega: sp.MatrixBase) -> float:
    """Between an angular velocity and the one of a rotation matrix, both in the axes of the body, rad/s."""
    a, symbols = recorded.algebra, recorded.symbols
    known = {*recorded.taken.leaves, *symbols.parameters}
    if any(f not in known for f in functions_of_time(R, omega)):
        return 0.0  # axes that the equations do not depend on, such as a wheel's own
    with a.section("orientation of a body"):
        turning, own = recorded.taken.matrix(R), recorded.taken.constants(omega)
        rate = np.array(forward(a.recorder, turning.ravel().tolist(), a.by_time(symbols.coordinates, recorded.rates)),
                        dtype=object).reshape(3, 3)
        skew = turning.T @ rate
    of_rotation = np.array([skew[2, 1], skew[0, 2], skew[1, 0]], dtype=object)
    values = at_random_states(a, symbols, difference=own - of_rotation)["difference"]
    return float(np.nanmax(np.abs(values), initial=0.0))
