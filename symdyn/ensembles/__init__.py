"""Ensembles: many motions of one mechanism, over cores and machines, restartable, with results on the disk as they come."""

from __future__ import annotations

from symdyn.ensembles.result import Ensemble
from symdyn.ensembles.run import ensemble
from symdyn.ensembles.samples import Samples

__all__ = ["Ensemble", "Samples", "ensemble"]
