"""Expressions that exact algebra writes have the value of those given, read back as the same, and are never longer."""

import gc
import weakref
from itertools import product

import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, SymdynError
from symdyn.exact import shortest as shortest_module
from symdyn.exact.ring import TooLarge
from symdyn.exact.shortest import FORMS, WrittenAngles, shortest, written
from symdyn.exact.taken import recorded
from symdyn.exact.walk import Exact
from symdyn.lab import exact_expressions
from symdyn.model.symbols import symbols_of
from tests.helpers import swept

a, b, c = exact_expressions.a, exact_expressions.b, exact_expressions.c
q1, q2 = exact_expressions.q1, exact_expressions.q2
# Operations of today's reference and of a polynomial or Fourier form, by quantity: never exceeded.
MOST = {("four_bar", "M_tilde"): 162, ("four_bar", "k_tilde"): 76, ("four_bar", "F_tilde"): 46,
        ("n_link_pendulum", "M_tilde"): 1244, ("n_link_pendulum", "k_tilde"): 535, ("n_link_pendulum", "F_tilde"): 161,
        ("three_link_arm", "M_tilde"): 79, ("three_link_arm", "k_tilde"): 143, ("puma560", "M_tilde"): 1998,
        ("puma560", "k_tilde"): 3951, ("puma560", "F_tilde"): 148,
        ("flyball_governor", "F_tilde"): 246, ("car_axis", "F_tilde"): 86, ("car_axis", "F_d"): 75,
        ("vehicle_on_rotating_track_absolute", "F_d"): 10,
        # Long entries are shortest gathered by speeds and angles.
        ("bricard", "k_tilde"): 3224, ("double_wishbone", "k_tilde"): 1992, ("andrews_squeezer", "T"): 88}

SHORT = [of for of in MOST if of[0] not in ("puma560", "bricard", "double_wishbone")]


@pytest.mark.parametrize("seed", swept(range(120), *range(25)))
def test_value_is_kept_and_read_back(seed):
    """Ten thousand: python -m symdyn.lab.exact_expressions."""
    assert exact_expressions.failure(seed) == ""


@pytest.mark.parametrize(("wrong", "told"), [(lambda e: e + 1, "has the value"),
                                              (lambda e: e + sp.Rational(1, 10**45), "reads as")])
def test_wrong_forms_are_found(wrong, told, monkeypatch, capsys):
    monkeypatch.setattr(exact_expressions, "shortest", wrong)
    monkeypatch.setattr("sys.argv", ["exact_expressions", "--count", "3"])
    assert exact_expressions.main() == 1
    assert told in capsys.readouterr().out


@pytest.mark.parametrize(("name", "quantity"), swept(MOST, *SHORT))
def test_operations_of_the_catalogue(name, quantity):
    system = sd.systems.get(name)
    eq = system.augmented() if name in sd.systems.names(constrained=True) else system.embedding()
    assert sp.count_ops(eq.explicit(quantity)) <= MOST[name, quantity]


@pytest.mark.parametrize(("given", "wanted"), [
    (a * (1 - sp.cos(2 * q1)) / 2, a * sp.sin(q1) ** 2),
    (a * (1 + sp.cos(2 * q1 + 2 * q2)) / 2 + b, a * sp.cos(q1 + q2) ** 2 + b),
    (a * (1 + sp.cos(q1)), a * sp.cos(q1) + a),
    (sp.sin(q1 / 2) * sp.cos(q1 / 2), sp.sin(q1) / 2),
    (2 * a * b * sp.sin(q1) * sp.cos(q1), a * b * sp.sin(2 * q1)),
])
def test_half_and_double_angles_where_they_are_shorter(given, wanted):
    assert shortest(given) == wanted


def test_minus_signs_go_into_denominators():
    assert [str(shortest(e)) for e in (1 / (a - b), 1 / (b - a), -c / (b - a), a / (a - b) ** 2)] == [
        "1/(a - b)", "1/(-a + b)", "c/(a - b)", "a/(a - b)**2"]


@pytest.fixture(scope="module")
def four_bar():
    """Its equations, whose shortest forms are kept from test to test."""
    return sd.systems.get("four_bar").augmented()


@pytest.mark.parametrize("form", FORMS)
def test_every_form_is_the_same_and_none_is_shorter(form, four_bar):
    eq = four_bar
    for quantity in ("M_tilde", "k_tilde", "T", "momenta"):
        found, best = eq.explicit(quantity, form=form), eq.explicit(quantity)
        derived = eq.explicit(quantity, simplify=False)
        assert sd.prove(found, derived)
        assert sp.count_ops(best) <= sp.count_ops(found)


@pytest.mark.parametrize(("name", "formulation", "quantities"), [
    ("flyball_governor", "embedding", ("M_tilde", "k_tilde", "V")),
    # The divisor of the multiplier is a sum of products or of turns, of which the second takes up the sign.
    ("slider_crank", "augmented", ("M_tilde", "k_tilde", "C", "C_r", "F_d", "lam", "inverse_dynamics")),
    *swept([("three_link_arm", "embedding", ("M_tilde", "k_tilde", "F_tilde", "J", "energy")),
            ("car_axis", "augmented", ("M_tilde", "F_tilde", "C", "C_r", "F_d")),
            ("andrews_squeezer", "augmented", ("M_tilde", "k_tilde"))])])
def test_no_form_of_cheap_mechanisms_is_shorter(name, formulation, quantities):
    """The whole catalogue: symdyn bench printing."""
    eq = getattr(sd.systems.get(name), formulation)()
    for quantity in quantities:
        counts = {form: sp.count_ops(eq.explicit(quantity, form=form)) for form in FORMS}
        assert counts["shortest"] == min(counts.values()), (quantity, counts)


def test_textbook_form_of_a_planar_chain():
    q1_dot, q2_dot = q1.dot, q2.dot
    products = -a * (2 * q1_dot * q2_dot + q2_dot**2) * (sp.cos(q1) * sp.sin(q1 + q2) - sp.sin(q1) * sp.cos(q1 + q2))
    assert shortest(products) == -a * q2_dot * (2 * q1_dot + q2_dot) * sp.sin(q2)
    assert shortest(products, "fourier") == shortest(products)


@pytest.mark.parametrize(("given", "wanted"), [
    ((a - b) ** 2 + (b - c) ** 2 - a * c, (a - b) ** 2 + (b - c) ** 2 - a * c),
    (a**2 - 2 * a * b + b**2 - c * q1, -c * q1 + (a - b) ** 2),
    (a * sp.cos(q1) ** 2 + b * sp.sin(q1) ** 2 + (a - b) * sp.sin(q1) ** 2, a),
    (sp.sqrt(a + b) ** 3 / (a + b), sp.sqrt(a + b)),
    (sp.sin(q1) / sp.cos(q1), sp.tan(q1)),
    (a * c / (b * c + c**2) + b / (b + c) - (a + b) / (b + c) + a / b, a / b),
    (-((a - b) ** 2) * (b - c) ** 2 * (a - c) ** 2, -((a - b) ** 2) * (a - c) ** 2 * (b - c) ** 2),
    (0.1 * a * b + 0.1 * a * c, 0.1 * a * (b + c)),
    (sp.Piecewise((a**2 - a * a + b, a > b), (c, True)), sp.Piecewise((b, a > b), (c, True))),
    (sp.cos(q1 + sp.pi / 2), -sp.sin(q1)),
    (-c / (b * sp.cos(q1) ** 2 - a - b), c / (a + b * sp.sin(q1) ** 2)),
    (c / (a + b * sp.sin(q1) ** 2) ** 2, c / (a + b * sp.sin(q1) ** 2) ** 2),
    (sp.Integer(0), sp.Integer(0)),
])
def test_relations(given, wanted):
    assert shortest(given) == wanted


def test_symbols_are_those_of_the_user():
    eq = sd.systems.two_link_arm().embedding()
    free = symbols_of(eq.k_tilde)
    s = eq.symbols
    assert free <= {*s.coordinates, *s.speeds, *s.parameters}
    assert eq.M_tilde.subs(s.coordinates[1], 0).free_symbols <= set(s.parameters)


def test_the_same_in_every_order():
    """Nothing depends on which entries are asked for with it."""
    terms = [a * sp.sin(q1 + q2) + b * sp.sin(q1 + q2), c * (a + b) * sp.cos(q1)]
    assert [shortest(sp.Matrix(terms))[0], shortest(sp.Matrix(terms))[1]] == [shortest(e) for e in terms]


def test_bound_is_reported_before_memory_is_taken():
    entries, symbols = recorded([(a + b + c) ** 9 * (a - b + q1) ** 9])
    with pytest.raises(TooLarge, match="a product has up to 225 terms, above the bound of 200"):
        written(entries, symbols, bound=200)


@pytest.mark.parametrize("number", ["1e400", "1e-400", "-3e-330"])
def test_fractions_beyond_the_range_of_floats_are_kept(number):
    e = sp.Rational(number) * q1 + sp.cos(q1)
    assert shortest(e) == e and sd.prove(shortest(e), e)


def test_unknown_form():
    eq = sd.systems.pendulum().embedding()
    for other in ({"intermediates": True}, {"simplify": False}):
        with pytest.raises(ArgumentError, match=f"'fourier' of M_tilde was asked for, together with {next(iter(other))}="):
            eq.explicit("M_tilde", form="fourier", **other)
    with pytest.raises(SymdynError, match="the form 'shorter' was asked for; there are shortest, polynomial, fourier"):
        eq.explicit("M_tilde", form="shorter")


def test_a_form_that_is_too_large_names_the_alternatives(monkeypatch):
    def too_large(*_: object) -> None:
        raise TooLarge("a product has up to 9 terms, above the bound of 8")

    monkeypatch.setattr("symdyn.exact.shortest.explicit", too_large)
    eq = sd.systems.pendulum().embedding()
    with pytest.raises(SymdynError, match="M_tilde is too large for the form 'fourier': a product has up to 9 terms"):
        eq.explicit("M_tilde", form="fourier")
    assert sd.prove(eq.explicit("M_tilde"), eq.explicit("M_tilde", simplify=False))


@pytest.mark.parametrize("text", ["a + b", "__import__('os').getcwd()"])
def test_text_is_never_evaluated(text):
    with pytest.raises(sd.ArgumentError, match="exact algebra takes numbers and expressions of SymPy symbols, found"):
        shortest(text)


def test_values_are_bounded_together(monkeypatch):
    """Sums of many terms, each formed by short products, take memory too."""
    monkeypatch.setattr("symdyn.exact.ring.KEPT", 50)
    with pytest.raises(TooLarge, match="values have more than 50 terms together"):
        shortest(sp.Add(*[a**k * b**(20 - k) for k in range(20)]))


def test_springs_along_an_axis_have_absolute_values_in_place_of_roots_of_squares():
    x = sd.coordinates("x")
    m, k, d, rest = sd.parameters("m k d L", positive=True)
    system = sd.System("spring")
    body = system.add_body("body", mass=m)
    system.add_joint(sd.Prismatic("rail", system.ground, body, axis=[1, 0, 0], coordinate=x))
    system.add_spring_damper(system.ground, body, point_a=[-d, 0, 0], stiffness=k, length=rest)
    eq = system.embedding()
    assert str(eq.V) == "k*(L - Abs(d + x))**2/2" and not any(e.exp == sp.Rational(1, 2) for e in eq.F_tilde.atoms(sp.Pow))
    for value in (sp.Rational(7, 3), sp.Rational(-19, 3)):  # on both sides of the point
        numbers = {x: value, k: sp.Rational(5, 2), d: sp.Rational(1, 3), rest: sp.Rational(4, 3)}
        assert eq.V.subs(numbers) == sp.Rational(5, 4) * (sp.Rational(4, 3) - abs(value + sp.Rational(1, 3))) ** 2
        force = -sp.Rational(5, 2) * (abs(value + sp.Rational(1, 3)) - sp.Rational(4, 3)) * sp.sign(value + sp.Rational(1, 3))
        assert eq.F_tilde[0].subs(numbers) == force


@pytest.mark.parametrize("formulation", ["recursive", "embedding"])
def test_squares_of_euler_parameters_add_up_to_one(formulation):
    """The weight of a body that is free, and its equations at a random orientation, to 50 digits."""
    m, g, l, I1, I2, I3 = sd.parameters("m g l I1 I2 I3", positive=True)
    system = sd.System("ball", gravity=[0, 0, -g])
    body = system.add_body("body", mass=m, inertia=[I1, I2, I3])
    system.add_joint(sd.Free("joint", system.ground, body, orientation=sd.EulerParameters()))
    eq = getattr(system, formulation)()
    assert list(eq.F_tilde) == [0, 0, -g * m, 0, 0, 0]
    assert sp.diag(m, m, m, I1, I2, I3) == eq.M_tilde
    system = sd.System("top", gravity=[0, 0, -g])
    body = system.add_body("body", mass=m, inertia=[I1, I2, I3], com=[0, 0, l])
    system.add_joint(sd.Free("joint", system.ground, body, orientation=sd.EulerParameters()))
    eq = getattr(system, formulation)()
    q, u = eq.symbols.coordinates, eq.symbols.speeds
    unit = [sp.Rational(n, 15) for n in (2, -4, 6, 13)]
    assert sum(e**2 for e in unit) == 1
    values = {**dict(zip(q, [*sp.Matrix([1, 2, 3]) / 7, *unit], strict=True)),
              **{w: sp.Rational(2 * k - 5, 9) for k, w in enumerate(u)},
              **{p: sp.Rational(k + 3, 7) for k, p in enumerate((m, g, l, I1, I2, I3))}}
    for name in ("M_tilde", "k_tilde", "F_tilde", "T", "V"):
        short, derived = (sp.Matrix([eq.explicit(name, simplify=way)]) for way in (True, False))
        assert all(e == 0 for e in (short - derived).subs(values))
        assert sp.count_ops(short) <= sp.count_ops(derived)


def test_the_opposite_of_an_angle_is_written_as_sympy_has_it():
    """SymPy turns arguments of sines itself; letters whose sign it changes would be counted wrongly."""
    angles = {q: sp.sin(q) for q in (*sd.coordinates("phi theta psi q10 q2 Q"), *sd.parameters("w a"), sd.t)}
    entries, symbols = recorded(list(angles.values()))
    exact = Exact(entries)
    written_angles = WrittenAngles(exact, symbols)
    rows = [vector for vector in product((-2, -1, 0, 1), repeat=len(exact.bases)) if 1 < sum(map(bool, vector)) < 4]
    assert len(rows) > 2000
    for vector in rows[::7]:
        angle = written_angles.expression(vector)
        assert written_angles.opposite(vector) == angle.could_extract_minus_sign(), angle


@pytest.mark.parametrize(("given", "wanted"), [
    (a**2 * b + a**3 * c + b, "a**2*(a*c + b) + b"),
    (b / sp.sqrt(a) + c / sp.sqrt(a) ** 3, "(b + c/a)/sqrt(a)"),
    (a * b + a * c + b * c, "a*(b + c) + b*c"),
    (sp.exp(a) * b + sp.exp(a) * c, "(b + c)*exp(a)"),
    (sp.sin(a * b + a * c), "sin(a*(b + c))"),
])
def test_what_stands_in_several_terms_is_taken_out(given, wanted):
    assert str(shortest_module._taken_out(given)) == wanted


@pytest.mark.parametrize(("given", "wanted"), [
    (2 * a - 2 * b, "2*(a - b)"), (-a - b, "-(a + b)"), (-2 * a - 4 * b, "-2*(a + 2*b)"), (a / 2 + b / 2, "(a + b)/2"),
    (a - b, "a - b"), (-0.5 * a - b, "-0.5*a - b"), (a * b, "a*b")])
def test_the_number_common_to_all_terms_is_taken_out(given, wanted):
    assert str(shortest_module._number_out(given)) == wanted


def test_nothing_is_left_to_the_collector():
    """The memory that a quantity took is large: a search for it takes longer than to write many a quantity."""
    made = []
    entries, symbols = recorded([a * sp.sin(q1 + q2) + b])
    gc.disable()
    try:
        writer = shortest_module.Writer(Exact(entries), symbols)
        made.append(weakref.ref(writer))
        writer.write(writer.exact.values[0])
        del writer
        assert made[0]() is None
    finally:
        gc.enable()
