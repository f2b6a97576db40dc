"""All functions and quantities in one table: the quantity behind each, the shape of its result, what it says, what it needs.

Those of FUNCTIONS, STATICS, VARIATIONS and DERIVATIVES are for users. Besides them there are those that integrators call, the
intermediate quantities of formulations, and families, whose names have parts: `entry_of` finds the entry of any name.

Shapes are in these letters: n_q coordinates, n_u speeds, n_z further states, n_x = n_q + n_u + n_z, n_in inputs, n_p parameters,
n_c rows of constraints, n_b bodies, n_j joints, n_e events. A function without a shape here has one that the mechanism decides.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from symdyn.backend.packed import NAME as PACKED
from symdyn.formulation.names import (
    ADJOINT,
    BOUNDS,
    GROUPS,
    HESSIAN_PRODUCT,
    RANGES,
    along_group,
    curvature_named,
    derivative_named,
    link_named,
    output_named,
    rate_of,
    second_named,
    stabilized,
    variation_of,
)


@dataclass(frozen=True)
class FunctionEntry:
    """A function: title is what the header of generated code says; needs: what the mechanism must have, "" for nothing."""

    quantity: str
    shape: tuple[str, ...] | None
    title: str
    needs: str = ""


def _entries(*rows: tuple[str, str, tuple[str, ...] | None, str, str]) -> dict[str, FunctionEntry]:
    return {name: FunctionEntry(quantity, shape, title, needs) for name, quantity, shape, title, needs in rows}


_BODIES, _CONSTRAINTS = "bodies and joints", "constraints"
_ROW_OF_X, _ROW_OF_U, _ROW_OF_C = ("n_x",), ("n_u",), ("n_c",)

FUNCTIONS = _entries(
    ("rhs", "rhs", _ROW_OF_X, "x_dot = f(t, x) with x = [q; u; z]: M_tilde u_dot = F_tilde - k_tilde", ""),
    ("mass_matrix", "M_tilde", ("n_u", "n_u"), "mass matrix M_tilde = J^T M J", ""),
    ("k_tilde", "k_tilde", _ROW_OF_U, "k_tilde = J^T (M J_dot u + Q J u): Coriolis, centrifugal and gyroscopic terms", ""),
    ("F_tilde", "F_tilde", _ROW_OF_U, "F_tilde = J^T F: generalized forces of loads and gravity", ""),
    ("J", "J", None, "velocity transformation: [v_G; omega] of every body = J u, n-frame", ""),
    ("energy", "energy", ("2",), "kinetic and potential energy, J", _BODIES),
    ("inverse_dynamics", "inverse_dynamics", _ROW_OF_U, "tau = M_tilde u_dot + k_tilde - F_tilde for given accelerations ud", ""),
    ("outputs", "outputs", None, "the named outputs, one after the other", "outputs"),
    ("coriolis", "coriolis", ("n_u", "n_u"), "C with C u = k_tilde and M_tilde_dot - 2 C skew-symmetric", _BODIES),
    ("gravity_load", "gravity_load", _ROW_OF_U, "forces along the speeds that hold the weights", _BODIES),
    ("momentum", "momentum", ("6",), "angular momentum about the origin, then linear momentum, n-frame", _BODIES),
    ("momentum_G", "momentum_G", ("6",), "angular momentum about the centre of mass, then linear momentum, n-frame", _BODIES),
    ("center_of_mass", "center_of_mass", ("3",), "centre of mass of all bodies, n-frame, m", _BODIES),
    ("regressor", "regressor", ("n_u", "10 n_b"),
     "Y, tau = Y pi: ten inertial parameters a body, for given accelerations ud", _BODIES),
    ("inertial_parameters", "inertial_parameters", ("10 n_b",),
     "pi: m, h = m c, I about its origin (xx xy xz yy yz zz) of every body", _BODIES),
    ("base_regressor", "base_regressor", None, "Y_b, tau = Y_b pi_b: base parameters, for given accelerations ud", _BODIES),
    ("base_parameters", "base_parameters", None, "pi_b from the parameters of the model", _BODIES),
    ("C", "C", _ROW_OF_C, "constraints, zero where they hold; 0 in rows of velocity constraints", _CONSTRAINTS),
    ("C_r", "C_r", ("n_c", "n_u"), "Jacobian of the constraints in the speeds", _CONSTRAINTS),
    ("C_t", "C_t", _ROW_OF_C, "partial derivative of the constraints by time", _CONSTRAINTS),
    ("C_dot", "C_dot", _ROW_OF_C, "rate of the constraints, C_r u + C_t", _CONSTRAINTS),
    ("F_d", "F_d", _ROW_OF_C, "right side of C_r u_dot = F_d", _CONSTRAINTS),
    ("lam", "lam", _ROW_OF_C, "multipliers: M_tilde u_dot + k_tilde + C_r^T lam = F_tilde", _CONSTRAINTS),
    ("reactions", "reactions", ("n_j", "6"),
     "force and moment of every joint on its child, at the joint's point on it, n-frame", _BODIES),
    ("cut_loads", "cut_loads", ("n_j", "6"),
     "the whole load in every joint: its reaction, and what acts along its speeds, likewise", _BODIES),
    ("ground_rotation", "ground_rotation", ("3", "3"),
     "rotation of the ground's frame, which moves, to the n-frame", "a ground that moves"),
    ("reactions_by_lam", "reactions_by_lam", ("6 n_j", "n_c"), "derivatives of the reactions, row by row, by the multipliers",
     _CONSTRAINTS),
    ("C_scale", "C_scale", _ROW_OF_C, "factors that make every constraint a length", _CONSTRAINTS),
    ("length", "length", (), "the mechanism's length, m", _CONSTRAINTS),
    ("N", "N", ("n_q", "n_u"), "q_dot = N u + what is given", ""),
    ("position_correction", "position_correction", ("n_c + n_q",),
     "constraints as lengths, and the smallest change of q that makes them zero", _CONSTRAINTS),
    ("velocity_correction", "velocity_correction", ("n_c + n_u",),
     "their rates, m/s, and the smallest change of u that makes them zero", _CONSTRAINTS),
    ("residual", "residual", ("n_x + 2 n_c",),
     "residual of the stabilized index-2 form; ud: q_dot, u_dot, z_dot, lam, mu", _CONSTRAINTS),
    ("power", "power", (), "power of all loads but gravity and springs, and of prescribed motions, W", _BODIES),
    ("power_x", "power_x", _ROW_OF_X, "derivative of the power by x", _BODIES),
    ("Jd_qd", "Jd_qd", None, "accelerations [a_G; alpha] of every body with u_dot = 0, n-frame", ""),
    ("joint_points", "joint_points", ("n_j", "6"),
     "where every joint sits on its parent, then on its child, n-frame, m", _BODIES),
    ("joint_axes", "joint_axes", ("n_j", "3"),
     "unit axis of every joint, n-frame; zero for one that has none or two", _BODIES),
    ("spring_points", "spring_points", None,
     "both ends of every spring, damper and force between two points, n-frame, m", "loads between two points"),
    ("applied_loads", "applied_loads", None,
     "where every force and torque of a load acts on its body, m, and its vector, N or N m, n-frame", "loads on bodies"),
    ("weights", "weights", ("n_b", "3"), "weight of every body, which acts at its centre of mass, n-frame, N", "gravity"),
    ("frames", "frames", ("n_b", "12"), "origin and rotation (row by row) of every body's frame, n-frame", _BODIES),
    ("positions", "positions", None, "centres of mass, n-frame, m", ""),
    ("validity_checks", "validity_checks", None,
     "values that have a range of validity: draft, tilt and the like", "loads with a range of validity"),
    ("compliant_contacts", "compliant_contacts", None,
     "gap, m, slip speed that counts as sticking, forces, N, and slips, m/s, of every compliant contact", "compliant contacts"),
    ("contact_coefficients", "contact_coefficients", None,
     "coefficients and lengths of contacts that are expressions of parameters",
     "contacts with expressions of parameters"),
    ("contacts", "contacts", None,
     "gap, friction, restitution of every contact; slips, free accelerations, forces of its rows; D, M^-1 J^T, N M^-1 J^T",
     "rigid contacts"),
    ("contact_gaps", "contact_gaps", None,
     "gap, static and kinetic friction, restitution of every rigid contact; relative velocities along its rows, m/s",
     "rigid contacts"),
    ("contact_directions", "contact_directions", None, "J, M^-1 J^T of the rows of rigid contacts, row by row", "rigid contacts"),
    ("contact_points", "contact_points", None,
     "where every contact touches, m, and the force on its body a, N, n-frame", "contacts"),
    ("contact_spheres", "contact_spheres", None,
     "coefficients and planes of contact groups; of their bodies radius, centre, velocities, derivatives of these, mass matrix",
     "contact groups"),
    ("events", "events", ("n_e",), "what vanishes at the events, in their order", "events"),
    ("event_resets", "event_resets", None, "what entries of the state become at events that reset them", "events with resets"),
    ("reset_directions", "reset_directions", None, "changes of [q; u] along each coordinate and speed that events reset",
     "events with resets"),
    ("switches", "switches", None, "what passes zero where the right-hand side may jump", "jumps"),
    ("drawn_lengths", "drawn_lengths", None, "lengths and other numbers of pictures that follow from parameters, m", "shapes"),
    ("jacobian_x", "jacobian_x", ("n_x", "n_x"), "exact derivative of x_dot by x", ""),
    ("jacobian_inputs", "jacobian_inputs", ("n_x", "n_in"), "exact derivative of x_dot by the inputs", ""),
    ("jacobian_params", "jacobian_params", ("n_x", "n_p"), "exact derivative of x_dot by the parameters", ""),
    ("input_matrix", "input_matrix", ("n_u", "n_in"), "exact derivative of F_tilde by the inputs", "inputs"),
)
# Text that the header adds where there are constraints, which these functions leave out.
OF_THE_CUT_TREE = {"inverse_dynamics": ", of the tree: loops cut, without constraints"}

# Functions of statics and linearization, compiled together.
STATICS = _entries(
    ("balance", "balance", None,
     "[M_tilde u_dot + k_tilde - F_tilde + C_r^T lam; C; z_dot; C_dot; C_ddot; q_dot; q_ddot]; ud: u_dot, lam", ""),
    ("N_dot", "N_dot", ("n_q", "n_u"), "derivative of N by time", ""),
)
# Along directions that are arguments: one short function in place of long matrices.
VARIATIONS = _entries(
    ("variation", "variation", None, "derivative of the balance along a direction of [q; u; z; inputs; p; u_dot; lam]", ""),
    ("second_variation", "second_variation", None,
     "the same derivative of the linear form of its first three parts in v (q' = N v), u', u_dot', z', lam'", ""),
    ("outputs_variation", "outputs_variation", None, "the same derivative of the outputs", "outputs"),
)
# Further derivatives, each made by itself when it is requested.
DERIVATIVES = _entries(
    ("stiffness", "stiffness", ("n_u", "n_q"),
     "derivative of M_tilde u_dot + k_tilde - F_tilde + C_r^T lam by q; ud: u_dot, lam", ""),
    ("damping", "damping", ("n_u", "n_u"),
     "derivative of M_tilde u_dot + k_tilde - F_tilde + C_r^T lam by u; ud: u_dot, lam", ""),
)
ALL = {**FUNCTIONS, **STATICS, **VARIATIONS, **DERIVATIVES}

# [q; u] of all columns after the projection of the state; of values at events, and of resets, their derivatives by the time and
# along every column; u of all columns after a reset that constraints carry on.
CORRECTED, OF_EVENTS, OF_RESETS, CARRIED = COLUMNS = ("corrected_columns", "event_columns", "event_reset_columns",
                                                      "carried_columns")
# From weights of x_dot, and of the state after its projection, to those of the state before and of what there is to change.
WEIGHTS, CORRECTED_WEIGHTS = ADJOINTS = ("rhs_weights", "corrected_weights")
# Functions that only integrators call.
OF_INTEGRATORS = _entries(*[(name, name, None, title, needs) for name, title, needs in (
    (BOUNDS, "bounds of the values at events and of their first two derivatives within bounds of their arguments", "events"),
    (RANGES, "bounds of the values at events within bounds of their arguments", "events"),
    (PACKED, "the entries of jacobian_x that may differ from zero, row by row", "statements for x_dot"),
    (CORRECTED, "columns of sensitivities after the projection of the state", ""),
    (OF_EVENTS, "values at events by the time, and along every column of sensitivities", "events"),
    (OF_RESETS, "what resets make of the state by the time, and along every column of sensitivities", "events with resets"),
    (CARRIED, "columns of sensitivities after a reset that constraints carry on", "events with resets, constraints"),
    (WEIGHTS, "from weights of x_dot to those of x and of what there is to change", ""),
    (CORRECTED_WEIGHTS, "from weights of the projected state to those of the state before", ""))])

_UNKNOWNS = ("n_u + n_c",)
_ARGUMENTS = ("n_x + n_in + n_p + 1",)
# Quantities that functions are made of.
INTERMEDIATE = _entries(*[(name, name, shape, title, needs) for name, shape, title, needs in (
    ("bias", _ROW_OF_U, "k_tilde - F_tilde", ""),
    ("accelerations", _ROW_OF_U, "u_dot", ""),
    ("rates", ("n_q",), "q_dot", ""),
    ("unknowns", _UNKNOWNS, "what the equations are solved for: u_dot, lam", ""),
    *[(along_group("unknowns", group), _UNKNOWNS, f"derivative of the unknowns along a direction in the group {group}", "")
      for group in GROUPS],
    ("matrix", ("n_u + n_c", "n_u + n_c"), "matrix of the equations in the unknowns", _CONSTRAINTS),
    ("right_side", _UNKNOWNS, "right side of the equations in the unknowns", _CONSTRAINTS),
    *[(stabilized(name), shape, f"{name}, stabilized by Baumgarte's method", _CONSTRAINTS)
      for name, shape in (("rhs", _ROW_OF_X), ("jacobian_x", ("n_x", "n_x")), ("unknowns", _UNKNOWNS))],
    *[(along_group(stabilized("unknowns"), group), _UNKNOWNS,
       f"derivative of the stabilized unknowns along a direction in the group {group}", _CONSTRAINTS) for group in GROUPS],
    (ADJOINT, _ARGUMENTS, "gradient of a weighted sum of x_dot by x, inputs, parameters and t", ""),
    *[(along_group(ADJOINT, group), _ARGUMENTS, f"derivative of this gradient along a direction in the group {group}", "")
      for group in GROUPS],
    (variation_of("rhs"), _ROW_OF_X, "derivative of x_dot along a direction of x, inputs and parameters", ""),
    ("rhs_variation_by_matrix", _ROW_OF_X, "the same, by a matrix that many directions share", ""),
    (variation_of("corrected"), ("n_q + n_u",), "derivative of the projected coordinates and speeds along a direction", ""),
    (variation_of("carried"), _ROW_OF_U, "derivative of the speeds after a reset that constraints carry on",
     "events with resets, constraints"),
    ("outputs_sensitivity", None, "derivative of the outputs along the motion", ""),
    *[(of(name), shape, f"derivative of {name} {way}", "") for name, shape in (("events", ("n_e",)), ("event_resets", None))
      for of, way in ((rate_of, "by the time alone"), (variation_of, "along a direction"))],
    ("Jdot", None, "derivative of J by the time", ""),
    ("page_inverse_dynamics", _ROW_OF_U, "tau by the inward recursion of the links", "a tree in recursive form"),
    ("page_accelerations", _ROW_OF_U, "u_dot by the outward recursion of the links", "a tree in recursive form"),
    ("r", None, "positions that were given", "equations from given positions"),
    ("F_c", None, "M r_ddot - F", "equations from given positions"),
    ("kinetic_energy", (), "kinetic energy, J", "equations from given matrices"),
    ("constraint_force", _ROW_OF_U, "-C_r^T lam", "constraints on given matrices"))])
EVERY = {**{entry.quantity: entry for entry in ALL.values()}, **ALL, **OF_INTEGRATORS, **INTERMEDIATE}


_SIZES = {"x": "n_x", "inputs": "n_in", "params": "n_p", "t": "1", "ud": "n_u"}
_ALONG_LINK = ("S", "S_ring")
_MATRICES = ("X", "X_star", "I", "I_A")


def _derivative(name: str) -> FunctionEntry | None:
    one = derivative_named(name)
    if one is None or one.of not in ALL:
        return None
    of = ALL[one.of]
    shape = None if of.shape is None else (*of.shape, _SIZES[one.by])
    return FunctionEntry(name, shape, f"derivatives of {one.of} by {one.by}", of.needs)


def _weighted(name: str) -> FunctionEntry | None:
    one = second_named(name)
    if one is None:
        return None
    n = " + ".join(_SIZES[by] for by in one.wrt)
    shape = (n,) if one.kind in (ADJOINT, HESSIAN_PRODUCT) else (n, n)
    what = {ADJOINT: "gradient", HESSIAN_PRODUCT: "second derivatives, times a direction,"}.get(one.kind, "second derivatives")
    return FunctionEntry(name, shape, f"{what} of a weighted sum of x_dot by {', '.join(one.wrt)}", "")


def _curvature(name: str) -> FunctionEntry | None:
    one = curvature_named(name)
    if one is None:
        return None
    n = " + ".join(_SIZES[by] for by in one.wrt)
    return FunctionEntry(name, (n, n), f"second derivatives of a weighted sum of {one.of} by {', '.join(one.wrt)}", one.of)


def _of_link(name: str) -> FunctionEntry | None:
    one = link_named(name)
    if one is None:
        return None
    shape = None if one.letter in _ALONG_LINK else ("6", "6") if one.letter in _MATRICES else ("6",)
    return FunctionEntry(name, shape, f"{one.letter} of link {one.number}", "a tree in recursive form")


def _output(name: str) -> FunctionEntry | None:
    given = output_named(name)
    return None if given is None else FunctionEntry(name, None, f"the output {given}", "outputs")


# Names of several parts -> the function that gives the entry of such a name, None of others.
FAMILIES: Mapping[str, Callable[[str], FunctionEntry | None]] = {
    "output_<name>": _output, "<letter>_<link>": _of_link, "<function>_by_<group>": _derivative,
    "adjoint_<groups>, hessian_<groups>, hessian_product_<groups>": _weighted,
    "constraints_hessian_<groups>, outputs_hessian_<groups>": _curvature}


def entry_of(name: str) -> FunctionEntry | None:
    """The entry of a function or quantity, its own or that of its family; None for other names."""
    if name in EVERY:
        return EVERY[name]
    return next((entry for family in FAMILIES.values() if (entry := family(name)) is not None), None)


# Functions by which consistent states are found, compiled together.
CONSISTENCY = ("C", "C_r", "C_t", "C_dot", "C_scale", "N", "mass_matrix")
# Functions that are written to files by default; Jacobians and the like are long and made on request.
STANDARD = ("rhs", "mass_matrix", "k_tilde", "F_tilde", "J", "energy", "inverse_dynamics", "outputs")


# The library of many states of a right-hand side at once.
BATCH = "rhs_batch"


def seldom_called(name: str) -> bool:
    """Whether a function is called so seldom that compiling it quickly counts for more than running it quickly."""
    return name in STATICS or name in VARIATIONS or name in DERIVATIVES


def quantity_of(name: str) -> str:
    """The quantity behind a function; any quantity is a function under its own name, too."""
    entry = entry_of(name)
    return name if entry is None else entry.quantity


def title_of(name: str, constrained: bool) -> str:
    """Description of a function in the header of generated code; of a name without an entry the name itself."""
    entry = entry_of(name)
    title = name if entry is None else entry.title
    return title + (OF_THE_CUT_TREE.get(name, "") if constrained else "")
