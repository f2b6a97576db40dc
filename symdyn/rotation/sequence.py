"""The twelve Euler sequences: their axes, their kind, and where each locks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import sympy as sp

from symdyn.errors import ArgumentError
from symdyn.model.orientation import SEQUENCES
from symdyn.shown import shown

_OF_AXIS = {"X": "phi", "Y": "theta", "Z": "psi"}


class Lock(NamedTuple):
    """Angles at which a sequence locks.

    sequence   its name
    second     the two values of the second angle in (-pi, pi], rad, SymPy numbers
    fixed      what is fixed at each: the sum or the difference of the first and third angle

    >>> lock = sd.rotation.gimbal_lock("ZXZ")
    >>> lock.sequence, lock.second
    ('ZXZ', (0, pi))
    >>> lock.fixed
    ('phi + psi', 'phi - psi')
    """

    sequence: str
    second: tuple[Any, Any]
    fixed: tuple[str, str]

    def __repr__(self) -> str:
        name = EulerSequence(self.sequence).names[1]
        return f"{self.sequence} locks at " + " and at ".join(
            f"{name} = {angle}, where only {fixed} is fixed" for angle, fixed in zip(self.second, self.fixed, strict=True))


@dataclass(frozen=True)
class EulerSequence:
    """R = R_i(a) R_j(b) R_k(c), body axes i, j, k as numbers; l is the axis that is neither i nor j."""

    name: str

    @property
    def axes(self) -> tuple[int, int, int]:
        """i, j, k."""
        i, j, k = ("XYZ".index(letter) for letter in self.name)
        return i, j, k

    @property
    def remaining(self) -> int:
        """l."""
        i, j, _ = self.axes
        return 3 - i - j

    @property
    def sign(self) -> int:
        """1 if (i, j, l) is right-handed, -1 if not."""
        i, j, _ = self.axes
        return 1 if (j - i) % 3 == 1 else -1

    @property
    def proper(self) -> bool:
        """Whether the third axis is the first again (proper Euler angles), rather than the remaining one (Tait-Bryan)."""
        return self.name[0] == self.name[2]

    @property
    def names(self) -> tuple[str, str, str]:
        """Letters of the angles: phi about X, theta about Y, psi about Z; of a proper sequence phi, theta, psi in its order."""
        if self.proper:
            return "phi", "theta", "psi"
        a, b, c = (_OF_AXIS[letter] for letter in self.name)
        return a, b, c

    def fixed(self, sign: int) -> str:
        """The sum (sign 1) or difference (-1) of the first and third angle."""
        first, _, third = self.names
        return f"{first} {'+' if sign > 0 else '-'} {third}"


def sequence_of(name: Any) -> EulerSequence:
    """The sequence of that name, or ArgumentError."""
    if isinstance(name, str) and name in SEQUENCES:
        return EulerSequence(name)
    hint = "; letters are capitals: the axes are those of the body" if isinstance(name, str) and name.upper() in SEQUENCES else ""
    raise ArgumentError(f"there is no Euler sequence {shown(name)}; the twelve are {', '.join(SEQUENCES)}{hint}")


def gimbal_lock(sequence: str) -> Lock:
    """Find where a sequence locks: `.second`, the two values of its second angle, and `.fixed`, what R fixes there.

    At these angles the first and third axis are parallel: R depends on the sum or the difference of the two angles alone,
    and G has no inverse. Tait-Bryan sequences lock at -pi/2 and pi/2, proper ones at 0 and pi.
    Raises ArgumentError for anything but one of the twelve sequences. Source: lecture, chapter 4.3.

    >>> sd.rotation.gimbal_lock("ZYX")
    ZYX locks at theta = -pi/2, where only psi + phi is fixed and at theta = pi/2, where only psi - phi is fixed
    """
    of = sequence_of(sequence)
    if of.proper:
        return Lock(of.name, (sp.S.Zero, sp.pi), (of.fixed(1), of.fixed(-1)))
    return Lock(of.name, (-sp.pi / 2, sp.pi / 2), (of.fixed(-of.sign), of.fixed(of.sign)))
