"""Faults and special cases of the constraints of a mechanism: System.diagnose."""

from symdyn.diagnosis.examine import diagnose
from symdyn.diagnosis.result import Dependency, Diagnosis, SingularState

__all__ = ["Dependency", "Diagnosis", "SingularState", "diagnose"]
