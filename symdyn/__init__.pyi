"""The public names and their types, for editors and type checkers; see __init__.py, which imports each when it is used."""

from sympy import Symbol

from symdyn import frames as frames
from symdyn import lecture as lecture
from symdyn import rotation as rotation
from symdyn import systems as systems
from symdyn.bench.work import bench as bench
from symdyn.comparison import Case as Case
from symdyn.comparison import Erratum as Erratum
from symdyn.comparison import Formula as Formula
from symdyn.comparison import Remark as Remark
from symdyn.comparison import Slide as Slide
from symdyn.comparison import compare as compare
from symdyn.comparison import conventions as conventions
from symdyn.comparison import proofs as proofs
from symdyn.datafile.read import read_system as read_system
from symdyn.datafile.schema import data_file_schema as data_file_schema
from symdyn.ensembles import Ensemble as Ensemble
from symdyn.ensembles import Samples as Samples
from symdyn.ensembles import ensemble as ensemble
from symdyn.errors import (
    ArgumentError as ArgumentError,
)
from symdyn.errors import (
    CacheError as CacheError,
)
from symdyn.errors import (
    CacheWarning as CacheWarning,
)
from symdyn.errors import (
    CaseError as CaseError,
)
from symdyn.errors import (
    CompileError as CompileError,
)
from symdyn.errors import (
    CompilerNotFound as CompilerNotFound,
)
from symdyn.errors import (
    CompilerWarning as CompilerWarning,
)
from symdyn.errors import (
    EnsembleStopped as EnsembleStopped,
)
from symdyn.errors import (
    EquilibriumNotUnique as EquilibriumNotUnique,
)
from symdyn.errors import (
    EvaluationError as EvaluationError,
)
from symdyn.errors import (
    EvaluationWarning as EvaluationWarning,
)
from symdyn.errors import (
    GimbalLock as GimbalLock,
)
from symdyn.errors import (
    MissingExtra as MissingExtra,
)
from symdyn.errors import (
    ModelError as ModelError,
)
from symdyn.errors import (
    ModelWarning as ModelWarning,
)
from symdyn.errors import (
    NoEquilibrium as NoEquilibrium,
)
from symdyn.errors import (
    NoOptimum as NoOptimum,
)
from symdyn.errors import (
    NotARotation as NotARotation,
)
from symdyn.errors import (
    NotNormalized as NotNormalized,
)
from symdyn.errors import (
    OptimumWarning as OptimumWarning,
)
from symdyn.errors import (
    RotationError as RotationError,
)
from symdyn.errors import (
    SimulationInterrupted as SimulationInterrupted,
)
from symdyn.errors import (
    SimulationWarning as SimulationWarning,
)
from symdyn.errors import (
    SymdynError as SymdynError,
)
from symdyn.errors import (
    UnknownCase as UnknownCase,
)
from symdyn.errors import (
    UnsupportedExpression as UnsupportedExpression,
)
from symdyn.errors import (
    ZeroAxis as ZeroAxis,
)
from symdyn.estimation import Experiment as Experiment
from symdyn.estimation import Fit as Fit
from symdyn.estimation import Identification as Identification
from symdyn.estimation import MeasuredMotion as MeasuredMotion
from symdyn.estimation import fit as fit
from symdyn.estimation import identify as identify
from symdyn.exact.prove import prove as prove
from symdyn.flexible.beam import Beam as Beam
from symdyn.flexible.shape import Shape as Shape
from symdyn.formulation.by_hand.augmented import augmented as augmented
from symdyn.formulation.by_hand.embedding import embedding as embedding
from symdyn.frames import Frame as Frame
from symdyn.frames import rate as rate
from symdyn.mjcf.read import read_mjcf as read_mjcf
from symdyn.model import contacts as contacts
from symdyn.model import shapes as shapes
from symdyn.model.closures import Gear as Gear
from symdyn.model.closures import Rod as Rod
from symdyn.model.contacts.contact import Contact as Contact
from symdyn.model.contacts.group import ContactGroup as ContactGroup
from symdyn.model.contacts.joints import Backlash as Backlash
from symdyn.model.contacts.joints import JointFriction as JointFriction
from symdyn.model.contacts.joints import OneWayClutch as OneWayClutch
from symdyn.model.contacts.joints import Rope as Rope
from symdyn.model.contacts.joints import Stop as Stop
from symdyn.model.elements import (
    Box as Box,
)
from symdyn.model.elements import (
    Buoyancy as Buoyancy,
)
from symdyn.model.elements import (
    Drag as Drag,
)
from symdyn.model.elements import (
    LinearDamping as LinearDamping,
)
from symdyn.model.elements import (
    LinearStiffness as LinearStiffness,
)
from symdyn.model.elements import (
    MooringLine as MooringLine,
)
from symdyn.model.elements import (
    Thrust as Thrust,
)
from symdyn.model.elements import (
    WaveExcitation as WaveExcitation,
)
from symdyn.model.elements.added_mass import AddedMass as AddedMass
from symdyn.model.external import External as External
from symdyn.model.joints import (
    Custom as Custom,
)
from symdyn.model.joints import (
    Cylindrical as Cylindrical,
)
from symdyn.model.joints import (
    Fixed as Fixed,
)
from symdyn.model.joints import (
    Free as Free,
)
from symdyn.model.joints import (
    Helical as Helical,
)
from symdyn.model.joints import (
    Planar as Planar,
)
from symdyn.model.joints import (
    Prismatic as Prismatic,
)
from symdyn.model.joints import (
    Revolute as Revolute,
)
from symdyn.model.joints import (
    Spherical as Spherical,
)
from symdyn.model.joints import (
    Universal as Universal,
)
from symdyn.model.orientation import EulerAngles as EulerAngles
from symdyn.model.orientation import EulerParameters as EulerParameters
from symdyn.model.points import (
    acceleration as acceleration,
)
from symdyn.model.points import (
    bias_acceleration as bias_acceleration,
)
from symdyn.model.points import (
    jacobian as jacobian,
)
from symdyn.model.points import (
    position as position,
)
from symdyn.model.points import (
    velocity as velocity,
)
from symdyn.model.quantity import (
    angular_velocity as angular_velocity,
)
from symdyn.model.quantity import (
    distance as distance,
)
from symdyn.model.quantity import (
    multiplier as multiplier,
)
from symdyn.model.quantity import (
    reaction as reaction,
)
from symdyn.model.quantity import (
    rotation_matrix as rotation_matrix,
)
from symdyn.model.symbols import (
    coordinates as coordinates,
)
from symdyn.model.symbols import (
    inputs as inputs,
)
from symdyn.model.symbols import (
    motions as motions,
)
from symdyn.model.symbols import (
    parameters as parameters,
)
from symdyn.model.symbols import (
    partial_rate as partial_rate,
)
from symdyn.model.symbols import (
    speeds as speeds,
)
from symdyn.model.system import System as System
from symdyn.optimal import Optimum as Optimum
from symdyn.optimal import Tracking as Tracking
from symdyn.optimal import optimize as optimize
from symdyn.overview.page import full_report as full_report
from symdyn.report.latex import latex as latex
from symdyn.runtime.inputs.inputs import Smooth as Smooth
from symdyn.runtime.inputs.sampled import Sampled as Sampled
from symdyn.runtime.inputs.tables import Table as Table
from symdyn.runtime.losses import Loss as Loss
from symdyn.sdf.read import read_sdf as read_sdf
from symdyn.stress.run import stress as stress
from symdyn.sympy_mechanics.border import from_sympy as from_sympy
from symdyn.sympy_mechanics.system import from_system as from_system
from symdyn.urdf.read import read_urdf as read_urdf
from symdyn.viewer.page import View as View

__version__: str
t: Symbol
