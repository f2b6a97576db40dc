"""Chapter 6.4: the velocity of link 2 from that of link 1, and the matrix S of four joints."""

from __future__ import annotations

from typing import Any

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, conventions, proofs
from symdyn.frames.product import times
from symdyn.lecture.letters import constant, skew, stands_for

TITLE = "Inverse Dynamics of 2-Link Arm"
DEFINE_S = f"{TITLE} - Define S matrix according to the joint"
i, j, k = (sp.eye(3).col(axis) for axis in range(3))
zero = sp.zeros(3, 1)
q_dot = sp.Matrix(sp.symbols("q1_dot q2_dot q3_dot q4_dot q5_dot q6_dot"))
q2_dot, theta_dot = q_dot[1], sp.Symbol("theta_dot")
w1, v1 = constant("omega_1"), constant("v_1")


class Links:
    """Link 1 moves freely, a joint carries link 2; of its recursion what the slides name.

    R, r   b2_R_b1 (3, 3) and b1_r_O2/O1 (3, 1); speeds: of the joint
    """

    def __init__(self, joint: Any, R: sp.Matrix, r: sp.Matrix) -> None:
        system = sd.System("two_links", gravity=[0, 0, 0])
        bodies = [system.add_body(name, mass=1, inertia=sp.eye(3)) for name in ("link1", "link2")]
        system.add_joint(sd.Free("base", system.ground, bodies[0], sd.coordinates("x y z a b c"), velocity="body",
                                 speeds=sd.speeds("v_1_x v_1_y v_1_z omega_1_x omega_1_y omega_1_z")))
        system.add_joint(joint(*bodies))
        self.equations = system.recursive()
        self.speeds = sp.Matrix(self.equations.symbols.speeds[6:])
        self.R, self.r = R, r

    def derived(self, name: str) -> sp.Matrix:
        """X, S or v of link 2."""
        return sp.Matrix(self.equations.explicit(f"{name}_2", simplify=False))

    @property
    def X(self) -> sp.Matrix:
        """(6, 6) as printed."""
        return sp.Matrix(sp.BlockMatrix([[self.R, sp.zeros(3)], [-self.R * skew(self.r), self.R]]))

    @property
    def moved(self) -> sp.Matrix:
        """(6, 1) X times the velocity of link 1."""
        return sp.Matrix(times(self.X, sp.Matrix.vstack(w1, v1)))


def revolute_links() -> Links:
    q2, arm = sd.coordinates("q2"), constant("r")
    return Links(lambda a, b: sd.Revolute("elbow", a, b, q2, axis=[0, 0, 1], parent_point=list(arm)),
                 sd.rotation.about("Z", q2).T, arm)


def prismatic_links() -> Links:
    q2, arm, turn = sd.coordinates("q2"), constant("r"), sd.rotation.about("Z", sp.Symbol("beta"))
    return Links(lambda a, b: sd.Prismatic("slide", a, b, q2, axis=[1, 0, 0], parent_point=list(arm), parent_rotation=turn),
                 turn.T, arm + turn * i * q2)


def spherical_links() -> Links:
    angles, arm = sd.coordinates("alpha beta gamma"), constant("r")
    return Links(lambda a, b: sd.Spherical("ball", a, b, angles, orientation=sd.EulerAngles("ZYX", speeds="body"),
                                           parent_point=list(arm)), sd.rotation.from_euler("ZYX", angles).T, arm)


def free_links() -> Links:
    angles, place = sd.coordinates("alpha beta gamma"), sd.coordinates("X Y Z")
    return Links(lambda a, b: sd.Free("free", a, b, [*place, *angles], velocity="body"),
                 sd.rotation.from_euler("ZYX", angles).T, sp.Matrix(place))


def in_n_frame() -> list[Formula]:
    """Velocities in components of the n-frame: joints that turn about one axis, about a point, and all free."""
    n = sd.Frame("n")
    a, b = sd.coordinates("a b")
    b1 = n.frame("b1", rotation=sd.rotation.about("Z", a) * sd.rotation.about("X", b), origin=list(sd.coordinates("x y z")))
    (alpha, beta), place = sd.coordinates("alpha beta"), sd.coordinates("X Y Z")
    turned = sd.rotation.about("Z", alpha) * sd.rotation.about("Y", beta)
    arm = constant("r")
    revolute = b1.frame("b2", rotation=sd.rotation.about("Z", sd.coordinates("q2")), origin=list(arm))
    ball = b1.frame("b2", rotation=turned, origin=list(arm))
    free = b1.frame("b2", rotation=turned, origin=list(place))
    n_w1, n_v1, n_r = constant("n_omega_1"), constant("n_v_1"), constant("n_r")
    n_i, n_j, n_k = axes = [constant(f"n_{letter}") for letter in "ijk"]
    of_1 = stands_for(n_w1, b1.angular_velocity()) | stands_for(n_v1, b1.velocity())

    def letters(b2: Any) -> dict[Any, Any]:
        R = b2.rotation(n)
        along = [stands_for(axis, R.col(number)) for number, axis in enumerate(axes)]
        own = [*b2.angular_velocity(seen_from=b1, components=b2), *b2.velocity(seen_from=b1, components=b2)]
        speeds = stands_for(q_dot, own)
        position = stands_for(n_r, b2.position(of=b1, components=n))
        return {**of_1, **along[0], **along[1], **along[2], **speeds, **position}

    turning, about_point, moving = letters(revolute), letters(ball), letters(free)
    turning |= {theta_dot: sd.coordinates("q2").dot}
    n_omega_21 = revolute.angular_velocity(seen_from=b1, components=n)
    arm_velocity = n_w1.cross(n_r) + n_v1
    sum_of_three = n_w1 + n_i * q_dot[0] + n_j * q_dot[1] + n_k * q_dot[2]
    sum_of_six = arm_velocity + n_i * q_dot[3] + n_j * q_dot[4] + n_k * q_dot[5]
    n_w21 = constant("n_omega_21")
    relative = of_1 | stands_for(n_w21, n_omega_21)
    return [
        Formula("omega", n_w1 + n_w21, revolute.angular_velocity(), line=12448, latex=r"{}^n\omega_{b_2/n}", renamed=relative),
        Formula("omega of the joint", n_k * theta_dot, n_omega_21, line=12450, latex=r"{}^n\omega_{b_2/b_1}", renamed=turning),
        Formula("omega, revolute", n_w1 + n_k * theta_dot, revolute.angular_velocity(), line=12452, also=(12464, 12484),
                latex=r"{}^n\omega_{b_2/n}", renamed=turning),
        Formula("v, revolute", arm_velocity, revolute.velocity(), line=12468, also=(12484,), latex="{}^nv_{O_2/E}",
                renamed=turning),
        Formula("omega, spherical", sum_of_three, ball.angular_velocity(), line=12548, latex=r"{}^n\omega_{b_2/n}",
                renamed=about_point),
        Formula("v, spherical", arm_velocity, ball.velocity(), line=12552, latex="{}^nv_{O_2/E}", renamed=about_point),
        Formula("omega, 6-DOF", sum_of_three, free.angular_velocity(), line=12602, latex=r"{}^n\omega_{b_2/n}", renamed=moving),
        Formula("v, 6-DOF", sum_of_six, free.velocity(), line=12606, latex="{}^nv_{O_2/E}", renamed=moving),
    ]


def revolute() -> list[Formula]:
    links = revolute_links()
    R, r, X, v2 = links.R, links.r, links.X, links.derived("v")
    S = sp.Matrix([0, 0, 1, 0, 0, 0])
    turning = {theta_dot: links.speeds[0], q2_dot: links.speeds[0]}
    return [
        Formula("omega of b2", R * w1 + k * theta_dot, v2[:3, :], line=12488, also=(12494,),
                latex=r"{}^{b_2}\omega_{b_2/n}", renamed=turning),
        Formula("v of O2", R * w1.cross(r) + R * v1, v2[3:, :], line=12490, latex="{}^{b_2}v_{O_2/E}", renamed=turning),
        Formula("v of O2, exchanged", -R * r.cross(w1) + R * v1, v2[3:, :], line=12496, latex="{}^{b_2}v_{O_2/E}",
                renamed=turning),
        Formula("X", X, links.derived("X"), line=12500, also=(12520, 12532, 12578, 12582, 12632, 12634),
                latex="{}^{b_2}X_{b_1}"),
        Formula("matrix form", links.moved + sp.Matrix.vstack(k, zero) * theta_dot, v2, line=12500, also=(12520,),
                latex=r"{}^{b_2}\hat{v}_{b_2}", renamed=turning),
        Formula("S", S, links.derived("S"), line=12506, also=(12522,), latex="S_{b_2}"),
        Formula("velocity", links.moved + S * q2_dot, v2, line=12502, also=(12518,), latex=r"{}^{b_2}\hat{v}_{b_2}",
                renamed=turning),
    ]


def prismatic() -> list[Formula]:
    links = prismatic_links()
    v2, S = links.derived("v"), sp.Matrix([0, 0, 0, 1, 0, 0])
    sliding = {q2_dot: links.speeds[0]}
    per_second, speed, length = (0, 0, -1), (0, 1, -1), (0, 1, 0)
    units: dict[Any, Any] = {**dict.fromkeys(w1, per_second), **dict.fromkeys(v1, speed), **dict.fromkeys(constant("r"), length),
                             "q2": length, links.speeds[0]: speed, theta_dot: per_second}
    linear = proofs.dimensions("The linear velocity is in m/s.", units, speed)
    in_meters = proofs.Proof("dimensions", linear.sentence, lambda v: linear.residual(sp.Matrix(v)[3:, :]))
    no_angle = Erratum("A prismatic joint does not turn: the rate of its coordinate q_2 belongs here, not that of an angle.",
                       in_meters, [(3,)])
    return [
        Formula("matrix form", links.moved + sp.Matrix.vstack(zero, i) * theta_dot, v2, line=12532, errata=[no_angle],
                latex=r"{}^{b_2}\hat{v}_{b_2}", renamed=sliding),
        Formula("S", S, links.derived("S"), line=12534, latex="S_{b_2}"),
        Formula("velocity", links.moved + S * q2_dot, v2, line=12530, latex=r"{}^{b_2}\hat{v}_{b_2}", renamed=sliding),
    ]


def spherical() -> list[Formula]:
    links = spherical_links()
    v2, R = links.derived("v"), links.R
    S = sp.Matrix.vstack(sp.eye(3), sp.zeros(3))
    b_w1, b_v1, b_r = R * w1, R * v1, R * links.r
    turning = stands_for(q_dot[:3, :], links.speeds)
    columns = [sp.Matrix.vstack(axis, zero) for axis in (i, j, k)]
    return [
        Formula("omega of b2", b_w1 + i * q_dot[0] + j * q_dot[1] + k * q_dot[2], v2[:3, :], line=12556, also=(12574,),
                latex=r"{}^{b_2}\omega_{b_2/n}", renamed=turning),
        Formula("v of O2", b_w1.cross(b_r) + b_v1, v2[3:, :], line=12558, also=(12576,), latex="{}^{b_2}v_{O_2/E}",
                renamed=turning),
        Formula("matrix form", links.moved + columns[0] * q_dot[0] + columns[1] * q_dot[1] + columns[2] * q_dot[2], v2,
                line=12578,
                latex=r"{}^{b_2}\hat{v}_{b_2}", renamed=turning),
        Formula("columns put together", links.moved + sp.Matrix.hstack(*columns) * q_dot[:3, :], v2, line=12582,
                latex=r"{}^{b_2}\hat{v}_{b_2}", renamed=turning),
        Formula("S", S, links.derived("S"), line=12586, latex="S_{b_2}"),
        Formula("velocity", links.moved + S * q_dot[:3, :], v2, line=12584, latex=r"{}^{b_2}\hat{v}_{b_2}", renamed=turning),
    ]


def six_degrees_of_freedom() -> list[Formula]:
    links = free_links()
    v2, R = links.derived("v"), links.R
    angular_first = conventions.reordered(columns=[3, 4, 5, 0, 1, 2], sentence="The slide counts the angular speeds first.")
    own = sp.Matrix([*links.speeds[3:], *links.speeds[:3]])
    turning = stands_for(q_dot, own)
    b_w1, b_v1, b_r = R * w1, R * v1, R * links.r
    omega = b_w1 + i * q_dot[0] + j * q_dot[1] + k * q_dot[2]
    v = b_w1.cross(b_r) + b_v1 + i * q_dot[3] + j * q_dot[4] + k * q_dot[5]
    columns = [*[sp.Matrix.vstack(axis, zero) for axis in (i, j, k)], *[sp.Matrix.vstack(zero, axis) for axis in (i, j, k)]]
    one_by_one = sum((column * rate for column, rate in zip(columns, q_dot, strict=True)), links.moved)
    S = sp.eye(6)
    # The same velocity from the positions of O2 and the attitude of b2, in a frame that rides on link 1.
    rotation, place = R.T, links.r
    riding = sd.Frame("b1").frame("b2", rotation=rotation, origin=list(place))
    relative = sp.Matrix.vstack(riding.angular_velocity(components=riding), riding.velocity(components=riding))
    known = dict(zip(own, relative, strict=True))
    carried = sp.Matrix.vstack(R * w1, R * (v1 + w1.cross(place)))
    by_frames = proofs.Proof("another formulation", "Velocity and angular velocity of the moving frame b2, carried along by b1.",
                             lambda result: (sp.Matrix(result).xreplace(known) - carried - relative).xreplace(parallel))
    # The error is shown at parallel axes of b1 and b2, where it is short.
    parallel = dict.fromkeys(links.equations.symbols.coordinates[9:], sp.S.Zero)
    v2_parallel, moved = v2.xreplace(parallel), links.moved.xreplace(parallel)
    twice = Erratum("The joint's velocity is counted twice: the identity matrix is S itself, not a further term.", by_frames)
    sign = Erratum("The joint's velocity is added to that of link 1, as on the slides before.", by_frames)
    symbols, rates = links.equations.symbols, links.equations.explicit("rates", simplify=False)
    by_speeds = relative.xreplace({c.dot: rate for c, rate in zip(symbols.coordinates[6:], rates[6:12], strict=True)})
    return [
        Formula("omega of b2", omega, v2[:3, :], line=12610, also=(12624,), latex=r"{}^{b_2}\omega_{b_2/n}", renamed=turning),
        Formula("v of O2", v, v2[3:, :], line=12612, also=(12630,), latex="{}^{b_2}v_{O_2/E}", renamed=turning),
        Formula("matrix form", one_by_one, v2, line=12632, latex=r"{}^{b_2}\hat{v}_{b_2}", renamed=turning),
        Formula("columns put together", moved + sp.Matrix.hstack(*columns) * q_dot + S * q_dot, v2_parallel, line=12634,
                errata=[twice],
                latex=r"{}^{b_2}\hat{v}_{b_2}", renamed=turning),
        Formula("velocity", links.moved + S * q_dot, v2, line=12636, latex=r"{}^{b_2}\hat{v}_{b_2}", renamed=turning),
        Formula("velocity, last slide", moved - S * q_dot, v2_parallel, slide=Slide("6.4", f"{DEFINE_S}, 6-DOF Joint", 12648),
                errata=[sign], latex=r"{}^{b_2}\hat{v}_{b_2}", renamed=turning),
        Formula("S", S, links.derived("S"), line=12650, also=(12634,), conventions=[angular_first], latex="S_{b_2}"),
        Formula("meaning of the rates", q_dot, by_speeds, line=12654, renamed=turning),
    ]


CASES = (
    Case("two-link-velocities", "Velocities of link 2 in the n-frame", Slide("6.4", f"{TITLE} - Velocity of b_2-frame", 12438),
         in_n_frame),
    Case("revolute-joint-S", "Revolute joint: velocity of link 2 and S", Slide("6.4", f"{TITLE} - Velocity of b_2-frame", 12478),
         revolute),
    Case("prismatic-joint-S", "Prismatic joint: velocity of link 2 and S", Slide("6.4", f"{DEFINE_S}, Prismatic joint", 12524),
         prismatic),
    Case("spherical-joint-S", "Spherical joint: velocity of link 2 and S", Slide("6.4", f"{DEFINE_S}, Spherical Joint", 12538),
         spherical),
    Case("six-dof-joint-S", "6-DOF joint: velocity of link 2 and S", Slide("6.4", f"{DEFINE_S}, 6-DOF Joint", 12592),
         six_degrees_of_freedom),
)
