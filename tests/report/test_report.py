"""The report names what was generated and each thing skipped."""

import symdyn as sd
from symdyn.pipeline import function_tape


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


def test_long_equations_are_not_written_out_in_notebooks():
    short = sd.systems.get("pendulum").embedding()._repr_latex_()
    long = sd.systems.get("spatial_chain").embedding()._repr_latex_()
    assert r"\ddot" in short
    assert "operations" in long and len(long) < 300
