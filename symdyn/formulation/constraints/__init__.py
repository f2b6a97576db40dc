"""Constraints: their rows, motion under them, absolute coordinates, and the solvers for accelerations and multipliers."""
