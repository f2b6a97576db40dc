"""References of work against error: closed forms, motions with more digits, two runs that agree, and where they are kept."""

import importlib.util
import json

import numpy as np
import pytest

import symdyn as sd
from symdyn.bench.work import closed_forms, store
from symdyn.bench.work.cases import CASES, file_name, named_case, of_system
from symdyn.bench.work.converged import Exact, TooLong, converged, states
from symdyn.bench.work.record import Reference
from symdyn.bench.work.reference import agreement, default_times, find_reference
from symdyn.bench.work.system_under_test import Comparison
from symdyn.errors import CompileError, SymdynError
from symdyn.lab import extended


@pytest.fixture(scope="module")
def pendulum():
    """The simple pendulum: what is measured, its formulations."""
    about = named_case("pendulum", end=2.0)
    return about, about.formulated(["embedding", "absolute"])[0]


@pytest.mark.parametrize(("name", "formulation"), [("lagrange_top", "embedding"), ("torque_free_body", "embedding:parameters")])
def test_closed_forms_hold_in_angles_and_parameters(name, formulation):
    about = named_case(name)
    (made,), _ = about.formulated([formulation])
    times = [0.03 * about.end, 0.1 * about.end]
    first = about.first()
    reference = Reference("closed form", tuple(times), about.closed(times), 15.9, "", first.coordinates)
    errors = Comparison(reference, first).errors(made, made.module.simulate(np.r_[0.0, times], rtol=1e-14).x[1:])
    assert np.max(errors) < 1e-13


def test_closed_form_of_the_pendulum_at_every_time():
    sol = sd.systems.get("pendulum").compile().simulate([0.0, 3.0, 50.0], rtol=1e-14)
    assert np.abs(sol.x[1:] - closed_forms.pendulum([3.0, 50.0])).max() < 1e-11


def test_lagrange_top_at_published_values():
    row = closed_forms.lagrange_top([0.5, 3.0])
    assert abs(np.cos(row[0][1]) - 0.358572654654426871) < 1e-15
    assert abs(row[1][0] - 1.624628447010773) < 1e-14


def test_free_body_turns_as_published_after_its_flip():
    (_, theta, psi, phi_dot, theta_dot, psi_dot), = closed_forms.free_body([20.0])
    omega = (phi_dot * np.sin(theta) * np.sin(psi) + theta_dot * np.cos(psi),
             phi_dot * np.sin(theta) * np.cos(psi) - theta_dot * np.sin(psi), psi_dot + phi_dot * np.cos(theta))
    assert np.abs(np.array(omega) - (-0.105321008009368935, -0.994438779046699508, 0.0608125938933418497)).max() < 1e-13


def test_heavy_top_where_it_is_published():
    (made,), _ = named_case("heavy_top").formulated(["embedding:parameters"])
    x = made.module.simulate([0.0, 0.2], rtol=1e-12).x[-1]
    known = (-7.08279152974312562e-1, 4.387810881265818973e-1, 5.457283961454176734e-1, 8.939975282400501e-2,
             -2.69159091214340862, 150.0, 4.917260989893994417)
    assert np.abs(x - known).max() < 1e-9


def test_converged_motion_is_the_closed_form(pendulum):
    about, (first, _) = pendulum
    times = [1.0, 2.0]
    reference, text = converged(first, times, digits=16)
    assert reference.digits >= 15
    assert np.abs(np.array(reference.x) - about.closed(times)).max() < 4e-16
    assert np.array_equal(np.array(text, dtype=float), reference.x)


def test_motion_with_more_digits_starts_from_the_very_floats(pendulum):
    _, (first, _) = pendulum
    precise = Exact(first, 40)
    assert precise.fixed["g"] == 9.81 and [float(v) for v in precise.start] == [2.0, 0.0]
    assert precise.fixed["g"] != precise.context.mpf("9.81")


def test_too_long_a_motion_is_given_up(pendulum):
    with pytest.raises(TooLong, match="at 16 digits got to t = 0"):
        states(pendulum[1][0], [2.0], 16, until=0.0)


def test_references_are_kept_and_found(pendulum, tmp_path, monkeypatch):
    monkeypatch.setenv("SYMDYN_CACHE_DIR", str(tmp_path))
    about, (first, _) = pendulum
    open_subject = of_system(first.system, end=1.0)
    made = find_reference(open_subject, [first])
    again = find_reference(open_subject, [first])
    assert (made.kind, made.made, again.made) == ("extended", True, False)
    assert again.x == made.x and again.times == tuple(default_times(open_subject))
    assert np.abs(np.array(again.x) - about.closed(again.times)).max() < 1e-15
    (path,) = (tmp_path / "references").iterdir()
    data = json.loads(path.read_text())
    data["rates"][0][0] += 1e-3
    path.write_text(json.dumps(data))
    assert store.find(open_subject.name, first, again.times) is None  # another motion's
    path.write_text("{")
    assert store.find(open_subject.name, first, again.times) is None


def test_two_runs_agree_where_digits_would_take_too_long(pendulum, tmp_path, monkeypatch):
    monkeypatch.setattr("symdyn.bench.work.reference._METHODS", ("dop853",))
    monkeypatch.setenv("SYMDYN_CACHE_DIR", str(tmp_path))
    about, formulations = pendulum
    told = []
    reference = find_reference(of_system(formulations[0].system, end=1.0), formulations, seconds=1e-9, log=told.append)
    assert reference.kind == "agreement" and "would take about" in reference.how and "differ by" in reference.how
    assert reference.digits > 11 and told
    assert np.abs(np.array(reference.x) - about.closed(reference.times)).max() < 1e-11


def test_no_two_runs_no_reference(pendulum):
    _, (first, _) = pendulum
    with pytest.raises(SymdynError, match="there is no reference: too long, and no two runs"):
        agreement([_Stopping(first)], [1.0], "too long")


class _Stopping:
    """A formulation whose runs all stop."""

    name = "embedding"

    def __init__(self, like):
        self.equations, self.coordinates, self.module = like.equations, like.coordinates, self

    def simulate(self, *_, **__):
        raise SymdynError("it stops")


def test_errors_in_other_coordinates_are_those_of_bodies(pendulum):
    about, (first, absolute) = pendulum
    times = [1.0, 2.0]
    reference = Reference("closed form", tuple(times), about.closed(times), 15.9, "", first.coordinates)
    comparison = Comparison(reference, first)
    x = absolute.module.simulate([0.0, *times], rtol=1e-13).x[1:]
    assert np.max(comparison.errors(absolute, x)) < 1e-11
    x[1, 2] += 1e-3  # rad
    q, _ = comparison.errors(absolute, x)
    # Norms of the origin, at the pivot, and of nine entries of R with the norm sqrt(3), two pairs of which turn.
    assert abs(q[1] - 1e-3 * np.sqrt(2 / 3)) < 1e-5 and q[0] < 1e-11
    everything = Comparison(reference, first, bodies=True)
    x = first.module.simulate([0.0, *times], rtol=1e-14).x[1:]
    x[1] += 1e-3, 1e-4  # rad, rad/s
    q, u = everything.errors(first, x)
    size = np.abs(np.array(reference.x)[:, 1]).max()  # of the rate; velocities are (l, 1) times it
    assert abs(q[1] - 1e-3 * np.sqrt(2 / 3)) < 1e-5 and abs(u[1] - 1e-4 / size) < abs(reference.x[1][1]) / size * 1e-3
    assert np.isnan(comparison.errors(first, reference.x[:1] * np.ones((1, 2)))[0][1])  # it did not get there


def test_every_stored_reference_is_of_the_list():
    stored = store.stored()
    assert stored and set(stored) <= {file_name(name) for name in CASES}
    for data in stored.values():
        assert data["digits"] > 9 and len(data["times"]) == len(data["x"]) == 10 and "differ by" in data["how"]


@pytest.mark.parametrize("name", ["andrews_squeezer", "bricard", "car_axis", "four_bar"])
def test_stored_references_end_where_motions_of_decimal_numbers_end(name):
    known, row = extended.known(name), store.stored()[name]
    n = len(known["q"])
    assert known["t"] == row["times"][-1]
    for part, values in ((slice(0, n), known["q"]), (slice(n, 2 * n), known["q_dot"])):
        ours, theirs = np.array(row["x"][-1][part], dtype=float), np.array(values, dtype=float)
        assert np.abs(ours - theirs).max() < 2e-13 * np.abs(theirs).max()


@pytest.mark.parametrize("name", ["double_pendulum", "andrews_squeezer"])
def test_stored_references_are_of_the_mechanisms_as_they_are(name):
    data = store.stored()[name]
    about = next(s for s in map(named_case, CASES) if s.name == name)
    first = about.first()
    found = store.find(name, first, default_times(about))
    assert found is not None and found.digits == data["digits"]
    tight = first.module.simulate(np.r_[0.0, found.times[:2]], rtol=1e-13).x[1:]
    assert np.nanmax(Comparison(found, first).errors(first, tight)) < 1e-9


def user_function(tmp_path, body, line):
    """A body on a rail that a function of the user pulls."""
    (tmp_path / "pulling.py").write_text(f"def pulling(q):\n    return {body}\n", encoding="utf-8")
    spec = importlib.util.spec_from_file_location("pulling", tmp_path / "pulling.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    name = f"pull_{line.count('n')}_{len(body)}"
    pull = sd.External(name, ["q"], python=module.pulling,
                       c=f"static int {name}(const double *in, double *out)\n{{\n    out[0] = {line};\n    return 0;\n}}")
    q, (m,) = sd.coordinates("q"), sd.parameters("m1:2")
    system = sd.System("pulled", gravity=None)
    system.add_joint(sd.Prismatic("slide", system.ground, system.add_body("b", mass=m), q, axis=[1, 0, 0]))
    system.add_joint_force("slide", pull(q))
    system.defaults, system.initial = {m: 1}, {q: 1}
    return system


def test_what_a_compiler_says_is_reported_once(tmp_path):
    told = []
    about = of_system(user_function(tmp_path, "-q", "nonsense"), 1.0)
    with pytest.raises(CompileError, match="nonsense") as caught:
        find_reference(about, [about.first()], log=told.append)
    assert str(caught.value).count("Output:") == 1 and "reference" not in str(caught.value)
    assert not any("Output" in text or "nonsense" in text for text in told)


def test_what_a_users_text_raises_is_a_reason_and_no_crash(tmp_path):
    about = of_system(user_function(tmp_path, "1 / 0", "-in[0]"), 1.0)
    reference = find_reference(about, [about.first()])
    assert reference.kind == "agreement" and reference.digits > 10
    assert "raised ZeroDivisionError at (1.0): division by zero" in reference.how
