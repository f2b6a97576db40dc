"""Optimal motions."""

from symdyn.optimal.optimize import optimize
from symdyn.optimal.result import Optimum
from symdyn.optimal.tracking import Tracking

__all__ = ["Optimum", "Tracking", "optimize"]
