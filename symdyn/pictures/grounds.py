"""Planes of the ground that contacts have, found from where bodies touch and how far that is from the plane."""

from __future__ import annotations

import numpy as np

# A normal has the length one up to this; planes that differ by less are the same.
_UNIT = 1e-6
# Digits of a normal after the point.
_DIGITS = 9
# Numbers of a contact in `contact_gaps` before the relative velocities: its gap comes first.
_PER_CONTACT = 4

# The normal, which points to the bodies, and normal @ point of the points of the plane, m; n-frame.
Ground = tuple[np.ndarray, float]


def grounds_of(at: np.ndarray, gaps: np.ndarray, near: float) -> list[Ground]:
    """The planes that stay where they are, each once; what else contacts touch, curved or moving, is no plane.

    at     where contacts are at some configurations, (n, n_c, 3); gaps: likewise, (n, n_c), m
    near   the distance that gaps may be off, m
    """
    found: list[Ground] = []
    for places, distances in zip(at.transpose(1, 0, 2), gaps.T, strict=True):
        if len(places) < 2 or not (np.isfinite(places).all() and np.isfinite(distances).all()):
            continue
        # gap = normal @ place - level; along directions in which the places do not differ nothing is known.
        apart = places - places.mean(axis=0)
        normal = np.linalg.lstsq(apart, distances - distances.mean(), rcond=_UNIT)[0]
        levels = places @ normal - distances
        if abs(np.linalg.norm(normal) - 1.0) > _UNIT or np.ptp(levels) > near:
            continue
        normal, level = np.asarray(np.round(normal, _DIGITS) + 0.0), float(levels.mean())
        if not any(np.abs(normal - other).max() <= _UNIT and abs(level - height) <= near for other, height in found):
            found.append((normal, level))
    return found


def gaps_of(rigid: np.ndarray, compliant: np.ndarray, with_places: list[bool], widths: list[int]) -> np.ndarray:
    """Gaps of the contacts of bodies, (n, n_c): rigid ones first, in the order of `contact_points`.

    rigid, compliant   rows of `contact_gaps` and of `compliant_contacts`, (n, ...)
    with_places        of every rigid contact whether it is one of bodies; widths: numbers of every compliant one
    """
    firsts = np.cumsum([0, *widths])[:-1].astype(int)
    places = [_PER_CONTACT * k for k, there in enumerate(with_places) if there]
    return np.concatenate([rigid[:, places], compliant[:, firsts]], axis=1)
