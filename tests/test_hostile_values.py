"""Values that are no real number, no name and no flag, and those that no memory holds, are errors of symdyn wherever they come
in."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.cli import main
from symdyn.errors import ArgumentError, ModelError, SymdynError
from symdyn.lab import hostile
from symdyn.lab.hostile_calls import Call
from symdyn.lab.hostile_values import Value
from symdyn.real_numbers import NotReal, number, real
from symdyn.runtime import memory
from symdyn.shown import name_of, shown

X = [0.1, 0.2, 0.0, 0.1]
UNREAL: list[tuple[Any, str]] = [
    (np.array([0.1 + 1j, 0.2, 0.0, 0.1]), r"complex; pass the real part"),
    (np.array([0.1 + 0j, 0.2, 0.0, 0.1]), r"complex; pass the real part"),
    ([0.1 + 1j, 0.2, 0.0, 0.1], r"complex; pass the real part"),
    (np.ma.array(X, mask=[0, 1, 0, 0]), r"a masked array, whose hidden entries would count; pass \.filled"),
    ([np.ma.masked, 0.2, 0.0, 0.1], r"a masked array"),
    (["0.1", "0.2", "0.0", "0.1"], "text, which is not read as numbers"),
    (np.array(["0.1", "0.2", "0.0", "0.1"]), "text, which is not read as numbers"),
    ([10**400, 0.2, 0.0, 0.1], r"too large|beyond the range of double precision"),
    (np.array([10**400, 0.2, 0.0, 0.1], dtype=object), r"beyond the range of double precision, 1\.8e308"),
    (np.array([None, 0.2, 0.0, 0.1]), "not all numbers"),
    (np.array(["2020-01-01"] * 4, dtype="M8[D]"), "not numbers"),
    ([[0.1, 0.2], [0.1]], "no array of numbers"),
    (np.array([True, False, False, True]), "True and False are no numbers; pass 1.0 and 0.0 if these are meant"),
    ([0.1, True, 0.0, 0.1], "True and False are no numbers"),
    ([0.1, 0.2, np.False_, 0.1], "True and False are no numbers"),
    (np.array([0.1, True, 0.0, 0.1], dtype=object), "True and False are no numbers"),
    ([0.1, 0.2, 0.0, sp.true], "True and False are no numbers"),
]


@pytest.mark.parametrize("value, message", UNREAL, ids=range(len(UNREAL)))
def test_arrays_that_hold_no_real_numbers(value: Any, message: str) -> None:
    with warnings.catch_warnings(), pytest.raises(NotReal, match=message):
        warnings.simplefilter("error")
        real(value)


def test_real_numbers_keep_their_values() -> None:
    array = np.arange(4.0)
    assert real(array) is array and real(array[::2]).tolist() == [0, 2]
    for given in (range(3), [0, 1, 2], np.array([0, 1, 2], dtype=">i2"), [np.float32(0), sp.Integer(1), True + 1],
                  np.array([0, sp.Integer(1), 2], dtype=object)):
        found = real(given)
        assert found.dtype == np.dtype(float) and found.tolist() == [0, 1, 2]
    assert number(np.array(2)) == number(sp.Rational(2)) == number(2) == 2.0 and np.isnan(number(np.nan))
    with pytest.raises(NotReal, match=r"an array of the shape \(1,\), where one number belongs"):
        number([1.0])


@pytest.fixture(params=["numpy", "c"])
def cart(request: pytest.FixtureRequest, compiled: Callable[..., Any]) -> Any:
    return compiled("cart_pole", request.param)


DOORS: dict[str, Callable[[Any, Any], Any]] = {
    "rhs": lambda m, v: m.rhs(0.0, v, None, [1.0]),
    "bound": lambda m, v: m.bind().rhs(0.0, v, [1.0]),
    "bound jacobian": lambda m, v: m.bind().jacobian_x(0.0, v, [1.0]),
    "rhs_batch": lambda m, v: m.rhs_batch(0.0, v, None, [[1.0]]),
    "evaluate": lambda m, v: m.evaluate("k_tilde", 0.0, v),
    "energy": lambda m, v: m.energy(v[:2], X[2:]),
    "jacobian": lambda m, v: m.jacobian(0.0, v, None, [1.0], ("x",)),
    "simulate": lambda m, v: m.simulate((0.0, 0.1), q=v[:2]),
    "simulate_batch": lambda m, v: m.simulate_batch(q=[v[:2], v[:2]], t=(0.0, 0.1)),
    "linearize": lambda m, v: m.linearize(v),
    "stability": lambda m, v: m.stability(v),
    "equilibrium": lambda m, v: m.equilibrium(start=v),
    "times": lambda m, v: m.simulate(v),
    "table": lambda m, v: m.simulate((0.0, 0.1), inputs={"F": ([0.0, 1.0, 2.0, 3.0], v)}),
    "times of a table": lambda m, v: m.simulate((0.0, 0.1), inputs={"F": (v, [0.0, 1.0, 2.0, 3.0])}),
    "table of all": lambda m, v: m.simulate((0.0, 0.1), inputs=(v, [[0.0], [1.0], [2.0], [3.0]])),
    "function": lambda m, v: m.simulate((0.0, 0.1), inputs={"F": lambda t, x: v[0]}),
    "ensemble": lambda m, v: sd.ensemble(m, {"q1": v}, (0.0, 0.1)),
    "samples": lambda m, v: sd.Samples({"q1": v}),
}


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.parametrize("k", [0, 3, 5, 8])
def test_no_call_takes_them_for_numbers(cart: Any, door: str, k: int) -> None:
    value, _ = UNREAL[k]
    if door == "function" and k == 3:
        value = np.ma.array(X, mask=True)
    with warnings.catch_warnings(), pytest.raises(ArgumentError):
        warnings.simplefilter("error")
        DOORS[door](cart, value)


@pytest.mark.parametrize("value", [1j, np.complex128(1), np.ma.masked, "1.5", 10**400, -10**5000, [1.0], None, sp.I,
                                   True, np.False_, sp.true, np.array(True), np.array("2.0")], ids=shown)
def test_parameters_are_real_numbers(cart: Any, value: Any) -> None:
    name = cart.metadata.parameters[0]
    calls: list[Callable[[], Any]] = [
        lambda: cart.parameters({name: value}), lambda: cart.bind({name: value}), lambda: cart.rhs(0.0, X, {name: value}),
        lambda: cart.rhs_batch(0.0, [X], {name: value}), lambda: cart.simulate((0, 0.1), params={name: value}),
        lambda: cart.equilibrium(params={name: value}), lambda: cart.linearize(X, {name: value})]
    for call in calls:
        if value == [1.0] and call is calls[3]:
            continue  # a value for each row
        with warnings.catch_warnings(), pytest.raises(ArgumentError, match=rf"the values? of {name} .* number"):
            warnings.simplefilter("error")
            call()


def test_times_and_tolerances_are_real_numbers(cart: Any) -> None:
    for t in (1j, "0", np.ma.masked, 10**400, np.nan, [[0.0]], None):
        with pytest.raises(ArgumentError, match="t must be"):
            cart.rhs(t, np.array(X), None, np.array([1.0]))
        with pytest.raises(ArgumentError, match="t must be"):
            cart.bind().rhs(t, np.array(X))
    for options in ({"rtol": 10**400}, {"rtol": "1e-6"}, {"atol": 1j}, {"atol": [1e-6] * 3}, {"max_step": "1"},
                    {"first_step": 10**400},
                    {"max_steps": 10**30}, {"max_steps": 2.0}, {"method": np.array(["dop853"])}, {"method": ["dop853"]},
                    {"method": ""}, {"method": 0}, {"steps": "no"}, {"work": np.array([1])}, {"progress": 1}):
        with pytest.raises(ArgumentError, match=next(iter(options))):
            cart.simulate((0.0, 0.1), **options)


def test_names_and_flags(cart: Any, derived: Callable[..., Any], tmp_path: Any) -> None:
    equations = derived("pendulum")
    calls: list[tuple[Callable[[], Any], str]] = [
        (lambda: cart.evaluate(["rhs"], 0.0, X), r"the name of a function is \['rhs'\]; pass text such as 'mass_matrix'"),
        (lambda: cart.function(3), "the name of a function is 3; pass text"),
        (lambda: cart.jacobian(0.0, X, wrt="x"), r"wrt is 'x'; pass a list"),
        (lambda: cart.write(3), "the path of the folder to write to is 3; pass text or a Path"),
        (lambda: equations.quantity(np.zeros(2)), "the name of a quantity is array"),
        (lambda: equations.explicit("M_tilde", "no"), "simplify is 'no'; pass True or False"),
        (lambda: equations.latex("M_tilde", shorthand=np.zeros(2)), "shorthand is array.*pass True or False"),
        (lambda: equations.latex("M_tilde", width=None), "the width of lines, .* is None; pass a whole number"),
        (lambda: equations.verify(states={}), r"the number of states is \{\}; pass a whole number from 1 to"),
        (lambda: equations.verify(digits=10**9), "digits is 1000000000; pass a whole number from 1 to 10000"),
        (lambda: equations.explain("k_tilde", 0, simplify="no"), "simplify is 'no'; pass True or False"),
        (lambda: equations.explain(["k_tilde"], 0), "explain takes M_tilde"),
        (lambda: equations.compile("numpy", templates=3), "the path of the templates is 3"),
        (lambda: sd.systems.pendulum().embedding(frames=["body"]), r"frames \['body'\] asked for"),
        (lambda: sd.systems.pendulum().augmented(coordinates=np.zeros(2)), "coordinates array.* asked for"),
        (lambda: sd.systems.pendulum().compile("numpy", tune="no"), "tune is 'no'; pass True or False"),
        (lambda: sd.systems.n_link_pendulum(2.5), r"was asked for 2\.5 rods; pass 1 or more, a whole number"),
        (lambda: sd.ensemble(cart, {"q1": [1.0]}, resume="no"), "resume is 'no'; pass True or False"),
        (lambda: sd.read_urdf("a.urdf", damping="no"), "damping is 'no'; pass True or False"),
        (lambda: sd.System("s", planar="no").check(), "planar is 'no'; pass True, False or None"),
    ]
    for call, message in calls:
        with pytest.raises(SymdynError, match=message):
            call()


@pytest.mark.parametrize("name", ["a\0b", "a\udc80b", "a\nb", "", None, 3, ["a"], np.array(["a"])], ids=shown)
def test_names_of_a_model_are_text_that_can_be_printed(name: Any) -> None:
    system = sd.System("s", gravity=[0, -9.81, 0])
    body = system.add_body(name, 1.0, [1, 1, 1])
    system.add_joint(sd.Revolute("pin", system.ground, body, sd.coordinates("q")))
    with pytest.raises(ModelError):
        system.embedding()


@pytest.mark.parametrize("name", [3, np.array(["a", "b"]), ["a"], 10**5000, np.zeros((0, 2))], ids=shown)
def test_names_of_loads_are_text(name: Any) -> None:
    system = sd.System("s", gravity=[0, -9.81, 0])
    body = system.add_body("bob", 1.0, [1, 1, 1])
    system.add_joint(sd.Revolute("pin", system.ground, body, sd.coordinates("q")))
    system.add_force(body, [1, 0, 0], name=name)
    with pytest.raises(ModelError, match=r"force_1: its name is .*; pass text such as 'spring', or leave it out"):
        system.check()


@pytest.mark.parametrize("value", [10**400, -10**400, sp.Integer(10)**400, sp.Float("1e400"), np.complex64(1), np.ma.masked,
                                   1 + 0j], ids=shown)
def test_numbers_of_a_model_are_doubles(value: Any) -> None:
    def mass(system: sd.System) -> Any:
        return system.add_body("bob", value, [1, 1, 1])

    def load(system: sd.System) -> Any:
        body = system.add_body("bob", 1, [1, 1, 1])
        system.add_force(body, [value, 0, 0])
        return body

    def gravity(system: sd.System) -> Any:
        system.gravity = system._faults.vector([0, value, 0], "gravity")
        return system.add_body("bob", 1, [1, 1, 1])

    for make in (mass, load, gravity):
        system = sd.System("s", gravity=[0, -9.81, 0])
        system.add_joint(sd.Revolute("pin", system.ground, make(system), sd.coordinates("q")))
        with pytest.raises(ModelError, match=r"double precision|complex|masked|real"):
            system.check()


@pytest.mark.parametrize("value", [True, np.True_, sp.false], ids=shown)
@pytest.mark.parametrize("where", ["defaults", "initial"])
def test_defaults_and_starts_are_no_truth_values(where: str, value: Any) -> None:
    system, q, m = sd.System("s", gravity=[0, -9.81, 0]), sd.coordinates("q"), sd.parameters("m")
    system.add_joint(sd.Revolute("pin", system.ground, system.add_body("bob", m, [1, 1, 1]), q))
    setattr(system, where, {m if where == "defaults" else q: value})
    with pytest.raises(ModelError, match=rf"{where}.*is .*(True|alse).*; pass a finite number, real and within double"):
        system.check()


@pytest.mark.parametrize("rows", [list, np.array, lambda rows: [list(rows), [0, 1]], lambda rows: [[e, 0] for e in rows]])
def test_text_of_a_mass_matrix_is_not_evaluated(rows: Any, tmp_path: Any) -> None:
    """SymPy makes expressions of text by Python's eval."""
    trace = tmp_path / "executed"
    q = sd.coordinates("q")
    mass = rows([f"open({str(trace)!r}, 'w')", "1"])
    with pytest.raises(ModelError, match=r"mass is the text .*; text is never evaluated"):
        sd.embedding([q], [sp.cos(q), sp.sin(q)], mass)
    with pytest.raises(ModelError, match=r"mass is the text .*; text is never evaluated"):
        sd.augmented(list(sd.coordinates("x y")), mass, [0, 0], [sp.Symbol("x")])
    assert not trace.exists()


def test_constants_that_multiply_beyond_doubles() -> None:
    system = sd.System("s", gravity=[0, -9.81, 0])
    body = system.add_body("bob", 1e300, [1, 1, 1], com=[1e300, 0, 0])
    system.add_joint(sd.Revolute("pin", system.ground, body, sd.coordinates("q")))
    module = system.embedding().compile("numpy")
    assert module.rhs(0.0, np.zeros(2)) == pytest.approx([0.0, -9.81e-300])  # folded exactly
    with pytest.raises(SymdynError, match=r"multiply to more than the range of double precision, 1\.8e308; give them in other"):
        module.mass_matrix([0.0])


# -- requests of impossible size


class Long:
    """As long as one likes, without any memory."""

    def __init__(self, n: int) -> None:
        self.n = n

    def __len__(self) -> int:
        return self.n

    def __array__(self, *arguments: Any, **options: Any) -> Any:
        raise AssertionError("memory was taken before the size was looked at")


def test_impossible_requests_name_the_bytes(compiled: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    module = compiled("pendulum", "numpy")
    monkeypatch.setattr(memory, "available", lambda: 8 * 10**9)
    with pytest.raises(ArgumentError, match=r"500000000 output times and 2 numbers at each would take 20 GB "
                                            r"\(20000000000 bytes\), but 8 GB \(8000000000 bytes\) of memory are available; "
                                            "pass fewer times"):
        module.simulate(Long(500_000_000))
    many = np.broadcast_to(np.array([0.1]), (10**9, 1))
    with pytest.raises(ArgumentError, match=r"1000000000 motions with 1 states of 2 numbers each would take 128 GB"):
        module.simulate_batch(many, t=(0.0, 1.0))
    with pytest.raises(ArgumentError, match=r"1000000000 rows of 2 numbers would take 48 GB"):
        module.rhs_batch(0.0, np.broadcast_to(np.array([0.1, 0.0]), (10**9, 2)))
    with pytest.raises(ArgumentError, match=r"1000000000000 samples of 1 numbers take 8 TB \(8000000000000 bytes\); the most is"):
        sd.Samples({"q1": {"from": 0, "to": 1}}, "random", 10**12)
    with pytest.raises(ArgumentError, match=r"a list of 1000000000000 values would take 16 TB"):
        sd.Samples({"q1": {"from": 0, "to": 1, "count": 10**12}})
    with pytest.raises(ArgumentError, match=r"1000000000000 starts requested; .* at most: their states alone take 16 TB"):
        module.equilibria(10**12)


def test_memory_that_is_available_is_less_than_there_is() -> None:
    assert 2**20 < memory.available() <= 2**40
    memory.demand(2**20, "a pendulum", "a little", "nothing")
    assert memory.in_bytes(999) == "999 bytes" and memory.in_bytes(1_500_000) == "1.5 MB (1500000 bytes)"


# -- files


def test_paths_that_there_cannot_be(derived: Callable[..., Any], compiled: Callable[..., Any], tmp_path: Any) -> None:
    module = compiled("pendulum", "numpy")
    motion = module.simulate((0.0, 0.1))
    (tmp_path / "file").touch()
    for path in ("a\0b.npz", "q" * 300 + ".npz", 3, b"a.npz", "\ud800.npz"):
        for call in (motion.save, module.write, derived("pendulum").write, motion.plot):
            with pytest.raises(ArgumentError, match=r"the path .* is .*; pass text or a Path"):
                call(path)
    for call in (lambda p: motion.save(p / "a.npz"), module.write, derived("pendulum").write):
        with pytest.raises(ArgumentError, match=r"cannot be written: .*; pass another path, or free some space"):
            call(tmp_path / "file" / "folder")


@pytest.mark.parametrize("words", [["generate", "pendulum", "--output", "a\0b"], ["sweep", ""],
                                   ["compare", "--all", "--output", "\0"]])
def test_paths_of_the_command_line(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(words)
    assert stopped.value.code == 2 and "is no path; give that of a file or folder" in capsys.readouterr().err


# -- the command that looks for more


def test_hostile_calls_end_in_errors_of_symdyn(capsys: pytest.CaptureFixture[str]) -> None:
    """Calls that take milliseconds each; thousands of all kinds: python -m symdyn.lab.hostile."""
    kinds = ["Module.rhs (numpy)", "Module.bind.rhs (numpy)", "Module.rhs_batch (numpy)", "Module.parameters", "Samples",
             "symbols", "Solution[]", "Shape"]
    assert hostile.main(["--count", "60", "--seed", "11", "--calls", *kinds]) == 0
    assert capsys.readouterr().out == "60 calls, 0 fail\n"
    assert hostile.draw(7, 11, kinds).what == hostile.draw(7, 11, kinds).what
    with pytest.raises(SystemExit):
        hostile.main(["--calls", "nothing"])
    assert "there is no call nothing; see --list" in capsys.readouterr().err
    assert hostile.main(["--list"]) == 0 and "Module.simulate (numpy): t (numbers), q" in capsys.readouterr().out


@pytest.mark.parametrize("outcome, fault", [
    (lambda: 1 / 0, "traceback"), (lambda: np.array([1.0, np.nan]), "not finite"), (lambda: {"a": [float("inf")]}, "not finite"),
    (lambda: warnings.warn("of another program", UserWarning, stacklevel=1), "warning"), (lambda: "anything", "accepted"),
    (lambda: _raise(ArgumentError("")), "message"), (lambda: _raise(ArgumentError("x" * 50_000)), "message"),
    (lambda: _raise(ArgumentError("a reason")), "")])
def test_every_kind_of_wrong_outcome_is_found(outcome: Callable[[], Any], fault: str) -> None:
    value = Value("1j", lambda: 1j, frozenset({"complex"} if fault == "accepted" else {"none"}))
    call = Call("a call", lambda given: outcome(), {"x": "number"}, lambda: {"x": 1.0})
    found = hostile.run(hostile.Case(0, call, "x", value))
    assert found.fault == fault and str(found).startswith("     0  a call, x = 1j: ")


def _raise(error: Exception) -> None:
    raise error


def test_a_process_that_ends_is_replaced(monkeypatch: pytest.MonkeyPatch, tmp_path: Any) -> None:
    worker = hostile.Worker(11, ["Module.parameters"], False, str(tmp_path))
    try:
        worker.process.kill()
        worker.process.join()
        assert worker.do(0).fault == "crash" and worker.do(0).fault == ""
    finally:
        worker.close()


# -- messages


class Untold:
    def __repr__(self) -> str:
        raise RuntimeError

    @property
    def name(self) -> str:
        raise RuntimeError


def test_values_in_messages_are_short() -> None:
    assert shown("abc") == "'abc'" and shown([1.5]) == "[1.5]" and shown(True) == "True"
    assert shown("a" * 10**6) == "'" + "a" * 120 + "'" and len(shown(list(range(10**5)))) == 124
    assert shown(10**5000) == "a whole number of about 5001 digits"
    assert shown(Untold()) == name_of(Untold()) == "a value of the type Untold"
    assert name_of(sp.Symbol("m")) == name_of("m") == "m" and name_of(3) == "3"
