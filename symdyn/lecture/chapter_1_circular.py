"""Chapter 1.3 and the first part of 1.4: circular motion, tangential and normal acceleration."""

from __future__ import annotations

from dataclasses import replace

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, conventions, proofs
from symdyn.frames.tidy import tidy

i, j, k = (sp.eye(3).col(axis) for axis in range(3))
R, omega, v, beta = sp.symbols("R omega v beta", positive=True)


def length(vector: sp.Matrix) -> sp.Expr:
    """The magnitude of a vector."""
    return sp.sqrt(vector.dot(vector))


def limit(change: sp.Matrix, step: sp.Symbol) -> sp.Matrix:
    """Where change / step tends while the step tends to zero and the change with it (de l'Hospital)."""
    return change.diff(step).subs(step, 0)


def _uniform() -> list[Formula]:
    """A point at the distance r of the centre of a disk that turns with omega; its speed is v."""
    r, dt, spin = sp.symbols("r_PO Delta_t omega_bnz", positive=True)
    n = sd.Frame("n")
    b = n.frame("b", rotation=sd.rotation.about("Z", spin * sd.t))
    P = b.point("P", [r, 0, 0])
    position, velocity = P.position(of=n), P.velocity(seen_from=n)
    acceleration = P.acceleration(seen_from=n)
    change = velocity.subs(sd.t, sd.t + dt) - velocity
    speeds = [length(velocity.subs(sd.t, time / spin)) for time in (0, 1, 2, 3)]
    omega_bn = sp.Matrix([0, 0, spin])
    of_disk = {"v": spin * r}
    return [
        Formula("speed at four positions", [v, v, v, v], speeds, line=574, renamed=of_disk),
        Formula("size of the acceleration", v**2 / r, length(acceleration), line=587, also=(599, 619), renamed=of_disk,
                latex="a"),
        Formula("size of the acceleration as a limit", length(limit(change, dt)), length(acceleration),
                line=605, also=(624,), latex="|a|"),
        Formula("a perpendicular to the velocity", 0, acceleration.dot(velocity), line=626, latex=r"a \cdot \dot{r}_{P/O}"),
        Formula("direction of the acceleration", -position / r, acceleration / length(acceleration), line=628, also=(638,)),
        Formula("velocity of O", sp.Matrix([[0, 0, 0]]).T, b.velocity(seen_from=n), line=658,
                latex="{}^n v_{O/E}"),
        Formula("angular velocity", sp.Matrix([[0, 0, spin]]).T, b.angular_velocity(n), line=662,
                latex=r"{}^n \omega_{b/n}"),
        Formula("velocity of P", omega_bn.cross(position), velocity, line=666, latex="{}^n v_{P/E}"),
    ]


def _curve() -> list[Formula]:
    """A point that runs along a helix of the pitch angle beta, with the path length s, and one on any curve."""
    s, x, y, z = sd.coordinates("s x y z")
    c, forwards = sp.Symbol("c", real=True), sp.Symbol("u", positive=True)
    n = sd.Frame("n")
    angle = s * sp.cos(beta) / R
    on_helix = n.point("P", [R * sp.cos(angle), R * sp.sin(angle), s * sp.sin(beta)])
    tau, start = sp.symbols("tau a")
    on_circle = n.frame("b", rotation=sd.rotation.about("Z", omega * sd.t)).point("B", [R, 0, 0])
    r1 = sp.Matrix([-R * omega * sp.sin(omega * tau), R * omega * sp.cos(omega * tau)])
    path = sp.Integral(length(r1), (tau, start, sd.t))
    r_helix = on_helix.position(of=n)
    v_helix, a_helix = on_helix.velocity(seen_from=n), on_helix.acceleration(seen_from=n)
    u, du_ds = r_helix.diff(s), r_helix.diff(s, 2)
    point = n.point("P", [x, y, z])
    velocity, acceleration = point.velocity(seen_from=n), point.acceleration(seen_from=n)
    v_printed, a_printed = sp.Matrix([x.dot, y.dot, z.dot]), sp.Matrix([x.ddot, y.ddot, z.ddot])
    along = velocity / length(velocity)
    a_tan = (along * along.T) * acceleration
    steady = proofs.limit("With constant speed the size is v^2 / r, r being the radius of curvature R / cos(beta)^2.",
                          at={s.ddot: 0}, value=s.dot**2 * sp.cos(beta)**2 / R)
    only_tangential = Erratum("d^2 s / dt^2 is the tangential part alone; the normal part is missing.", steady)
    signed = conventions.other_point(acceleration.dot(along), "the size counts along the velocity: it is negative while the body "
                                     "brakes, as its product with v / |v| on the next line needs it")
    return [
        Formula("path length, differentiated", path.diff(sd.t), length(on_circle.velocity(seen_from=n)), line=727, also=(744,),
                latex="ds/dt"),
        Formula("rate of the path length", length(v_printed), length(velocity), line=728, also=(736, 746), latex="ds/dt"),
        Formula("v", u * s.dot, v_helix, line=738, also=(750,)),
        Formula("size of the velocity", s.dot, length(v_helix), line=736, where={s.dot: forwards}, latex="|v|"),
        Formula("size of the acceleration", s.ddot, sp.sqrt(tidy(sp.Matrix([a_helix.dot(a_helix)]))[0]), line=758,
                errata=[only_tangential], latex="|a|"),
        Formula("a", du_ds * s.dot**2 + u * s.ddot, a_helix, line=760, also=(768,)),
        Formula("v with constant speed c", c**2, v_helix.dot(v_helix).xreplace({s.dot: c}), line=764, latex=r"v \cdot v"),
        Formula("a_norm", du_ds * s.dot**2, a_helix - (u * u.T) * a_helix, line=768),
        Formula("a_tan", u * s.ddot, (u * u.T) * a_helix, line=768),
        Formula("a_norm as a difference", a_printed - a_printed.dot(v_printed) / v_printed.dot(v_printed) * v_printed,
                acceleration - a_tan, line=772, latex=r"a_{\text{norm}}"),
        Formula("size of a_tan", a_printed.dot(v_printed / length(v_printed)), sp.Abs(acceleration.dot(along)), line=776,
                conventions=[replace(signed, name="signed size")], latex=r"|a_{\text{tan}}|"),
        Formula("a_tan by projection", a_printed.dot(v_printed / length(v_printed)) * v_printed / length(v_printed), a_tan,
                line=778),
        Formula("a_tan by scalar products", a_printed.dot(v_printed) / v_printed.dot(v_printed) * v_printed, a_tan, line=778),
    ]


def _centripetal() -> list[Formula]:
    t = sd.t
    n = sd.Frame("n")
    B = n.frame("b", rotation=sd.rotation.about("Z", omega * t)).point("B", [R, 0, 0])
    r, velocity, acceleration = (B.position(of=n), B.velocity(seen_from=n),
                                 B.acceleration(seen_from=n))
    cos, sin = sp.cos(omega * t), sp.sin(omega * t)
    return [
        Formula("r", R * cos * i + R * sin * j, r, line=786, also=(788,)),
        Formula("v", -R * omega * sin * i + R * omega * cos * j, velocity, line=792, also=(794,)),
        Formula("speed from the components", length(sp.Matrix([-R * omega * sin, R * omega * cos])), length(velocity), line=798,
                latex="|v|"),
        Formula("speed under the root", sp.sqrt((R * omega)**2 * sin**2 + (R * omega)**2 * cos**2), length(velocity), line=800),
        Formula("speed", R * omega, length(velocity), line=800, latex="|v|"),
        Formula("a", -R * omega**2 * cos * i - R * omega**2 * sin * j, acceleration, line=804, also=(806,)),
        Formula("a from r", -omega**2 * r, acceleration, line=812),
    ]


CASES = (
    Case("circular-motion", "Uniform circular motion and v = omega x r", Slide("1.3", "Uniform Circular Motion", 561), _uniform),
    Case("tangential-normal", "Tangential and normal acceleration", Slide("1.4", "Tangential and Normal Acceleration", 766),
         _curve),
    Case("centripetal-acceleration", "Centripetal acceleration on a circle",
         Slide("1.4", "Centripetal Acceleration. Centrifugal Force.", 782), _centripetal),
)
