"""verify() passes for sound equations and fails for unsound ones."""

import dataclasses

import pytest
import sympy as sp

import symdyn as sd
from symdyn import verification
from symdyn.lab import wrong_equations
from symdyn.verification import checks_of, identities, judged
from symdyn.verification.states import samples
from tests.helpers import swept

PRINTED = {
    "M_tilde": ["kinetic energy is quadratic"],
    "k_tilde": ["M_tilde u_dot + k_tilde = F_tilde"],
    "F_tilde": ["M_tilde u_dot + k_tilde = F_tilde"],
    "energy": ["rate of energy", "kinetic energy is quadratic"],
    "J": ["J u is the rate"],
    "positions": ["J u is the rate"],
    "inverse_dynamics": ["inverse dynamics"],
    "coriolis": ["Coriolis matrix times u", "twice the Coriolis matrix"],
}


@pytest.fixture(scope="module")
def equations():
    return sd.systems.get("two_link_arm").recursive()


def test_sound_equations_pass(equations):
    result = equations.verify(states=3)
    assert result.passed
    assert all(check.residual is not None for check in result.checks)
    assert "M_tilde is symmetric" in str(result) and "FAIL" not in str(result)


@pytest.fixture(scope="module")
def arm():
    return sd.systems.get("three_link_arm").embedding()


@pytest.mark.parametrize("row", swept(range(18), 0, 10, 17))
def test_every_row_of_the_jacobian_is_proved(arm, row):
    wrong = arm.quantity("J") * 1
    wrong[row] = wrong[row] + 1e-9
    spoilt = dataclasses.replace(arm, _recorded={**arm._recorded, "J": wrong}, _printed={})
    failed = [check.name for check in spoilt.verify(states=1).checks if check.passed is False]
    assert failed == ["J u is the rate of the positions and rotations"]


def test_loads_that_leave_their_domain():
    q = sd.coordinates("q")
    system = sd.System("slider")
    body = system.add_body("body", mass=1)
    joint = system.add_joint(sd.Prismatic("slide", system.ground, body, q))
    system.add_joint_force(joint, sp.log(q))
    assert system.embedding().verify(states=2).passed
    system.add_joint_force(joint, sp.sqrt(-2 - q**2))
    with pytest.raises(sd.SymdynError, match="is defined at 0 of 80 random states only"):
        system.embedding().verify(states=2)


def test_arbitrary_inertias_are_no_failure():
    system = sd.System("chain", gravity=[0, 0, -9.81])
    parent = system.ground
    for k in range(3):
        xx, yy, zz, xy, xz, yz, m = sd.parameters(f"xx{k} yy{k} zz{k} xy{k} xz{k} yz{k} m{k}")
        body = system.add_body(f"b{k}", mass=m, inertia=[[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], com=[0.3, 0.1, 0])
        system.add_joint(sd.Revolute(f"j{k}", parent, body, sd.coordinates(f"q{k}"), axis=[(0, 0, 1), (0, 1, 0)][k % 2]))
        parent = body
    result = system.embedding().verify(states=4)
    assert result.passed, str(result)


@pytest.mark.parametrize("quantity", PRINTED)
def test_one_wrong_quantity_is_found(equations, quantity):
    right = equations.quantity(quantity)
    wrong = right * 1
    index = next(i for i in range(wrong.size) if not isinstance(wrong.ravel()[i], int))
    wrong.ravel()[index] = wrong.ravel()[index] * (1 + 1e-9) + 1e-9
    spoilt = dataclasses.replace(equations, _recorded={**equations._recorded, quantity: wrong}, _printed={})
    result = spoilt.verify(states=2)
    assert not result.passed
    failed = [check.name for check in result.checks if check.passed is False]
    for part in PRINTED[quantity]:
        assert any(part in name for name in failed), failed


def test_negative_inertia_is_found(equations):
    result = equations.verify(states=1, params={"m1": -50.0})
    failed = {c.name for c in result.checks if c.passed is False}
    assert "M_tilde is positive definite" in failed
    assert any("NumPy module" in name for name in failed)


def test_without_numbers_definiteness_is_not_judged():
    q = sd.coordinates("q")
    mass = sd.parameters("mass")
    system = sd.System("slider")
    body = system.add_body("body", mass=mass)
    system.add_joint(sd.Prismatic("slide", system.ground, body, q))
    result = system.embedding().verify(states=1)
    check = next(c for c in result.checks if "positive definite" in c.name)
    assert check.passed is None and "without numbers" in check.remark


def test_euler_parameters_and_given_motion():
    p = sd.coordinates("p0:4")
    system = sd.System("top", gravity=[0, 0, -9.81])
    system.move_ground([0.1 * sd.t**2, 0, 0], [sd.t, 0, 0])
    body = system.add_body("body", mass=2, inertia=[1, 2, 2.5], com=[0.1, 0.2, 0.3])
    system.add_joint(sd.Spherical("joint", system.ground, body, p, sd.EulerParameters()))
    result = system.embedding().verify(states=2)
    assert result.passed, str(result)


# -- with constraints


def closed(kind: str) -> sd.System:
    """A body on a ball joint and a free one, with a joint of some kind between them."""
    system = sd.System(f"closed_{kind}", gravity=[0.3, -1, -9.81])
    a, b = (system.add_body(name, mass=m, inertia=[1, 2, 2.5], com=[0.1, 0.2, 0.3]) for name, m in (("a", 2), ("b", 3)))
    system.add_joint(sd.Spherical("ball", system.ground, a, sd.coordinates("e0:4"), sd.EulerParameters(),
                                  parent_point=[0, 0.5, 0]))
    system.add_joint(sd.Free("free", system.ground, b, sd.coordinates("x y z psi theta phi")))
    at = {"parent_point": [0.4, 0.1, 0.2], "child_point": [0.4, -0.4, 0.2]}
    joints = {"fixed": lambda: sd.Fixed("loop", a, b, **at),
              "revolute": lambda: sd.Revolute("loop", a, b, axis=[0.6, 0, 0.8], **at),
              "prismatic": lambda: sd.Prismatic("loop", a, b, axis=[0, 0.6, 0.8], **at),
              "cylindrical": lambda: sd.Cylindrical("loop", a, b, axis=[0.6, 0.8, 0], **at),
              "universal": lambda: sd.Universal("loop", a, b, axes=([1, 0, 0], [0, 0.6, 0.8]), **at),
              "spherical": lambda: sd.Spherical("loop", a, b, **at), "planar": lambda: sd.Planar("loop", a, b, **at),
              "helical": lambda: sd.Helical("loop", a, b, sd.coordinates("s"), axis=[0, 0, 1], pitch=0.2, **at),
              "rod": lambda: sd.Rod("loop", a, b, 0.8, **at)}
    system.close_loop(joints[kind]())
    if kind == "rod":
        system.initial = {"x": 0.8}
    return system


def proved(equations, states=1):
    """name -> whether it holds, None where it does not apply, of all checks but those of generated code."""
    import mpmath

    from symdyn.verification import checks_of
    from symdyn.verification.states import samples

    found = samples(equations, states, 30, None, 1)
    with mpmath.workdps(35):
        residuals = {name: ([check(s) for s in found], tolerance) for name, check, tolerance in checks_of(equations)}
    return {name: None if rs[0] is None else max(rs) <= tolerance for name, (rs, tolerance) in residuals.items()}


def failed_of(equations, states=1):
    return [name for name, holds in proved(equations, states).items() if holds is False]


CLOSING = ("fixed", "revolute", "prismatic", "cylindrical", "universal", "spherical", "planar", "helical", "rod")


@pytest.mark.parametrize("kind", swept(CLOSING, "fixed", "planar", "helical", "rod"))
def test_every_joint_that_closes_a_loop(kind):
    found = proved(closed(kind).augmented())
    assert False not in found.values(), found
    assert {"C_ddot = 0 along the motion", "reactions, loads and weight move every body",
            "reactions do no work along what their joints allow", "C_dot is the rate of C"} <= {n for n in found if found[n]}


@pytest.mark.parametrize("name", ["rolling_disc", "particle_on_moving_slope", "double_wishbone",
                                  *swept(["andrews_squeezer", "car_axis"])])
def test_identities_hold_under_constraints(name):
    assert not failed_of(sd.systems.get(name).augmented(), 2)


@pytest.mark.parametrize("name", ["four_bar", "bricard"])
def test_constrained_mechanisms_pass(name):
    result = sd.systems.get(name).augmented().verify(states=1)
    assert result.passed and "C_r u_dot = F_d" in str(result), str(result)


def test_absolute_coordinates_pass():
    assert not failed_of(sd.systems.get("four_bar").augmented(coordinates="absolute"))
    assert not failed_of(sd.systems.get("spatial_slider_crank").augmented(coordinates="absolute"))


def test_constraints_by_hand_pass():
    x, y = sd.coordinates("x y")
    m, l, g = sd.parameters("m l g")
    eq = sd.augmented([x, y], [m, m], [0, -m * g], [x**2 + y**2 - l**2], name="bob", initial={x: 0.7, y: -0.7})
    result = eq.verify(states=2)
    assert result.passed, str(result)
    assert not failed_of(eq, 3)


def test_samples_fulfil_the_constraints_to_all_digits():
    import mpmath

    from symdyn.verification.states import samples

    for name in ("bricard", "rolling_disc"):
        for s in samples(sd.systems.get(name).augmented(), 2, 30, None, 1):
            with mpmath.workdps(35):
                assert max(abs(v) for q in ("C", "C_dot") for v in s[q]) < mpmath.mpf(10) ** -27


def test_without_a_consistent_state_it_reports_it():
    x, y = sd.coordinates("x y")
    with pytest.warns(sd.ModelWarning, match="no state was found"):
        eq = sd.augmented([x, y], [1, 1], None, [x**2 + y**2 + 1], name="nowhere")
    with pytest.raises(sd.SymdynError, match="0 of 40 searches near the initial state"):
        eq.verify(states=1)


SPOILT = {
    "C": ["C_dot is the rate of C"],
    "C_r": ["C_dot = C_r u + C_t", "C_r u_dot = F_d", "u_dot + k_tilde + C_r"],
    "C_t": ["C_dot = C_r u + C_t"],
    "C_dot": ["C_dot is the rate of C", "C_dot = C_r u + C_t"],
    "F_d": ["C_r u_dot = F_d"],
    "lam": ["u_dot + k_tilde + C_r", "inverse dynamics", "solve the whole system"],
    "accelerations": ["C_ddot = 0", "rate of energy"],
    "reactions": ["move every body"],
}


@pytest.fixture(scope="module")
def linkage():
    return sd.systems.get("four_bar").augmented()


@pytest.mark.parametrize("quantity", SPOILT)
def test_one_wrong_quantity_under_constraints_is_found(linkage, quantity):
    wrong = linkage.quantity(quantity) * 1
    wrong.ravel()[0] = wrong.ravel()[0] * (1 + 1e-7) + 1e-7
    spoilt = dataclasses.replace(linkage, _recorded={**linkage._recorded, quantity: wrong}, _printed={})
    failed = failed_of(spoilt, 2)
    for part in SPOILT[quantity]:
        assert any(part in name for name in failed), failed


@pytest.mark.parametrize("kind, row, entry, failing", [
    ("revolute", "_tilt", "rest", "C_ddot = 0 along the motion"), ("prismatic", "_across", "n_p", "C_dot is the rate of C"),
    ("rod", "_distance", "f", "C_dot is the rate of C"), *swept([
        ("prismatic", "_across", "rest", "C_ddot = 0 along the motion"),
        ("rod", "_distance", "rest", "C_ddot = 0 along the motion"),
        ("revolute", "_tilt", "n_p", "C_dot is the rate of C"), ("planar", "_across", "f", "C_dot is the rate of C"),
        ("universal", "_tilt", "n_c", "C_dot is the rate of C")])])
@pytest.mark.filterwarnings("ignore::symdyn.ModelWarning")
def test_a_row_with_a_wrong_sign_is_found(monkeypatch, kind, row, entry, failing):
    from symdyn.formulation.constraints import closures

    right = getattr(closures, row)

    def wrong(*arguments):
        made = right(*arguments)
        return dataclasses.replace(made, **{entry: -getattr(made, entry)})

    monkeypatch.setattr(closures, row, wrong)
    assert failing in failed_of(closed(kind).augmented())


def test_a_wrong_reaction_of_one_joint_is_found(linkage):
    for k in range(len(linkage.joints)):
        wrong = linkage.quantity("reactions") * 1
        wrong[k] = -wrong[k]
        spoilt = dataclasses.replace(linkage, _recorded={**linkage._recorded, "reactions": wrong}, _printed={})
        assert "reactions, loads and weight move every body" in failed_of(spoilt)


# -- false alarms, and what must be found all the same


@pytest.mark.parametrize("make", wrong_equations.SYSTEMS, ids=lambda make: make.__name__)
def test_right_equations_raise_no_alarm_and_wrong_ones_are_found(make):
    """Rotations and beams in doubles, coordinates that drive others, loops, named speeds; a few of the wrong entries each."""
    tally = wrong_equations.sweep(make(), quantities=("k_tilde", "energy", "F_d"), every=9)
    assert tally.alarms == [] and tally.accepted == []
    assert tally.found == tally.tried and tally.found.total() >= 2


def test_what_rounding_of_constants_explains_is_reported():
    result = wrong_equations.chain().verify(states=1)
    checks = {check.name: check for check in result.checks}
    work = checks["kinetic energy is quadratic in u with M_tilde"]
    assert result.passed and "constants are rounded to doubles" in str(result)
    assert 1e-20 < work.residual < 1e-15 and work.residual < work.tolerance < 1e-13


def test_lost_digits_are_distinguished_from_wrong_equations():
    """A mass matrix of the condition 1e24: at 30 digits the accelerations have six."""
    q1, q2 = sd.coordinates("q1 q2")
    system = sd.System("light", gravity=[0, -10, 0])
    first = system.add_body("first", mass=1, com=[1, 0, 0])
    second = system.add_body("second", mass=sp.Rational(1, 10**24), com=[1, 0, 0])
    system.add_joint(sd.Revolute("j1", system.ground, first, q1))
    system.add_joint(sd.Revolute("j2", first, second, q2, parent_point=[1, 0, 0]))
    system.add_joint_force("j2", -q2 / 10**24)
    drawn = samples(system.embedding(), 1, 30, None, 1)
    row = next(row for row in checks_of(drawn[0].equations) if row[0].startswith("rate of energy"))
    judgement = judged(drawn, *row)
    assert judgement.passed and row[1](drawn[0]) < 1


def test_reactions_of_joints_that_drive_others():
    """The motor of a gear works against what holds the wheel, and the sum of both is zero; a wrong reaction is found."""
    equations = wrong_equations.geared()
    check = next(row for row in checks_of(equations) if "do no work" in row[0])
    drawn = samples(equations, 1, 30, None, 1)
    assert check[1](drawn[0]) < 1e-18
    wrong = equations.quantity("reactions") * 1
    wrong[2, 5] = wrong[2, 5] * (1 + 1e-9)
    spoilt = dataclasses.replace(equations, _recorded={**equations._recorded, "reactions": wrong}, _printed={})
    assert check[1](samples(spoilt, 1, 30, None, 1)[0]) > 1e-13


# -- proved and sampled


def test_the_report_says_which_lines_are_proved_and_which_are_sampled(equations):
    result = equations.verify(states=1)
    proved = {check.name for check in result.checks if check.proved}
    sampled = {check.name for check in result.checks} - proved
    recursions = "recursions in spatial vectors, as pages of links show them, give the same"
    assert sampled == {"M_tilde is positive definite", recursions,
                       *(name for name in sampled if "module agrees" in name)}
    assert {"M_tilde u_dot + k_tilde = F_tilde", "rate of energy equals power of the loads"} <= proved and len(proved) == 8
    text = str(result)
    assert text.startswith("two_link_arm (recursive): 8 identities proved by exact algebra, ")
    assert f", {sum(not check.proved for check in result.checks)} verified at 1 random state\n" in text
    assert "  proved M_tilde is symmetric\n" in text and "  ok     M_tilde is positive definite" in text


def test_proofs_that_would_take_long_are_sampled_instead(equations, monkeypatch):
    monkeypatch.setattr("symdyn.exact.mechanism.QUICK", 1)
    result = equations.verify(states=1)
    assert result.passed and sum(check.proved for check in result.checks) <= 1
    assert not next(check for check in result.checks if "J u is" in check.name).proved


def test_constraints_are_proved_too():
    result = sd.systems.get("four_bar").augmented().verify(states=1)
    proved = {check.name for check in result.checks if check.proved}
    assert {"C_dot = C_r u + C_t", "C_dot is the rate of C"} <= proved and result.passed


def test_a_mass_matrix_with_speeds_leaves_the_kinetic_energy_to_states(equations):
    """T = u^3 / 6 has the second derivative u; T(u) + T(-u) - 2 T(0) is not u^2 u."""
    u = equations.leaves[equations.symbols.speeds[0]]
    M, energy = equations.quantity("M_tilde") * 0, equations.quantity("energy") * 0
    M[0, 0], energy.ravel()[0] = u, u * u * u / 6
    spoilt = dataclasses.replace(equations, _recorded={**equations._recorded, "M_tilde": M, "energy": energy}, _printed={})
    proved = verification._proved(spoilt)
    assert identities.symmetric in proved and identities.kinetic_energy_quadratic not in proved
