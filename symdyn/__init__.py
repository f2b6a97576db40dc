"""symdyn: equations of motion of multibody systems, derived symbolically and run as fast as the processor allows.

The public names; each is imported when it is first used, so that `import symdyn` costs next to nothing.
Examples begin with `import symdyn as sd`, `import numpy as np`, `import sympy as sp`.
"""

# Editors offer what stands here without an underscore.
import importlib as _importlib
from typing import Any as _Any

__version__ = "0.1.0"

_HOME = {
    "symdyn.model.symbols": ("coordinates", "inputs", "motions", "parameters", "partial_rate", "speeds"),
    "symdyn.model.points": ("acceleration", "bias_acceleration", "jacobian", "position", "velocity"),
    "symdyn.model.quantity": ("angular_velocity", "distance", "multiplier", "reaction", "rotation_matrix"),
    "symdyn.model.joints": ("Custom", "Cylindrical", "Fixed", "Free", "Helical", "Planar", "Prismatic", "Revolute",
                            "Spherical", "Universal"),
    "symdyn.model.elements.added_mass": ("AddedMass",),
    "symdyn.model.closures": ("Gear", "Rod"),
    "symdyn.model.contacts.contact": ("Contact",),
    "symdyn.model.contacts.group": ("ContactGroup",),
    "symdyn.model.contacts.joints": ("Backlash", "JointFriction", "OneWayClutch", "Rope", "Stop"),
    "symdyn.model.elements": ("Box", "Buoyancy", "Drag", "LinearDamping", "LinearStiffness", "MooringLine", "Thrust",
                              "WaveExcitation"),
    "symdyn.model.orientation": ("EulerAngles", "EulerParameters"),
    "symdyn.model.external": ("External",),
    "symdyn.runtime.inputs.inputs": ("Smooth",),
    "symdyn.model.system": ("System",),
    "symdyn.runtime.losses": ("Loss",),
    "symdyn.runtime.inputs.sampled": ("Sampled",),
    "symdyn.formulation.by_hand.embedding": ("embedding",),
    "symdyn.formulation.by_hand.augmented": ("augmented",),
    "symdyn.exact.prove": ("prove",),
    "symdyn.overview.page": ("full_report",),
    "symdyn.viewer.page": ("View",),
    "symdyn.report.latex": ("latex",),
    "symdyn.flexible.beam": ("Beam",),
    "symdyn.flexible.shape": ("Shape",),
    "symdyn.frames": ("Frame", "rate"),
    "symdyn.mjcf.read": ("read_mjcf",),
    "symdyn.sdf.read": ("read_sdf",),
    "symdyn.urdf.read": ("read_urdf",),
    "symdyn.datafile.read": ("read_system",),
    "symdyn.datafile.schema": ("data_file_schema",),
    "symdyn.sympy_mechanics.border": ("from_sympy",),
    "symdyn.sympy_mechanics.system": ("from_system",),
    "symdyn.comparison": ("Case", "Erratum", "Formula", "Remark", "Slide", "compare"),
    "symdyn.ensembles": ("Ensemble", "Samples", "ensemble"),
    "symdyn.estimation": ("Experiment", "Fit", "Identification", "MeasuredMotion", "fit", "identify"),
    "symdyn.optimal": ("Optimum", "Tracking", "optimize"),
    "symdyn.runtime.inputs.tables": ("Table",),
    "symdyn.errors": ("ArgumentError", "CacheError", "CacheWarning", "CaseError", "CompileError", "CompilerNotFound",
                      "CompilerWarning", "EnsembleStopped", "EquilibriumNotUnique", "EvaluationError", "EvaluationWarning",
                      "GimbalLock", "MissingExtra", "ModelError", "ModelWarning", "NoEquilibrium", "NoOptimum",
                      "NotARotation", "NotNormalized", "OptimumWarning", "RotationError", "SimulationInterrupted",
                      "SimulationWarning", "SymdynError", "UnknownCase", "UnsupportedExpression", "ZeroAxis"),
}
_WHERE = {name: module for module, names in _HOME.items() for name in names}
_PACKAGES = {name: f"symdyn.{name}" for name in ("bench", "frames", "lecture", "rotation", "stress", "systems")} | {
    name: f"symdyn.comparison.{name}" for name in ("conventions", "proofs")} | {
    "contacts": "symdyn.model.contacts", "shapes": "symdyn.model.shapes"}

__all__ = [*_WHERE, *_PACKAGES, "t"]


def __getattr__(name: str) -> _Any:
    if name == "t":
        return _importlib.import_module("symdyn.model.symbols").time
    if name in _PACKAGES:
        return _importlib.import_module(_PACKAGES[name])
    if name in _WHERE:
        return getattr(_importlib.import_module(_WHERE[name]), name)
    raise AttributeError(f"symdyn has no {name!r}; it has {', '.join(sorted(__all__))}")


def __dir__() -> list[str]:
    return sorted(__all__)
