"""The tree of frames, and how one moves relative to another along the path between them.

Along a path from f to k every link adds its own motion: omega_k = omega_j + w and alpha_k = alpha_j + w' + omega_j x w,
where w is the motion of k in its neighbour j and w' its rate seen there. Nothing is differentiated but each link's own
components, and nothing is rotated forth and back, so that results stay as short as the motion is simple.
Source: lecture, chapter 1.7.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.errors import ArgumentError
from symdyn.frames.checks import FrameFaults
from symdyn.frames.euler_parameters import spin_by_parameters
from symdyn.frames.product import cross, times
from symdyn.frames.rates import differentiated
from symdyn.frames.tidy import tidy
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import Matrix
    from symdyn.given import Vector as Components

ZERO = sp.ImmutableMatrix(sp.zeros(3, 1))


class Axes:
    """An origin and three axes, described in a parent; what `Frame` is built on.

    turn    (3, 3) takes components here to the parent's
    shift   (3, 1) the origin from the parent's origin, the parent's components
    path    from the first of the tree to this one
    """

    def __init__(self, name: str, parent: Axes | None, rotation: Matrix | None, origin: Components) -> None:
        faults = FrameFaults(f"frame {name}" if isinstance(name, str) else "a frame")
        faults.name(name, "frame")
        if parent is not None and not isinstance(parent, Axes):
            faults.append(f"{faults.where}: its parent is {shown(parent)}; pass a frame")
            parent = None
        self.name = name
        self.parent: Axes | None = parent
        self.turn = sp.ImmutableMatrix(sp.eye(3)) if rotation is None else faults.rotation(rotation)
        self.shift = faults.column(origin, "origin")
        if parent is None and not faults and (self.turn != sp.eye(3) or any(self.shift)):
            faults.append(f"{faults.where} has a rotation or an origin, but no parent; make it with parent.frame(name, ...)")
        faults.demand_none()
        self.path: tuple[Any, ...] = (*(parent.path if parent is not None else ()), self)

    @cached_property
    def _by_parameters(self) -> tuple[sp.ImmutableMatrix, sp.ImmutableMatrix] | None:
        return spin_by_parameters(self.turn)

    @cached_property
    def omega_in_parent(self) -> sp.ImmutableMatrix:
        """Angular velocity in the parent, its components: R_dot R^T = [omega x], or 2 E p_dot by Euler parameters."""
        if self._by_parameters is not None:
            return self._by_parameters[0]
        return _axial(times(sp.Matrix(3, 3, differentiated(self.turn)), self.turn.T))

    @cached_property
    def omega_in_itself(self) -> sp.ImmutableMatrix:
        """Angular velocity in the parent, components along these axes: R^T R_dot = [omega x]."""
        if self._by_parameters is not None:
            return self._by_parameters[1]
        return _axial(times(self.turn.T, sp.Matrix(3, 3, differentiated(self.turn))))

    @cached_property
    def alpha_in_parent(self) -> sp.ImmutableMatrix:
        """The rate of omega_in_parent."""
        return sp.ImmutableMatrix(3, 1, differentiated(self.omega_in_parent))

    @cached_property
    def alpha_in_itself(self) -> sp.ImmutableMatrix:
        """The rate of omega_in_itself, which is the same vector, since omega x omega = 0."""
        return sp.ImmutableMatrix(3, 1, differentiated(self.omega_in_itself))


def _axial(skew: sp.Matrix) -> sp.ImmutableMatrix:
    return sp.ImmutableMatrix(tidy(sp.Matrix([skew[2, 1], skew[0, 2], skew[1, 0]])))


def demand_frames(**given: Any) -> None:
    """Raise ArgumentError, listing all faults, for values that are no frames or are frames of different trees."""
    faults = [f"{what} is {shown(value)}; pass a frame" for what, value in given.items() if not isinstance(value, Axes)]
    if not faults:
        roots = {id(value.path[0]): value.path[0] for value in given.values()}
        if len(roots) > 1:
            result = ", ".join(f"{what} {shown(value.name)} hangs on {shown(value.path[0].name)}"
                               for what, value in given.items())
            faults = [f"frames of different trees do not know how they move relative to each other: {result}; make all frames "
                      "with .frame(...) from one first frame"]
    if faults:
        raise ArgumentError("; ".join(faults))


def links(start: Axes, end: Axes) -> Iterator[tuple[Axes, int, Axes]]:
    """The links from one frame to another: (child, +1 downwards or -1 upwards, the frame that the step leads to)."""
    common = 0
    while common < min(len(start.path), len(end.path)) and start.path[common] is end.path[common]:
        common += 1
    for child in reversed(start.path[common:]):
        yield child, -1, child.path[-2]
    for child in end.path[common:]:
        yield child, 1, child


def rotation_between(of: Axes, to: Axes) -> sp.ImmutableMatrix:
    """R, (3, 3), takes components of one frame to those of another. Raises ArgumentError."""
    demand_frames(of=of, to=to)
    R = sp.ImmutableMatrix(sp.eye(3))
    for child, sign, _ in links(of, to):
        R = times(child.turn.T if sign > 0 else child.turn, R)
    return R


def along(vector: sp.MatrixBase, given_in: Axes, components: Axes) -> sp.ImmutableMatrix:
    """A vector's components in another frame."""
    if vector.is_zero_matrix:
        return ZERO
    result = sp.ImmutableMatrix(vector)
    for child, sign, _ in links(given_in, components):
        result = times(child.turn.T if sign > 0 else child.turn, result)
    return result


def spins(start: Axes, end: Axes, components: Axes,
          order: int = 2) -> Iterator[tuple[Axes, sp.ImmutableMatrix, sp.ImmutableMatrix]]:
    """Each frame on the path with its omega and alpha seen from the start; alpha is left zero for order 1, omega for 0."""
    omega = alpha = ZERO
    yield start, omega, alpha
    for child, sign, reached in links(start, end):
        if order > 0:
            inside = child in components.path
            given_in = child if inside else child.parent
            assert given_in is not None
            w = sign * along(child.omega_in_itself if inside else child.omega_in_parent, given_in, components)
            if order > 1:
                w_rate = sign * along(child.alpha_in_itself if inside else child.alpha_in_parent, given_in, components)
                alpha = alpha + w_rate + cross(omega, w)
            omega = omega + w
        yield reached, omega, alpha


def angular_motion(seen_from: Axes, of: Axes, components: Axes, order: int = 2) -> tuple[sp.ImmutableMatrix, sp.ImmutableMatrix]:
    """omega and alpha, (3, 1), of a frame seen from another. Raises ArgumentError."""
    demand_frames(of=of, seen_from=seen_from, components=components)
    *_, (_, omega, alpha) = spins(seen_from, of, components, order)
    return omega, alpha


def point_motion(seen_from: Axes, frame: Axes, at: sp.ImmutableMatrix, components: Axes, order: int) -> list[sp.ImmutableMatrix]:
    """Position from the origin of `seen_from`, velocity and acceleration seen from there, up to an order; (3, 1) each.

    at   (3, 1) the point from the origin of `frame`, its components
    Each piece rho of the way, given in frame k, adds rho, rho' + omega_k x rho, and
    rho'' + 2 omega_k x rho' + alpha_k x rho + omega_k x (omega_k x rho).
    """
    demand_frames(frame=frame, seen_from=seen_from, components=components)
    total = [ZERO] * (order + 1)
    steps = list(links(seen_from, frame))
    for k, (carrier, omega, alpha) in enumerate(spins(seen_from, frame, components, order)):
        # The way leaves `carrier` downwards over its child's origin, or has come up to it from a child.
        pieces = [-steps[k - 1][0].shift] if k > 0 and steps[k - 1][1] < 0 else []
        pieces += [steps[k][0].shift] if k < len(steps) and steps[k][1] > 0 else []
        pieces += [at] if k == len(steps) else []
        piece = sum(pieces, ZERO)
        for n, term in enumerate(_derivatives(piece, carrier, components, omega, alpha, order)):
            total[n] = total[n] + term
    return total


def _derivatives(piece: sp.ImmutableMatrix, carrier: Axes, components: Axes, omega: sp.ImmutableMatrix,
                 alpha: sp.ImmutableMatrix, order: int) -> list[sp.ImmutableMatrix]:
    if piece.is_zero_matrix:
        return []
    rho = along(piece, carrier, components)
    result = [rho]
    if order > 0:
        speed = sp.ImmutableMatrix(3, 1, differentiated(piece))
        rho_1 = along(speed, carrier, components)
        result.append(rho_1 + cross(omega, rho))
    if order > 1:
        rho_2 = along(sp.ImmutableMatrix(3, 1, differentiated(speed)), carrier, components)
        result.append(rho_2 + 2 * cross(omega, rho_1) + cross(alpha, rho) + cross(omega, cross(omega, rho)))
    return result
