"""Mechanisms that are well known among users of SymPy's and PyDy's, derived by sympy.physics.mechanics after their published "
"descriptions."""

from symdyn.lab.sympy_models.example import Example
from symdyn.lab.sympy_models.examples import EXAMPLES

__all__ = ["EXAMPLES", "Example"]
