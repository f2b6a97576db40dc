"""Parameters from measured motions."""

from symdyn.estimation.experiment import Experiment
from symdyn.estimation.fit import fit
from symdyn.estimation.identification import Identification
from symdyn.estimation.identify import identify
from symdyn.estimation.measured_motion import MeasuredMotion
from symdyn.estimation.result import Fit

__all__ = ["Experiment", "Fit", "Identification", "MeasuredMotion", "fit", "identify"]
