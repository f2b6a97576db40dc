"""Data files: what is written is read back to the same generated code; every fault has its line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.cli import main
from symdyn.datafile.expressions import FUNCTIONS, Wrong, parsed
from symdyn.datafile.lines import lines_of
from symdyn.datafile.texts import number_or_text
from symdyn.errors import UnsupportedExpression
from symdyn.pipeline import emit
from tests.helpers import swept
from tests.running import run_program


def code_of(system: sd.System) -> dict[str, str]:
    equations = system.augmented() if system.loops or system.constraints else system.embedding()
    return dict(emit(equations, "c", standalone=False, integrator=False).files)


@pytest.mark.parametrize("name", swept(sd.systems.names(), *sorted({*sd.systems.names()} - {
    "bicycle", "stewart_platform", "land_wind_turbine", "double_wishbone", "andrews_squeezer", "n_link_pendulum", "cart_pole",
    "double_pendulum", "spatial_chain", "prismatic_chain", "three_link_arm", "slider_crank", "spatial_slider_crank",
    "two_link_arm"})))
@pytest.mark.filterwarnings("ignore::symdyn.errors.ModelWarning")
def test_every_mechanism_of_the_catalogue_gives_the_same_code(name: str) -> None:
    system = sd.systems.get(name)
    text = system.to_toml()
    again = sd.read_system(text)
    assert again.to_toml() == text
    assert code_of(again) == code_of(system)
    assert {str(k): v for k, v in again.defaults.items()} == {str(k): float(v) for k, v in system.defaults.items()}
    assert {str(k): v for k, v in again.initial.items()} == {str(k): float(v) for k, v in system.initial.items()}
    assert [d.record for d in again.shapes] == [d.record for d in system.shapes]


def everything() -> sd.System:
    """A planar system with contacts, events, states, inputs, motions and quantities."""
    q, x, z = sd.coordinates("q x z")
    m, k, mu = sd.parameters("m k mu", positive=True)
    F, w = sd.inputs("F"), sd.motions("w")
    system = sd.System("everything", gravity=[0, -9.81])
    a = system.add_body("a", mass=m, inertia=0.1, com=[0.1, 0])
    b = system.add_body("b", mass=1, inertia=sp.Rational(1, 3))
    system.add_joint(sd.Prismatic("rail", system.ground, a, x, axis=[1, 0]))
    system.add_joint(sd.Revolute("hinge", a, b, q, parent_point=[0.2, 0]))
    system.add_force(b, [F, sp.Piecewise((k * x, x < 0), (0, True))], point=[0, -1], frame=a, reaction=a)
    system.add_torque(b, -sp.Abs(q.dot) * q.dot + w.dot)
    system.add_spring_damper(system.ground, b, [1, 0], [0, -1], k, 0.1, sp.Rational(1, 2))
    system.add_force_between("a", "b", sp.Max(0, k * (sd.distance("a", "b", [1, 0], [0, -1]) - 1)), [1, 0], [0, -1])
    system.add_state(z, -z + sd.velocity("b")[0])
    system.add_output("many", [z, sd.position("b", [0, -1])[1], sd.rotation_matrix("b")[0, 1], sd.angular_velocity("b")[2].dot])
    system.add_output("tip", sd.jacobian(b, [0, -1]))
    system.add_event("turns", q - 1, direction=1, reset={q.dot: -q.dot / 2})
    system.add_contact(sd.Contact("foot", b, system.ground, (sd.contacts.Point([0, -1]), sd.contacts.Plane([0, 1], [0, -2])),
                                  friction=(mu, mu / 2), restitution=0.5))
    system.add_contact(sd.Stop("stop", "rail", lower=-1, upper=2))
    system.add_contact(sd.JointFriction("rub", "hinge", 2.0, 1.5))
    system.draw(b, sd.shapes.Line([[0, 0], [0, -1]]), color="#336699")
    system.defaults, system.initial, system.units = {m: 1.0, k: 2, mu: 0.5}, {q: 0.3, x.dot: 1.0}, {k: "N/m"}
    return system


def test_every_kind_of_element_is_read_back() -> None:
    system = everything()
    text = system.to_toml()
    again = sd.read_system(text)
    assert again.to_toml() == text and code_of(again) == code_of(system)
    assert [o.name for o in again.outputs] == ["many", "tip"] and again.events == system.events
    given = {"q": {"q": 0.2}, "inputs": {"F": 0.4, "w": 0.0}, "t": (0.0, 0.05)}
    first, second = (s.compile(backend="numpy").simulate(**given) for s in (system, again))
    assert (first.q == second.q).all() and second.contacts["foot"].gap.shape == first.contacts["foot"].gap.shape


@pytest.mark.filterwarnings("ignore::symdyn.errors.ModelWarning")
def test_spatial_joints_loops_and_loads_of_water() -> None:
    q = sd.coordinates("q1:4")
    system = sd.System("space", gravity=[0, 0, -9.81])
    a, b = system.add_body("a", 10, [1, 2, 3]), system.add_body("b", 1, [[1, 0.1, 0], [0.1, 1, 0], [0, 0, 1]])
    system.add_joint(sd.Free("free", "ground", a, velocity="body", orientation=sd.EulerParameters()))
    system.add_joint(sd.Spherical("ball", a, b, q, orientation=sd.EulerAngles("ZXZ", "body"), parent_point=[0, 0, 1]))
    system.add_load(sd.Thrust(a, lambda v: 2 * v**2 + sp.sin(sd.t), axis=[1, 1, 0], wind=[sp.cos(sd.t), 0, 0]))
    system.add_load(sd.WaveExcitation(a, [1, 0, 0, 0, 0, 0], [0] * 6, 0.5, ramp=3))
    system.add_load(sd.LinearStiffness(a, np.diag([1.0, 2, 3, 4, 5, 6])))
    system.close_loop(sd.Rod("rod", "ground", b, 2.0, parent_point=[0, 0, 2]))
    system.set_speeds({})
    system.move_ground([sp.sin(sd.t), 0, 0])
    text = system.to_toml()
    assert sd.read_system(text).to_toml() == text and code_of(sd.read_system(text)) == code_of(system)


def test_chosen_speeds_and_assumptions() -> None:
    system = sd.systems.double_pendulum()
    q1, q2 = system.joints[0].coordinates[0], system.joints[1].coordinates[0]
    u1, u2 = sd.speeds("u1 u2")
    system.set_speeds({u1: q1.dot, u2: q1.dot + q2.dot})
    again = sd.read_system(system.to_toml())
    assert again.check().chosen == system.check().chosen
    m = sd.parameters("lambda", positive=True)
    odd = sd.System("odd", parameters=[m])
    odd.add_joint(sd.Prismatic("rail", "ground", odd.add_body("block", mass=m * sp.UnevaluatedExpr(2)), axis=[1, 0, 0]))
    assert sd.read_system(odd.to_toml()).check().parameters == (m,)


A, B = sp.symbols("a b")


@pytest.mark.parametrize("e", [
    sp.Rational(1, 3) * A ** sp.Rational(-3, 2), sp.sqrt(B) / 2, sp.Mul(2, A + 1, evaluate=False), sp.Float("0.1") * A,
    -(A - B) ** 2, sp.exp(-A), sp.pi * sp.E, sp.Integer(10) ** 30, sp.Piecewise((1, (A > 0) & ~(B > 1)), (0, True)),
    sp.Float(1e-300), A**B])
def test_expressions_are_read_back_equal(e: sp.Expr) -> None:
    symbols = {"a": sp.Symbol("a"), "b": sp.Symbol("b")}
    text = number_or_text(e, symbols, "it")
    back = sp.sympify(text) if not isinstance(text, str) else parsed(text, symbols)
    assert back == e and back.args == e.args


@pytest.mark.parametrize(("text", "message"), [
    ("__import__('os')", "is no part of an expression"),
    ("position('bob', [0, 0])[0]", "names stand in double quotation marks, the expression then in single ones"),
    ("a.__class__", "found '__class__' at character 3, expected dot or ddot"),
    ("eval(a)", "there is no function eval"), ("sun(a)", "there is no function sun; did you mean"), ("a +", "found the end"),
    ("aa", "aa is not declared; did you mean a?"), ("10**10**10", "too many digits"), ("1/0", "divides by zero"),
    ("(" * 200 + "a", "has more than 100 levels"), ("1e999", "beyond the range"), ("a < 1", "a condition; write a value"),
    ("a b", "expected an operator or the end"), ('position("x")[3]', "components 0 to 2"), ("sin(a, a)", "no expression"),
    ("a.dot", "a has none"), ("(1, 2) + a", "a list where a value is expected"),
    ('position(["x"])[0]', "a name in quotation marks"),
    ('distance("x")', "takes 2 names"), ('position("x", [1])[0]', "a point has 1 components"), ("", "found the end"),
    ("9" * 2000, "a number of 2000 digits"), ("lambda: 1", "is no part of an expression")])
def test_texts_that_are_no_expressions(text: str, message: str) -> None:
    with pytest.raises(Wrong) as found:
        parsed(text, {"a": sp.Symbol("a")})
    assert message in str(found.value)


HEAD = 'format = 1\nname = "m"\n'
BODY = '\n[[bodies]]\nname = "b"'
JOINT = '[[joints]]\ntype = "Revolute"\nname = "j"\nparent = "ground"\nchild = "b"\n'
BALL = JOINT.replace("Revolute", "Spherical")


@pytest.mark.parametrize(("text", "message"), [
    ('name = "m"\n', "text:1: format is missing; this version reads format = 1"),
    (HEAD + "gravty = 1", "text:3: gravty is no entry of a data file; did you mean gravity?"),
    (HEAD + "gravity = 3", "text:3: gravity is 3; write a list in brackets"),
    (HEAD + "planar = 1", "text:3: planar is 1; write true or false"),
    (HEAD + "duration = inf", "text:3: duration is inf; write a finite number"),
    (HEAD + "[parameters]\nm = nan", "text:4: parameters.m.default is nan; write a finite number"),
    (HEAD + "[parameters]\nt = 1", "text:4: parameters.t is the time"),
    (HEAD + "[parameters]\nm = 1\n[inputs]\nm = {}", "text:6: inputs.m is declared already"),
    (HEAD + "[parameters]\nm = {defalt = 1}", "text:4: parameters.m.defalt is no entry of a symbol; did you mean default"),
    (HEAD + "[parameters]\nm = {zero = true, positive = true}", "assumptions that contradict each other"),
    (HEAD + "parameters = 3", "text:3: parameters is 3; write a table"),
    (HEAD + "bodies = 3", "text:3: bodies is 3; write an array of tables, [[bodies]]"),
    (HEAD + "bodies = [3]", "text:3: bodies[0] is 3; write a table"),
    (HEAD + "[[bodies]]\nmass = 1", "text:3: bodies[0] has no name, which body needs"),
    (HEAD + "[[bodies]]\nname = 1", "text:4: bodies[0].name is 1; write a text"),
    (HEAD + '[[bodies]]\nname = "b"\ncom = [1,\n 2]', "text:3: bodies[0] has a fault: body 'b': com has 2 components"),
    (HEAD + '[[bodies]]\nname = "b"\nmass = -1', "text:3: "),
    (HEAD + JOINT, "text:7: joints[0].child is 'b'; there is no such body in the file; there are ground"),
    (HEAD + JOINT.replace("Revolute", "Revolut"), "text:4: joints[0].type has the type 'Revolut'; did you mean Revolute?"),
    (HEAD + JOINT + 'axis = [0, 0, 0]' + BODY, "text:3: joint 'j': axis [0, 0, 0] has length 0"),
    (HEAD + JOINT + 'speed = "w"' + BODY, "text:8: joints[0].speed is 'w'; write the name of a declared symbol"),
    (HEAD + BALL + 'orientation = {type = "EulerAngles", sequence = "ZZZ"}' + BODY,
     "text:8: joints[0].orientation there is no Euler sequence"),
    (HEAD + BALL + 'orientation = 3' + BODY, "write {type ="),
    (HEAD + BALL + 'orientation = {type = "Tait"}' + BODY, "take the type EulerAngles or"),
    (HEAD + JOINT.replace("Revolute", "Modal") + 'beam = {m = 1}' + BODY, "joints[0].beam has the entries m; a beam has"),
    (HEAD + "[ground_motion]\npositon = [0, 0]", "text:4: ground_motion.positon is no entry of ground_motion"),
    (HEAD + '[ground_motion]\nsequence = "AB"', "there is no Euler sequence"),
    (HEAD + '[[outputs]]\nname = "o"', "text:3: outputs[0] has no value; give one of value, values, quantity"),
    (HEAD + '[[outputs]]\nname = "o"\nquantity = "place"', "text:5: outputs[0].quantity is 'place'"),
    (HEAD + '[[outputs]]\nnam = "o"', "text:4: outputs[0].nam is no entry of outputs; did you mean name?"),
    (HEAD + "outputs = [1]", "text:3: outputs[0] is 1; write a table"),
    (HEAD + '[[events]]\nname = "e"\nvalue = 1\nreset = 2', "text:6: events[0].reset is 2; write a table"),
    (HEAD + '[[events]]\nname = "e"\nvalue = 1\ndirection = "up"', "text:6: events[0].direction is 'up'; write a whole number"),
    (HEAD + '[[shapes]]\nbody = "ground"\nkind = "bx"', "text:5: shapes[0].kind is 'bx'; did you mean box?"),
    (HEAD + '[[shapes]]\nbody = "ground"\nkind = "box"\nlength = 1',
     "text:6: shapes[0].length is no entry of a shape of the kind box"),
    (HEAD + "a = ", "the text is not TOML: "),
])
def test_faults_have_lines(text: str, message: str) -> None:
    with pytest.raises(sd.ModelError) as found:
        sd.read_system(text)
    assert message in str(found.value)


def test_all_faults_come_at_once() -> None:
    with pytest.raises(sd.ModelError) as found:
        sd.read_system(HEAD + '[[bodies]]\nname = "b"\nmass = "maas"\ncolour = 1\n' + JOINT + "parent_point = 3\n")
    assert [fault.split(": ")[0] for fault in found.value.faults] == ["text:6", "text:5", "text:12"]


def test_what_has_no_words() -> None:
    system = sd.systems.pendulum()
    text = "static int square(const double *in, double *out) { out[0] = in[0]*in[0]; return 0; }"
    system.add_torque("bob", sd.External("square", ["x"], c=text)(sd.t))
    with pytest.raises(sd.ModelError, match="torque_1: torque calls square, a function of the user, which is a program"):
        system.to_toml()
    with pytest.raises(sd.ArgumentError, match=r"to_toml: path is 'a\.txt'; pass the path of a file that ends in \.toml"):
        system.to_toml("a.txt")
    with pytest.raises(sd.ArgumentError, match="read_system was given 3; pass the path of a TOML file, or its text"):
        sd.read_system(3)  # type: ignore[arg-type]
    with pytest.raises(sd.ModelError, match=r"nowhere\.toml cannot be read: No such file"):
        sd.read_system("nowhere.toml")
    with pytest.raises(sd.ModelError, match="cannot be written"):
        sd.systems.pendulum().to_toml("/nowhere/at/all.toml")
    twice = sd.systems.pendulum()
    twice.add_output("other", sp.Symbol("m", positive=True))
    with pytest.raises(sd.ModelError):
        twice.to_toml()
    bent = sd.systems.pendulum()
    bent.add_output("series", sp.besselj(0, sp.Symbol("g")))
    with pytest.raises(sd.ModelError, match=r"has no words in a data file|no counterpart"):
        bent.to_toml()


def test_the_schema_holds_for_every_mechanism_and_finds_faults() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    import tomllib

    schema = sd.data_file_schema()
    checker = jsonschema.Draft7Validator(schema)
    checker.check_schema(schema)
    for name in ("four_bar", "bicycle", "floating_crane", "land_wind_turbine", "stewart_platform"):
        content = tomllib.loads(sd.systems.get(name).to_toml())
        assert not list(checker.iter_errors(content)), name
    assert not list(checker.iter_errors(tomllib.loads(everything().to_toml())))
    content["bodies"][0]["mas"] = 1
    assert list(checker.iter_errors(content))


def test_commands_take_data_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "arm.toml"
    sd.systems.pendulum().to_toml(path)
    assert main(["derive", str(path)]) == 0 and "M_tilde" in capsys.readouterr().out
    assert main(["derive", str(path), "--option", "n=3"]) != 0
    assert "a data file, which takes no --option" in capsys.readouterr().err
    path.write_text("format = 2\nname = 'x'\n")
    assert main(["derive", str(path)]) == 2 and f"{path}:1: format is 2" in capsys.readouterr().err
    assert main(["schema"]) == 0 and json.loads(capsys.readouterr().out) == json.loads(json.dumps(sd.data_file_schema()))


def test_nothing_in_a_file_is_run(tmp_path: Path) -> None:
    marker = tmp_path / "ran"
    text = HEAD + f"""gravity = ["__import__('pathlib').Path('{marker}').touch()", 0, 0]\n"""
    with pytest.raises(sd.ModelError):
        sd.read_system(text)
    assert not marker.exists() and not {"eval", "exec", "open", "S", "sympify", "lambdify"} & set(FUNCTIONS)


def test_lines_of_texts_with_brackets_and_several_lines() -> None:
    text = 'a = """\n[x]\nb = 1\n"""\nc = [\n "]", # ]\n 1,\n]\n[[d]]\n"e f" = 1\n[g.h]\ni.j = 2\n'
    assert lines_of(text) == {("a",): 1, ("c",): 5, ("d", 0): 9, ("d", 0, "e f"): 10, ("g", "h"): 11, ("g", "h", "i", "j"): 12}


def test_another_process_reads_the_same(tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    text = sd.systems.slider_crank().to_toml(path)
    script = tmp_path / "there.py"
    script.write_text("import symdyn, sys; sys.stdout.write(symdyn.read_system('p.toml').to_toml())", encoding="utf-8")
    run = run_program(script)
    assert run.returncode == 0, run.stderr
    assert run.stdout == text


@pytest.mark.parametrize(("text", "message"), [
    ("exp(exp(exp(exp(1000))))", "a constant of the equations is beyond the range of double precision"),
    ("exp(1000)*x", "a constant of the equations is beyond the range of double precision"),
    ("asin(2)*x", "a constant of the equations is the complex number")])
def test_constants_that_are_no_doubles(text: str, message: str) -> None:
    """They are read, and rejected where numbers are made of them, not taken as infinite."""
    system = sd.systems.pendulum()
    written = system.to_toml().replace("[[bodies]]", "[inputs]\nx = {}\n\n[[bodies]]", 1)
    model = sd.read_system(written + f'\n[[outputs]]\nname = "large"\nvalue = "{text}"\n')
    with pytest.raises(UnsupportedExpression, match=message):
        model.embedding().compile("numpy").outputs(0.0, [0.1, 0.0])
