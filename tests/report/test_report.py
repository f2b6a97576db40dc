"""The report names what was generated and each thing skipped."""

import symdyn as sd
from symdyn.functions.tapes import function_tape


def report(system: sd.System) -> str:
    return str(system.embedding().compile(backend="numpy").report())


def test_counts_and_prologue():
    text = report(sd.systems.get("double_pendulum"))
    row = next(line.split() for line in text.splitlines() if line.strip().startswith("rhs"))
    tape = function_tape(sd.systems.get("double_pendulum").embedding(), "rhs")
    assert int(row[1]) == tape.operations and int(row[-1]) == tape.longest_chain()
    assert "nothing depends on t" in text and "hoisted into the prologue" in text


def test_constant_mass_matrix():
    text = report(sd.systems.get("prismatic_chain"))
    assert "the mass matrix is constant and is factorized once" in text
    assert "k_tilde: zero by structure" in text


def test_separate_mechanisms_and_fixed_joints():
    qa, qb = sd.coordinates("qa qb")
    system = sd.System("two", gravity=[0, -9.81])
    for name, q in (("a", qa), ("b", qb)):
        arm = system.add_body(f"arm_{name}", mass=1, inertia=0.1, com=[0.5, 0])
        system.add_joint(sd.Revolute(f"pin_{name}", system.ground, arm, q))
        load = system.add_body(f"load_{name}", mass=2)
        system.add_joint(sd.Fixed(f"weld_{name}", arm, load, parent_point=[1, 0]))
    text = report(system)
    assert "fixed joints weld_a, weld_b" in text
    assert "speeds 1; 2 do not act on each other" in text


# -- with constraints


def augmented_report(system: sd.System, **options) -> str:
    return str(system.augmented(**options).compile(backend="numpy").report())


def row_of(text: str, name: str) -> list[str]:
    return next(line for line in text.splitlines() if line.startswith(f"  {name:20}"))[22:].split()


def test_both_ways_to_the_accelerations_are_counted():
    text = augmented_report(sd.systems.get("four_bar"))
    equations = sd.systems.get("four_bar").augmented()
    assert int(row_of(text, "rhs")[0]) == function_tape(equations, "rhs").operations
    assert int(row_of(text, "rhs, algorithm")[0]) == function_tape(equations.singular_fallback, "rhs").operations
    assert "accelerations by " in text and "the numeric algorithm, which takes over where a pivot vanishes" in text
    assert "2 constraints" in text and all(row_of(text, name) for name in ("C", "C_r", "F_d", "lam", "reactions"))


def test_dependent_and_trivial_rows_are_reported():
    assert "they depend on the others at every state tried" in augmented_report(sd.systems.get("bricard"))
    q = sd.coordinates("q1:4")
    system, parent, at = sd.System("parallel", gravity=[0, 0, -9.81]), None, [0, 0, 0]
    for k, length in enumerate((1, 2, 2)):
        bar = system.add_body(f"bar{k}", mass=1, inertia=[1, 1, 1], com=[length / 2, 0, 0])
        system.add_joint(sd.Revolute(f"hinge{k}", parent or system.ground, bar, q[k], axis=[0, 0, 1], parent_point=at))
        parent, at = bar, [length, 0, 0]
    system.close_loop(sd.Revolute("close", system.ground, parent, axis=[0, 0, 1], parent_point=[2, 0, 0], child_point=at))
    system.initial = {q[0]: 1.25, q[1]: -0.7, q[2]: -2.13}
    assert "close_z, close_tilt_1, close_tilt_2: they hold by structure" in augmented_report(system)


def test_nothing_is_claimed_of_the_mass_matrix_that_constraints_change():
    x, y, z = sd.coordinates("x y z")
    m, g, h = sd.parameters("m g h")
    eq = sd.augmented([x, y, z], [m, m, m], [0, -m * g, 0], [x - y, y - 2 * z], name="slide")
    text = str(eq.compile(backend="numpy").report())
    assert "do not act on each other" not in text and "C_r: constant" in text and "F_d: zero by structure" in text
    assert "C_t: zero by structure" in text
    held = str(sd.augmented([x, y, z], [m, m, 0], [0, -m * g, h], [x - y, z - y]).compile(backend="numpy").report())
    assert "left out of its factors" not in held and "factorized once" not in held


def test_multipliers_are_left_out_where_accelerations_do_without():
    told = "multipliers: accelerations do without them"
    for name in ("four_bar", "particle_on_moving_slope"):
        equations = sd.systems.get(name).augmented()
        steps = set(equations.tape("rhs").steps)
        needed = any(e in steps for e in equations.quantity("lam"))
        assert (told in str(equations.compile(backend="numpy").report())) == (not needed)


def test_matrices_of_many_speeds_are_left_out_with_a_note():
    """The report of a long chain takes seconds, not minutes: the matrices of one of 151 links are left out."""
    few, many = (sd.systems.n_link_pendulum(n).compile(backend="numpy").report() for n in (10, 151))
    assert {"mass_matrix", "J"} <= {row.function for row in few.rows} and "not counted" not in str(few)
    assert {row.function for row in few.rows} - {row.function for row in many.rows} == {"mass_matrix", "J"}
    assert "mass_matrix, J: not counted, as their entries grow with the square of the 151 speeds; they are derived" in str(many)
