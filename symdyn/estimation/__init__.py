"""Parameters from measured motions."""

from symdyn.estimation.experiment import Experiment
from symdyn.estimation.fit import fit
from symdyn.estimation.result import Fit

__all__ = ["Experiment", "Fit", "fit"]
