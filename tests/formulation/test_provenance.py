"""Contributions to M_tilde and k_tilde: they sum up to the entries, and each is what its name says."""

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.model.symbols import symbols_of
from tests.helpers import swept

rng = np.random.default_rng(5)


def difference(a, b):
    """Largest difference of two expressions at random values of their symbols, relative."""
    symbols = sorted(symbols_of(a) | symbols_of(b), key=str)
    f = sp.lambdify(symbols, [a, b], "math")
    worst = 0.0
    for _ in range(3):
        x, y = f(*rng.uniform(0.3, 1.2, len(symbols)))
        worst = max(worst, abs(x - y) / (1 + abs(x)))
    return worst


def free_body():
    system = sd.System("top", gravity=[0, 0, -sp.Symbol("g")])
    body = system.add_body("top", mass=sp.Symbol("m"), inertia=sp.symbols("A B C"), com=[0, 0, sp.Symbol("h")])
    system.add_joint(sd.Spherical("tip", parent=system.ground, child=body, orientation=sd.EulerAngles("ZXZ"),
                                  coordinates=sd.coordinates("psi theta phi")))
    return system


def driven():
    """A pendulum whose support moves as a given function of time."""
    q, a, w = sd.coordinates("q"), *sd.parameters("a w")
    system = sd.System("driven", gravity=[0, -sp.Symbol("g"), 0])
    slider = system.add_body("slider", mass=sp.Symbol("M"))
    bob = system.add_body("bob", mass=sp.Symbol("m"), inertia=[0, 0, sp.Symbol("I")], com=[0, -sp.Symbol("l"), 0])
    system.add_joint(sd.Prismatic("guide", parent=system.ground, child=slider, axis=[1, 0, 0], coordinate=a * sp.sin(w * sd.t)))
    system.add_joint(sd.Revolute("pin", parent=slider, child=bob, axis=[0, 0, 1], coordinate=q))
    return system


EQUATIONS = {
    "two_link_arm": lambda: sd.systems.two_link_arm().embedding(),
    "three_link_arm": lambda: sd.systems.three_link_arm().embedding(),
    "recursive": lambda: sd.systems.two_link_arm().recursive(),
    "four_bar": lambda: sd.systems.four_bar().augmented(),
    "absolute": lambda: sd.systems.get("pendulum").augmented(coordinates="absolute"),
    "top": lambda: free_body().embedding(),
    "driven": lambda: driven().embedding(),
    "position_map": lambda: by_hand(),
}


def by_hand():
    q1, q2, m, v = *sd.coordinates("q1 q2"), *sd.parameters("m v")
    return sd.embedding([q1, q2], [q1 * sp.cos(q2 + v * sd.t), q1 * sp.sin(q2 + v * sd.t)], [m, m])


@pytest.mark.parametrize("name", swept(EQUATIONS, "two_link_arm", "recursive", "four_bar", "absolute", "driven", "position_map"))
def test_contributions_sum_up_to_the_entries(name):
    eq = EQUATIONS[name]()
    M, k = eq.explicit("M_tilde", simplify=False), eq.explicit("k_tilde", simplify=False)
    n = len(eq.symbols.speeds)
    for i in range(n):
        assert difference(eq.explain("k_tilde", i, simplify=False).total, k[i]) < 1e-12
        for j in range(i + 1):
            assert difference(eq.explain("M_tilde", i, j, simplify=False).total, M[i, j]) < 1e-12


def test_names_of_the_parts_of_a_planar_arm():
    eq = sd.systems.two_link_arm().embedding()
    l1, lc2, m2 = (next(p for p in eq.symbols.parameters if p.name == name) for name in ("l1", "lc2", "m2"))
    q1, q2 = eq.symbols.coordinates
    first = eq.explain("k_tilde", 0)
    assert sp.simplify(first.of(kind="Coriolis") + 2 * m2 * l1 * lc2 * sp.sin(q2) * q1.dot * q2.dot) == 0
    assert sp.simplify(first.of(kind="centrifugal") + m2 * l1 * lc2 * sp.sin(q2) * q2.dot**2) == 0
    assert first.of(kind="gyroscopic") == 0 and first.of(body="link1") == 0
    entry = eq.explain("M_tilde", 1, 1)
    assert {(c.body, c.motion) for c in entry.contributions} == {("link2", "translational"), ("link2", "rotational")}


def test_kinds_depend_on_the_speeds_as_their_names_say():
    eq = EQUATIONS["top"]()
    u = eq.symbols.speeds
    kinds = set()
    for i in range(3):
        for part in eq.explain("k_tilde", i, simplify=False).contributions:
            kinds.add(part.kind)
            for a in u:
                pure = part.value.subs({b: 0 for b in u if b != a})
                if part.kind == "Coriolis":
                    assert sp.simplify(pure) == 0
                elif part.kind == "centrifugal":
                    for b in u:
                        assert b == a or sp.simplify(sp.diff(part.value, a, b)) == 0
    assert kinds == {"centrifugal", "Coriolis", "gyroscopic"}


def test_a_fast_symmetric_top_is_turned_by_its_gyroscopic_moment():
    """About the line of nodes: (C - A) psi_dot^2 sin cos + C psi_dot phi_dot sin of a top with A = B; the rest is of its mass."""
    eq = EQUATIONS["top"]()
    A, B, C = sp.symbols("A B C")
    psi, theta, phi = eq.symbols.coordinates
    rotational = eq.explain("k_tilde", 1, simplify=False).of(motion="rotational").subs(B, A)
    expected = (C - A) * psi.dot**2 * sp.sin(theta) * sp.cos(theta) + C * psi.dot * phi.dot * sp.sin(theta)
    assert difference(rotational, expected) < 1e-12


def test_given_motions_have_a_part_of_their_own():
    given = EQUATIONS["driven"]().explain("k_tilde", 0).of(kind="given motion")
    m, l, a, w, q = *sd.parameters("m l a w"), sd.coordinates("q")
    assert difference(given, -m * l * a * w**2 * sp.sin(w * sd.t) * sp.cos(q)) < 1e-12


def test_text_and_latex_name_bodies_and_kinds():
    explanation = sd.systems.two_link_arm().embedding().explain("k_tilde", 0)
    assert "link2  translational Coriolis" in str(explanation) and "k_tilde[0] is the sum of" in repr(explanation)
    assert r"\tilde{k}_{1} = \underbrace{" in explanation._repr_latex_()
    assert "nothing contributes" in str(sd.systems.get("pendulum").embedding().explain("k_tilde", 0))


@pytest.mark.parametrize("arguments, message", [
    (("F_tilde", 0), "explain takes M_tilde .* found 'F_tilde'"),
    (("M_tilde", 0), "M_tilde of two_link_arm takes a row and a column from 0 to 1, found 0"),
    (("M_tilde", 0, 2), "from 0 to 1, found 0, 2"),
    (("k_tilde", -1), "takes a row from 0 to 1, found -1"),
    (("k_tilde", "q1"), "found 'q1'"),
])
def test_what_cannot_be_explained(arguments, message):
    with pytest.raises(sd.SymdynError, match=message):
        sd.systems.two_link_arm().embedding().explain(*arguments)


def test_coordinates_without_bodies():
    x, y, m = *sd.coordinates("x y"), sp.Symbol("m")
    eq = sd.augmented([x, y], [m, m], [0, -m], [x**2 + y**2 - 1])
    with pytest.raises(sd.SymdynError, match="no bodies contribute"):
        eq.explain("M_tilde", 0, 0)
