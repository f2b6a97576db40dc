"""Rotors over speed: whirl of a disc on springs, ground resonance of a three-bladed rotor, against matrices by hand."""

from __future__ import annotations

import functools
import re
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import sympy as sp

import symdyn as sd
from symdyn import systems
from symdyn.errors import ArgumentError, NoEquilibrium
from symdyn.statics.campbell import Campbell
from symdyn.statics.multiblade import Rotor

HALF, ROOT = sp.Rational(1, 2), sp.sqrt(3) / 2
HUB = {"M": 10.0, "J": 1.0, "m": 1.5, "e": 0.3, "r": 1.2, "k_h": 900.0, "k_b": 4.0, "d": 0.0}


@functools.cache
def disc() -> Any:
    """A disc that tilts about x and y on torsion springs and spins about its own axis."""
    a, b, phi = sd.coordinates("a b phi")
    I, Ip, k = sd.parameters("I Ip k", positive=True)
    s = sd.System("disc")
    first, second = s.add_body("first", mass=0), s.add_body("second", mass=0)
    wheel = s.add_body("wheel", mass=1, inertia=[I, I, Ip])
    for joint, q in ((sd.Revolute("about_x", s.ground, first, a, axis=[1, 0, 0]), a),
                     (sd.Revolute("about_y", first, second, b, axis=[0, 1, 0]), b)):
        s.add_joint_force(s.add_joint(joint), -k * q)
    s.add_joint(sd.Revolute("spin", second, wheel, phi, axis=[0, 0, 1]))
    s.defaults = {I: 0.5, Ip: 0.8, k: 50.0}
    return s.embedding().compile(backend="numpy")


@functools.cache
def rotor() -> Any:
    """A hub on springs in x and y, its rotor about z, three blades on lag hinges with springs; gravity along -y."""
    x, y, psi, b1, b2, b3 = sd.coordinates("x y psi b1 b2 b3")
    M, J, m, e, r, k_h, k_b, d, g = sd.parameters("M J m e r k_h k_b d g", positive=True)
    s = sd.System("rotor", gravity=[0, -g, 0])
    frame, hub, wheel = s.add_body("frame", mass=0), s.add_body("hub", mass=M), s.add_body("wheel", mass=0, inertia=[0, 0, J])
    for joint, q in ((sd.Prismatic("sway", s.ground, frame, x, axis=[1, 0, 0]), x),
                     (sd.Prismatic("lift", frame, hub, y, axis=[0, 1, 0]), y)):
        s.add_joint_force(s.add_joint(joint), -k_h * q - d * q.dot)
    s.add_joint(sd.Revolute("spin", hub, wheel, psi, axis=[0, 0, 1]))
    for k, q in enumerate((b1, b2, b3)):
        blade = s.add_body(f"blade{k}", mass=m, com=[r, 0, 0])
        c, n = [(sp.Integer(1), sp.Integer(0)), (-HALF, ROOT), (-HALF, -ROOT)][k]
        turned = [[c, -n, 0], [n, c, 0], [0, 0, 1]]
        hinge = s.add_joint(sd.Revolute(f"lag{k}", wheel, blade, q, axis=[0, 0, 1], parent_point=[c * e, n * e, 0],
                                        parent_rotation=turned))
        s.add_joint_force(hinge, -k_b * q)
    s.defaults = {M: 10.0, J: 1.0, m: 1.5, e: 0.3, r: 1.2, k_h: 900.0, k_b: 4.0, d: 0.0, g: 0.0}
    return s.embedding().compile(backend="numpy")


def coleman(W: float, d: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, C, K in x, y, collective, cosine, sine for psi counted from x, derived by hand (linear in all).

    Blade: I b_ddot + (k_b + W^2 S e) b + S (y_ddot cos psi_k - x_ddot sin psi_k) = 0, S = m r, I = m r^2; hub: total mass
    times x_ddot + k x = S d^2/dt^2 sum b_k sin psi_k, and likewise y with - cos.
    """
    p = HUB
    S, I, total = p["m"] * p["r"], p["m"] * p["r"]**2, p["M"] + 3 * p["m"]
    kappa = p["k_b"] + W**2 * S * p["e"]
    M, C, K = np.zeros((5, 5)), np.zeros((5, 5)), np.zeros((5, 5))
    M[0, 0] = M[1, 1] = total
    C[0, 0] = C[1, 1] = d
    K[0, 0] = K[1, 1] = p["k_h"]
    M[0, 4], M[1, 3] = -1.5 * S, 1.5 * S
    M[2, 2], K[2, 2] = 3 * I, 3 * kappa
    M[3, 3] = M[4, 4] = 1.5 * I
    K[3, 3] = K[4, 4] = 1.5 * (kappa - I * W**2)
    C[3, 4], C[4, 3] = 3 * I * W, -3 * I * W
    M[3, 1], M[4, 0] = 1.5 * S, -1.5 * S
    return M, C, K


def upper(values: np.ndarray) -> np.ndarray:
    """Eigenvalues with positive imaginary part of each pair, by frequency."""
    kept = values[values.imag > 1e-9]
    return kept[np.argsort(kept.imag)]


def test_whirl_of_a_disc() -> None:
    """I (a_ddot) + Ip W b_dot + k a = 0: omega = sqrt(k / I + (Ip W / 2 I)^2) +- Ip W / 2 I, followed through all speeds."""
    speeds = np.linspace(0, 60, 7)
    diagram = disc().campbell("phi_dot", speeds)
    half = 0.8 * speeds / (2 * 0.5)
    root = np.sqrt(100 + half**2)
    found = diagram.frequencies[:, np.argsort(diagram.frequencies[-1])] * 2 * np.pi
    assert np.allclose(found, np.column_stack([root - half, root + half]), rtol=1e-10)
    assert np.abs(diagram.damping).max() < 1e-12 and len(diagram.names) == 2 and len(diagram.equilibria) == 7
    assert all(e["phi_dot"] == W for e, W in zip(diagram.equilibria, speeds, strict=True))
    assert len(repr(diagram).splitlines()) == 9 and "phi_dot" in repr(diagram)


@pytest.mark.parametrize("damped", [0.0, 6.0])
def test_three_blades_in_the_fixed_frame(damped: float) -> None:
    """Coleman's equations; without damping the regressive lag mode and the hub couple to ground resonance at some speeds."""
    speeds = np.linspace(1.0, 13.0, 9)
    diagram = rotor().campbell("psi_dot", speeds, blades=[("b1", "b2", "b3")], params={"d": damped}, azimuths=3)
    grows = []
    for W, modes in zip(speeds, diagram.modes, strict=True):
        M, C, K = coleman(W, damped)
        n = np.zeros((5, 5))
        values = scipy.linalg.eig(np.block([[n, np.eye(5)], [-K, -C]]), scipy.linalg.block_diag(np.eye(5), M))[0]
        expected, found = upper(values), upper(modes.eigenvalues)
        assert len(found) == len(expected)
        for value in expected:
            assert np.abs(found - value).min() < 1e-8 * abs(value)
        grows.append(any(m.kind == "unstable" for m in modes))
    if not damped:
        assert any(grows) and not all(grows)
    assert any(n == "b1 collective" for n in diagram.names)
    collective = diagram["b1 collective"] * 2 * np.pi
    p = HUB
    assert np.allclose(collective, np.sqrt((p["k_b"] + speeds**2 * p["m"] * p["r"] * p["e"]) / (p["m"] * p["r"]**2)), rtol=1e-10)


def test_whirls_are_named_by_their_sense() -> None:
    """Far from the hub's frequency the lag modes whirl at |W -+ nu|: one goes round with the rotor, one against it or with it."""
    stiff = rotor().campbell("psi_dot", [8.0, 9.0], blades=[("b1", "b2", "b3")], params={"k_h": 1e9, "k_b": 400.0}, azimuths=3)
    W, p = 9.0, HUB
    nu = np.sqrt((400 + W**2 * p["m"] * p["r"] * p["e"]) / (p["m"] * p["r"]**2))
    assert np.isclose(stiff["b1 forward"][-1] * 2 * np.pi, nu + W, rtol=1e-6)
    assert np.isclose(stiff["b1 backward"][-1] * 2 * np.pi, nu - W, rtol=1e-6)


@pytest.mark.parametrize("count", [3, 4, 5])
def test_transformation_and_its_derivatives(count: int) -> None:
    """By differences; columns are orthogonal; the last coordinate is no blade."""
    turning = Rotor(disc(), 0, 0, (tuple(range(count)),), (), tuple(range(count + 1)))
    T, first, second = turning.transform(0.7)
    ahead, behind = turning.transform(0.7 + 1e-5), turning.transform(0.7 - 1e-5)
    assert np.allclose(first, (ahead[0] - behind[0]) / 2e-5, atol=1e-9)
    assert np.allclose(second, (ahead[1] - behind[1]) / 2e-5, atol=1e-9)
    squares = T.T @ T
    assert np.allclose(squares, np.diag(np.diag(squares)), atol=1e-14) and T[count, count] == 1 and squares[0, 0] == count


def test_gravity_on_the_blades_is_in_the_steady_state() -> None:
    """In the fixed frame weight is a constant force: (kappa - I W^2) a_c = -1.5/1.5 S g, the hub sinks by the whole weight."""
    g, W, p = 1e-5, 3.0, HUB
    diagram = rotor().campbell("psi_dot", [W], blades=[("b1", "b2", "b3")], params={"g": g}, azimuths=6)
    (state,) = diagram.equilibria
    a = dict(zip(state.rotor.labels, state.a, strict=True))
    S, I = p["m"] * p["r"], p["m"] * p["r"]**2
    kappa = p["k_b"] + W**2 * S * p["e"]
    assert np.isclose(a["b1 cosine"], -S * g / (kappa - I * W**2), rtol=1e-6) and abs(a["b1 sine"]) < 1e-12
    y = state.point.q[rotor().metadata.q.index("y")]
    assert np.isclose(y, -(p["M"] + 3 * p["m"]) * g / p["k_h"], rtol=1e-6)


def test_picture(tmp_path: Any) -> None:
    """Lines of 1P, 3P and 6P as far as they are seen, a line for every mode."""
    matplotlib = pytest.importorskip("matplotlib")
    diagram = disc().campbell("phi_dot", np.linspace(0, 60, 5))
    figure = diagram.plot(tmp_path / "campbell.png")
    upper_axes, lower_axes = figure.axes
    assert (tmp_path / "campbell.png").stat().st_size > 10_000 and matplotlib is not None
    labels = [t.get_text() for t in upper_axes.texts]
    assert labels == ["1P", "3P", "6P"] and len(upper_axes.lines) == len(diagram.names) + 3
    assert len(lower_axes.lines) == len(diagram.names) + 1 == 3
    assert lower_axes.get_xlabel() == r"$\dot{\phi}$ [rad/s]"
    assert len(diagram.plot(highest=1.55).axes[0].lines) == 1 + 3  # the other mode starts at 1.59 Hz and rises


@pytest.mark.parametrize(("arguments", "message"), [
    ({"speed": "phi"}, "speed: there is no 'phi'"),
    ({"values": "fast"}, "values must be speeds in rad/s, found 'fast'"),
    ({"values": [np.nan]}, "values must be speeds in rad/s"),
    ({"fixed": {"phi_dot": 1.0}}, "phi_dot is in fixed, too"),
    ({"blades": [("a", "b")]}, "blades: 2 blades (a, b) are named; multi-blade coordinates need at least 3"),
    ({"blades": [("a", "b", "b")]}, "a coordinate is named for two blades"),
    ({"blades": [("a", "b", "phi")]}, "phi is kept, but a coordinate of a blade has to be free"),
    ({"blades": [("a", "b", "c")]}, "blades: there is no 'c'"),
    ({"blades": 3}, "blades must be a list of sets of coordinates, found 3"),
    ({"azimuths": "x"}, "azimuths must be a whole number, found 'x'"),
    ({"speed": None}, "speed must be one name or symbol, found None"),
    ({"max_iterations": 0}, "max_iterations must be a whole number of at least 1, found 0"),
])
def test_bad_arguments(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ArgumentError, match=re.escape(message)):
        disc().campbell(**{"speed": "phi_dot", "values": [1.0, 2.0], **arguments})


def test_sets_hold_the_same_coordinate_of_every_blade() -> None:
    """The hub's ways in place of blades; equal blades pass with gravity on them."""
    with pytest.raises(ArgumentError, match=r"rotor: blades: a set holds the same coordinate of every blade, one set per shape"
                                            r", .* but these differ in inertia: x: 14\.5, y: 14\.5, b1: 2\.16; group them"):
        rotor().campbell("psi_dot", [3.0], blades=[("x", "y", "b1")])
    with pytest.raises(ArgumentError, match="but these differ in stiffness: x: 900, b1: "):
        rotor().campbell("psi_dot", [3.0], blades=[("x", "b1", "b2")], params={"r": np.sqrt(14.5 / 1.5)})
    assert len(rotor().campbell("psi_dot", [3.0], blades=[("b1", "b2", "b3")], params={"g": 0.1}).names) == 5


def test_picture_of_many_modes() -> None:
    """One colour for each part, a name at every right end; what lies far above is left out and reported; rpm above."""
    pytest.importorskip("matplotlib")
    from symdyn.pictures.campbell import part

    names = [*[f"blade1_{n} {w}" for n in ("flap1", "edge1", "flap2") for w in ("backward", "collective", "forward")],
             "tower_fa1", "tower_ss1", "x", "y", "yaw"]
    frequencies = np.array([*np.linspace(0.6, 2.0, 9), 0.45, 0.46, 0.01, 0.02, 6.0])
    speeds = np.array([0.0, 1.5])
    diagram = Campbell("turbine", "azimuth_dot", speeds, 2j * np.pi * np.tile(frequencies, (2, 1)), tuple(names), (), ())
    axes = diagram.plot().axes[0]
    drawn = {line.get_label(): line for line in axes.lines if line.get_label() in names}
    assert set(drawn) == set(names) - {"yaw"} and axes.get_ylim()[1] == pytest.approx(1.08 * 2.0)
    texts = [t.get_text() for t in axes.texts]
    assert set(drawn) <= set(texts) and "not shown, above: yaw (6 Hz)" in texts
    colors = {part(name): line.get_color() for name, line in drawn.items()}
    assert set(colors) == {"blade", "tower", ""} and len(set(map(str, colors.values()))) == 3
    assert all(line.get_color() == colors[part(name)] for name, line in drawn.items())
    (rpm,) = axes.child_axes
    assert rpm.get_xlabel() == "[rpm]" and len(diagram.plot(highest=7.0).axes[0].lines) == len(names) + 3
    heights = sorted(t.get_position()[1] for t in axes.texts if t.get_text() in names)
    assert np.diff(heights).min() > 0.03


def test_multi_blade_coordinates_take_no_constraints() -> None:
    module = systems.four_bar().augmented().compile(backend="numpy")
    with pytest.raises(ArgumentError, match="multi-blade coordinates are for systems without constraints and extra states"):
        module.campbell("q1_dot", [0.0], blades=[("q1", "q2", "q3")])


def test_no_steady_state() -> None:
    """Without a spring in the hinges nothing holds blades that stand still."""
    with pytest.raises(NoEquilibrium, match=r"rotor: there is no stiffness along b1 .* at 0 rad/s"):
        rotor().campbell("psi_dot", [0.0], blades=[("b1", "b2", "b3")], params={"k_b": 0.0})
    diagram = rotor().campbell("psi_dot", [1.0, 2.0], blades=[("b1", "b2", "b3")])
    with pytest.raises(ArgumentError, match="there is no mode 'flap'; there are "):
        diagram["flap"]
