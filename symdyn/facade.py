"""Facade of a system and its equations: the methods that lead to other parts of the package, in one place.

The classes describe and record; these methods name what comes of it. They import it when they are called, since it stands in
later rows of the table of imports (docs/architecture.md).
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np
import sympy as sp

from symdyn.errors import MissingExtra

if TYPE_CHECKING:
    import casadi
    import jax
    import torch

    from symdyn.analytic.conserved import ConservedQuantities
    from symdyn.analytic.equilibria import EquilibriumPoints
    from symdyn.analytic.linear import Linearized
    from symdyn.analytic.units import UnitReport
    from symdyn.diagnosis import Diagnosis
    from symdyn.exact.mechanism import Proofs
    from symdyn.formulation.equations import Equations
    from symdyn.formulation.identification.quantities import BaseParameters
    from symdyn.formulation.printed.augmented import AugmentedEquations
    from symdyn.formulation.printed.independent_speeds import MotionEquations
    from symdyn.formulation.printed.provenance import Explanation
    from symdyn.formulation.trees.embedding import EmbeddedEquations
    from symdyn.formulation.trees.recursive import RecursiveEquations
    from symdyn.given import Named, Names, Numbers, PathName, Rolling, Scalar, Values
    from symdyn.model.orientation import EulerAngles, EulerParameters
    from symdyn.model.system import System
    from symdyn.report.latex import Typeset
    from symdyn.runtime.module import Module
    from symdyn.sympy_mechanics.back import SympyEquations
    from symdyn.verification import Verification
    from symdyn.viewer import View


def _system(facade: SystemFacade) -> System:
    return cast("System", facade)


def _equations(facade: EquationsFacade) -> Equations:
    return cast("Equations", facade)


def _motion(facade: MotionFacade) -> MotionEquations:
    return cast("MotionEquations", facade)


class SystemFacade:
    """Results of a described mechanism: equations, modules, pictures and files."""

    def embedding(self, frames: str = "body") -> EmbeddedEquations:
        """The embedded equations M_tilde u_dot + k_tilde = F_tilde: mass matrix by composite bodies, factorized.

        frames   the axes that quantities are formed in: "body", each link's own, or "parallel", those of the link before
                 where axes stay parallel
        Raises ModelError with every fault found.

        >>> sd.systems.pendulum().embedding().k_tilde
        Matrix([[0]])
        """
        from symdyn.formulation.trees.embedding import embed

        return embed(_system(self).check(), frames)

    def recursive(self, frames: str = "body") -> RecursiveEquations:
        """The recursive equations: inverse dynamics by Newton-Euler, accelerations by articulated bodies, both O(n).

        frames   as for `embedding`
        Raises ModelError with every fault found.

        >>> sd.systems.pendulum().recursive().link("bob").I
        Matrix([
        [l**2*m, 0,      0,   0, 0, -l*m],
        [     0, 0,      0,   0, 0,    0],
        [     0, 0, l**2*m, l*m, 0,    0],
        [     0, 0,    l*m,   m, 0,    0],
        [     0, 0,      0,   0, m,    0],
        [  -l*m, 0,      0,   0, 0,    m]])
        """
        from symdyn.formulation.trees.recursive import recursive

        return recursive(_system(self).check(), frames)

    def augmented(self, coordinates: str = "relative", orientation: EulerAngles | EulerParameters | None = None,
                  frames: str = "parallel") -> AugmentedEquations:
        """The augmented equations M u_dot + C_r^T lam = F - k, C_r u_dot = F_d with multipliers lam.

        coordinates   "relative": the tree as it is, constraints close its loops; "absolute": every body has coordinates of
                      its own (planar x, y, theta; spatial x, y, z of its origin and its orientation in the n-frame), and every
                      joint becomes constraints; joints that are driven, geared or used in expressions keep their coordinates
                      besides
        orientation   of the bodies in absolute coordinates: EulerParameters(), the default, or EulerAngles(...)
        frames        as for `embedding`; parallel ones, where there are any, print F_d in absolute angles
        Raises ModelError with every fault found, and for constraints that cannot hold or move nothing; SymdynError for an
        orientation that nothing takes: in relative coordinates or in a plane.

        >>> sd.systems.pendulum().augmented(coordinates="absolute").constraints
        ('pivot_x', 'pivot_y')
        """
        from symdyn.formulation.constraints.augmented import augment

        return augment(_system(self).check(), coordinates, orientation, frames)

    def diagnose(self, q: Values | None = None, params: Values | None = None, t: float = 0.0, coordinates: str = "relative",
                 reach: float = math.pi) -> Diagnosis:
        """Examine the constraints: freedoms, redundant and contradictory constraints, singular configurations, idle motions.

        q             coordinates of the state to look at, in order, or by symbol or name; what is left out takes its initial
                      value; the nearest consistent state is taken
        params        numbers for parameters; others take their default, those without one a random number, which is reported
        t             time, s; coordinates: as for `augmented`
        reach         how far from the state singular configurations are looked for, along up to six independent motions both
                      ways: change of the fastest speed's coordinate, rad or parts of the mechanism's length
        Returns a Diagnosis, which prints as text. Raises ModelError for a description with faults; contradictory constraints
        are listed in the diagnosis.

        >>> print(sd.systems.pendulum().diagnose())
        pendulum: diagnosis of the constraints
          no loops or constraints: 1 degree of freedom
        """
        from symdyn.diagnosis import diagnose

        return diagnose(_system(self), q, params, t, coordinates, reach)

    def equations(self, tune: bool = False) -> MotionEquations:
        """The equations in the formulation that computes accelerations in the least predicted time; of a system with loops or
        constraints the augmented ones in relative coordinates.

        tune   compile the candidates and time them, instead of predicting from their operations
        The result's `candidates` lists what it was chosen from. Raises ModelError with every fault found.

        >>> sd.systems.pendulum().equations().formulation
        'embedding'
        """
        from symdyn.choice import choose

        return choose(_system(self).check(), tune)

    def compile(self, backend: str | None = None, tune: bool = False, templates: str | os.PathLike[str] | None = None,
                specialize: Numbers | None = None, rolled: Rolling = "auto") -> Module:
        """A numeric module of `equations(tune)`.

        backend      "c" or "numpy"; default: C if a compiler is found, else NumPy, and `module.fallback` says why
        templates    folder whose templates take precedence
        specialize   parameters, by symbol or name, that become numbers in the code and are folded
        rolled       C only: whether statements that like bodies repeat become loops: "auto" where they are many, True, False

        Raises what `equations` raises, CompilerNotFound if C is requested and there is no compiler, CompileError if it rejects
        the code, SymdynError for loops with the backend "numpy", which has none.

        >>> sd.systems.pendulum().compile(backend="numpy").rhs(0.0, [0.1, 0.0]).round(6)
        array([ 0.      , -0.979366])
        """
        return self.equations(tune).compile(backend, templates, specialize, rolled)

    def show(self, path: str | Path | None = None, params: Numbers | None = None, q: Values | None = None) -> View:
        """The mechanism to look at before anything is simulated: a page that turns and zooms, with a slider for every coordinate,
        and for every parameter that moves something. Its kinematics run in the page; loops are closed there by Newton's method.

        path     where to write it, one HTML file that needs no network; in a notebook the result shows itself
        params   numbers for parameters, by symbol or name; others take their default, those without one 1, which the page notes
        q        coordinates to begin with, in order, or by symbol or name; others take their initial value
        Raises ArgumentError for points that are not finite there, for kinematics that cannot run in a page, and for another
        ending than .html; ModelError for a description with faults; MissingExtra without matplotlib.

        >>> import tempfile
        >>> sd.systems.two_link_arm().show(f"{tempfile.mkdtemp()}/arm.html").name
        'two_link_arm'
        """
        from symdyn.viewer import show

        return show(_system(self), path, params, q)

    def to_urdf(self, path: str | Path) -> Path:
        """Write a tree of fixed, revolute and prismatic joints as a URDF file, with the parameters' default numbers.

        Numbers read back to the last bit (angles of a frame: to rounding), with the same names; what `sd.read_urdf` made is read
        back equal. Links have their frames at their joints, as the format has it; the root link is the one body that a Fixed
        joint holds at the ground's frame, else a link "world". Joints without limits are written as continuous, dependent
        coordinates as <mimic>, damping forces of joints as <dynamics>. Gravity (a ModelWarning says where it is not what
        `sd.read_urdf` takes), drives by inputs, outputs and shapes have no place in it. Returns the path.

        Raises ModelError with all faults: of the description, what a URDF has no words for, parameters without a number, and a
        file that cannot be written; ArgumentError for a path that is none.

        >>> import tempfile
        >>> folder = tempfile.mkdtemp()
        >>> system = sd.System("slider", gravity=[0, 0, -9.81])
        >>> joint = system.add_joint(sd.Prismatic("rail", system.ground, system.add_body("block", mass=1), axis=[1, 0, 0]))
        >>> system.to_urdf(f"{folder}/chain.urdf").name
        'chain.urdf'
        """
        from symdyn.urdf.write import write_urdf

        return write_urdf(_system(self).check(), path)

    def to_mjcf(self, path: str | Path) -> Path:
        """Write the mechanism as a model of MuJoCo's (MJCF), with the parameters' default numbers.

        Fixed, revolute, prismatic, universal, planar, cylindrical, spherical and free joints are written; those with Euler angles
        as one slide or hinge a coordinate. Loops by fixed, revolute and spherical joints, gears, constraints y = polynomial of x
        and dependent coordinates become equality constraints, which are soft in MuJoCo. Forces along joints that are linear in
        their coordinate, speed and inputs, springs and dampers between points, and forces between points become stiffness,
        damping,
        tendons and motors. Bodies without mass between joints vanish; a body on the ground that another joint's coordinate moves
        is its armature. Initial values become the keyframe "initial"; outputs and shapes have no part in it. Coordinates have the
        same order and meaning; the speeds, too, but those of Free joints with velocity="body". Returns the path.

        Raises ModelError with all faults: of the description, what MJCF has no words for, moving bodies that MuJoCo rejects,
        parameters without a number, and a file that cannot be written; ArgumentError for a path that is none.

        >>> import tempfile
        >>> sd.systems.spatial_chain(3).to_mjcf(f"{tempfile.mkdtemp()}/chain.xml").name
        'chain.xml'
        """
        from symdyn.mjcf.write import write_mjcf

        return write_mjcf(_system(self).check(), path)

    def to_toml(self, path: str | Path | None = None) -> str:
        """The description as a data file in TOML, which `sd.read_system` makes an equal system of: the same generated code.

        path   where to write it, a file that ends in .toml; default: nowhere
        Returns the text. Every element is written, with symbols, numbers and units; expressions as texts that a strict parser
        reads back. Raises ModelError with all faults: of the description, functions of the user (sd.External), which are
        programs, and whatever else a data file has no words for; ArgumentError for another ending.

        >>> print(sd.systems.pendulum().to_toml().splitlines()[2])
        name = "pendulum"
        """
        from symdyn.datafile.write import write_system

        return write_system(_system(self), path)

    def _repr_html_(self) -> str | None:
        """A small picture and tables, in a notebook; the text of `repr` without matplotlib."""
        try:
            from symdyn.viewer.summary import summary_of
        except MissingExtra:
            return None
        return summary_of(_system(self))


class EquationsFacade:
    """Results of equations: prints, modules, proofs, functions for other libraries."""

    def latex(self, name: str, shorthand: bool = False, intermediates: bool = False, width: int = 80,
              simplify: bool = True) -> Typeset:
        """A quantity in LaTeX as the lecture writes it; prints and shows in notebooks.

        shorthand       s_1 for sin q_1, c_12 for cos(q_1 + q_2), with a legend
        intermediates   steps that the derivation names (velocities, forces, inertias of links) stand before the quantity
        width           letters in a line: wider matrices get named entries below them, longer sums several lines

        >>> equations = sd.systems.pendulum().embedding()
        >>> print(equations.latex("M_tilde"))
        \\tilde{\\mathbf{M}} = \\left[\\begin{matrix}l^{2} m\\end{matrix}\\right]
        """
        from symdyn.report.latex import equations_latex

        return equations_latex(_equations(self), name, shorthand, intermediates, width, simplify)

    def lambdify(self, name: str) -> Callable[..., np.ndarray]:
        """One quantity, such as "M_tilde", as a NumPy function f(q, u, params, t=0, inputs=(), ud=()).

        It takes one state or arrays of states; params as everywhere in Module. Raises SymdynError for an unknown name.

        >>> equations = sd.systems.pendulum().embedding()
        >>> equations.lambdify("M_tilde")([0.1], params=[1.0, 1.0, 9.81]).shape
        (1, 1)
        """
        return self.compile(backend="numpy").function(name)

    def compile(self, backend: str | None = None, templates: str | os.PathLike[str] | None = None,
                specialize: Numbers | None = None, rolled: Rolling = "auto") -> Module:
        """A numeric module.

        backend      "c" or "numpy"; default: C if a compiler is found, else NumPy, and `module.fallback` says why
        templates    folder whose templates take precedence
        specialize   parameters, by symbol or name, that become numbers in the code and are folded
        rolled       C only: whether statements that like bodies repeat become loops: "auto" where they are many, True, False;
                     `module.report` says which

        Raises CompilerNotFound if C is requested and there is no compiler, CompileError if it rejects the code, SymdynError for
        loops with the backend "numpy", which has none.

        >>> equations = sd.systems.pendulum().embedding()
        >>> equations.compile(backend="numpy").name
        'pendulum'
        """
        from symdyn.pipeline import compile_equations

        return compile_equations(_equations(self), backend, templates, specialize, rolled)

    def write(self, folder: str | os.PathLike[str], backend: str = "c", functions: Sequence[str] | None = None,
              templates: str | os.PathLike[str] | None = None, specialize: Numbers | None = None,
              integrator: bool = True, work: bool = False, baumgarte: bool = False, batch: bool = False,
              method: str = "dop853") -> list[Path]:
        """Write generated files that stand alone into a folder; returns their paths. No compiler is needed.

        backend      "c", "numpy", "fortran", "julia", "matlab", "rust", or one of your own templates
        functions    names of what is written; default: the usual ones that the formulation has
        templates    folder whose templates take precedence
        specialize   parameters, by symbol or name, that become numbers in the code and are folded
        integrator   C only: with an integrator of rhs, by the compiled method of this name: `method`
        work         rhs gets one more state at the end: the work of all loads but gravity and springs
        baumgarte    rhs is stabilized by Baumgarte's method, with one more parameter at the end: its gain, 1/s
        batch        C only: also rhs and integrator of many states at once, a state in each SIMD lane

        Raises SymdynError for an unknown function, parameter, backend or method, or a broken template.

        >>> import tempfile
        >>> equations = sd.systems.pendulum().embedding()
        >>> sorted(path.name for path in equations.write(tempfile.mkdtemp(), backend="numpy"))
        ['pendulum.py']
        """
        from symdyn.pipeline import emit, write_source
        from symdyn.runtime.paths import as_path, writing

        target = as_path(folder, "of the folder to write to", "generated/arm")
        source = emit(_equations(self), backend, functions, templates, integrator=integrator, specialize=specialize, work=work,
                      baumgarte=baumgarte, batch=batch, method=method)
        with writing(target):
            return write_source(source, target)

    def base_parameters(self) -> BaseParameters:
        """The smallest set of inertial parameters that the equations depend on.

        See symdyn.formulation.identification.quantities.

        >>> equations = sd.systems.pendulum().embedding()
        >>> equations.base_parameters()
        <2 base parameters of pendulum>
        """
        from symdyn.formulation.identification.quantities import base_parameters

        return base_parameters(_equations(self))

    def verify(self, states: int = 5, digits: int = 30, params: Numbers | None = None) -> Verification:
        """Prove the equations sound by identities at random states; see symdyn.verification.verify.

        >>> equations = sd.systems.pendulum().embedding()
        >>> equations.verify(states=2).passed
        True
        """
        from symdyn.verification import verify

        return verify(_equations(self), states, digits, params)

    def prove(self, other: Equations | None = None) -> Proofs:
        """Decide identities of the equations by exact algebra, for every state; see symdyn.exact.mechanism.

        other   equations of the same mechanism that were derived separately, in the same coordinates: whether both are the same;
                see symdyn.exact.across
        Returns the claims, each with its Proof. Raises ArgumentError for equations in other coordinates, speeds or constraints.

        >>> equations = sd.systems.pendulum().embedding()
        >>> equations.prove().proved
        True
        """
        if other is not None:
            from symdyn.exact.across import prove_equal

            return prove_equal(_equations(self), other)
        from symdyn.exact.mechanism import prove_equations

        return prove_equations(_equations(self))

    def to_casadi(self, name: str = "rhs", specialize: Numbers | None = None) -> casadi.Function:
        """A function of the equations, such as "rhs", as a casadi.Function f(t, x, params, inputs), with exact derivatives.

        name         of a function of a module; those of accelerations, such as "inverse_dynamics", take ud as well
        specialize   parameters, by symbol or name, that become numbers

        x, params and inputs are columns in the order of a module's (`module.default_parameters` has the defaults so; that of
        system.defaults may be another); the result is NaN where a module raises. Raises MissingExtra without CasADi, SymdynError
        for a function that the equations do not have.

        >>> f = sd.systems.pendulum().embedding().to_casadi("rhs")
        >>> f
        Function(rhs:(t,x[2],params[3],inputs[0])->(rhs[2]) SXFunction)
        """
        from symdyn.targets.functions import casadi_function

        return casadi_function(_equations(self), name, specialize)

    def to_jax(self, name: str = "rhs", dtype: str = "float64", through: str = "xla", unroll: bool | None = None,
               specialize: Numbers | None = None) -> Callable[..., jax.Array]:
        """A function of the equations as f(t, x, params=None, inputs=None, ud=()) for JAX: jit, vmap, grad, jacobian.

        dtype      "float64" (needs JAX's jax_enable_x64) or "float32"
        through    "xla": statements that XLA compiles; "c": the compiled C library, which XLA calls on a CPU
        unroll     of "xla": True: XLA gets the statements one by one; False: as a table that a loop goes through; None: as is
                   faster on the device
        specialize   parameters, by symbol or name, that become numbers

        One state x (n_x,), params and inputs in order or by name; jax.vmap takes many. Derivatives are symdyn's own. The result
        is NaN where a module raises. Raises MissingExtra without JAX, SymdynError for a function that the equations do not have,
        ArgumentError for float64 while JAX computes in float32.

        >>> import jax                                                         # doctest: +SKIP
        >>> jax.config.update("jax_enable_x64", True)                          # doctest: +SKIP
        >>> f = sd.systems.pendulum().embedding().to_jax("rhs")                # doctest: +SKIP
        >>> f(0.0, [0.1, 0.0]).shape                                           # doctest: +SKIP
        (2,)
        """
        from symdyn.targets.jax_function import jax_function

        return jax_function(_equations(self), name, dtype, through, unroll, specialize)

    def to_cmake(self, folder: PathName, jacobian: bool = False, specialize: Numbers | None = None) -> list[Path]:
        """Write a CMake package for firmware and C++ into a folder; returns the paths of its files.

        jacobian     whether it has the exact derivatives of the right-hand side, jacobian_x and jacobian_inputs
        specialize   parameters, by symbol or name, that become numbers

        The package has C99 sources, a header for C++17 with spans of fixed sizes, a self-test, and a README.md with the stack
        that functions take. Numbers are double or, by the option NAME_REAL of CMake, float; nothing is allocated, nothing is
        global; steps have a fixed length and always the same work.
        Raises ArgumentError for events and rigid contacts, which such steps do not look for.

        >>> import tempfile
        >>> paths = sd.systems.pendulum().embedding().to_cmake(tempfile.mkdtemp())
        >>> sorted(path.name for path in paths)[:3]
        ['CMakeLists.txt', 'README.md', 'clock.h']
        """
        from symdyn.targets.cmake import write_cmake

        return write_cmake(_equations(self), folder, jacobian, specialize)

    def to_torch(self, name: str = "rhs", dtype: str = "float64",
                 specialize: Numbers | None = None) -> Callable[..., torch.Tensor]:
        """A function of the equations as f(t, x, params=None, inputs=None, ud=None) for PyTorch, with exact derivatives.

        dtype        "float64" or "float32"
        specialize   parameters, by symbol or name, that become numbers

        One state x (n_x,) or many (..., n_x); arguments broadcast, params also by name. The result is NaN where a module raises.
        Raises MissingExtra without PyTorch, SymdynError for a function that the equations do not have.

        >>> import torch                                                       # doctest: +SKIP
        >>> f = sd.systems.pendulum().embedding().to_torch("rhs")              # doctest: +SKIP
        >>> f(0.0, torch.zeros(100, 2)).shape                                  # doctest: +SKIP
        torch.Size([100, 2])
        """
        from symdyn.targets.functions import torch_function

        return torch_function(_equations(self), name, dtype, specialize)

    def to_sympy(self, simplify: bool = True) -> SympyEquations:
        """The equations in SymPy's terms: functions of time, mass matrix and forcing under the names that KanesMethod has.

        simplify   False: matrices as they were derived, in any time that this takes
        Coordinates, speeds and inputs become functions of time, motions with derivatives, speeds q.dot derivatives of the
        coordinates. Constraints come with multipliers. sd.from_sympy((s.q, s.u, s.mass_matrix, s.forcing)) is the way back of
        equations without constraints. Raises SymdynError for what is too large to be written out, or has no explicit form.

        >>> equations = sd.systems.pendulum().embedding().to_sympy()
        >>> equations.mass_matrix, equations.forcing
        (Matrix([[l**2*m]]), Matrix([[-g*l*m*sin(q1(t))]]))
        """
        from symdyn.sympy_mechanics.back import to_sympy

        return to_sympy(_equations(self), simplify)

    def check_units(self) -> UnitReport:
        """Dimensional analysis of all entries by the units of the symbols (system.units): true where they agree, prints what does
        not, such as a sum of metres and radians. See symdyn.analytic.units.

        >>> equations = sd.systems.pendulum().embedding()
        >>> equations.check_units().faults
        ()
        """
        from symdyn.analytic.units import check_units

        return check_units(_equations(self))


class MotionFacade:
    """Analytical mechanics of equations of motion."""

    @property
    def momentum_symbols(self) -> sp.Matrix:
        """(n_q, 1) symbols of the momenta, p_q1 of q1, in `hamiltonian` and `hamilton_equations`.

        >>> sd.systems.pendulum().embedding().momentum_symbols
        Matrix([[p_q1]])
        """
        from symdyn.analytic.lagrange import momentum_leaves

        return sp.Matrix(list(momentum_leaves(_motion(self)).values()))

    @property
    def hamilton_equations(self) -> tuple[sp.Eq, ...]:
        """q_dot = dH/dp, then p_dot = -dH/dq + loads without potential; under constraints less C_r^T lam, and the constraints.

        Where the mass matrix couples more than two speeds, p_dot is in q and q_dot; where more than three, p = dT/dq_dot stands
        in place of q_dot = dH/dp. Raises SymdynError for quasi-velocities.

        >>> sd.systems.pendulum().embedding().hamilton_equations
        (Eq(q1_dot, p_q1/(l**2*m)), Eq(p_q1_dot, -g*l*m*sin(q1)))
        """
        from symdyn.analytic.hamilton import equations_of

        return equations_of(_motion(self))

    def conserved(self, undriven: bool = False) -> ConservedQuantities:
        """Momenta and energy, or Jacobi's integral, that every motion keeps, each with its proof.

        undriven   True: with all inputs zero; motions that are functions of the time go on
        See symdyn.analytic.conserved. Raises SymdynError where loads depend on accelerations or reactions.

        >>> sd.systems.pendulum().embedding().conserved()
        pendulum: conserved along every motion
          energy = l*m*(-g*cos(q1) + l*q1_dot**2/2)   (T + V; proved)
        """
        from symdyn.analytic.conserved import conserved

        return conserved(_motion(self), undriven)

    def linearized(self, about: Named[Scalar] | None = None, hold: Names = (), coordinates: Names = ()) -> Linearized:
        """M, C, K, A, B about a state of rest or a steady motion, explicit in the parameters, with its conditions.

        about   coordinates, speeds, states, inputs by symbol or name -> numbers or expressions in parameters; left out: zero
        hold    coordinates or speeds that are held
        coordinates   those that are to be independent under constraints; default: the first ones that are
        See symdyn.analytic.linear. Raises ArgumentError, and SymdynError for what has no constant linear equations.

        >>> sd.systems.pendulum().embedding().linearized()
        pendulum: linear equations in q1
          M = [[l**2*m]]
          C = [[0]]
          K = [[g*l*m]]
        """
        from symdyn.analytic.linear import linearized

        return linearized(_motion(self), about, hold, coordinates)

    def equilibria(self, fixed: Named[Scalar] | None = None, values: Named[Scalar] | None = None,
                   seconds: float | None = None) -> EquilibriumPoints:
        """All states of rest, or of steady motion, in closed form, where their conditions can be solved.

        fixed    coordinates that are held, inputs, speeds of a steady motion -> numbers or expressions in parameters
        values   numbers for parameters
        seconds  that the search may take; default: simplify_seconds, which is 10
        See symdyn.analytic.equilibria. Raises SymdynError with the reason where there is no closed form, and ArgumentError for
        seconds that are no positive number.

        >>> sd.systems.pendulum().embedding().equilibria()
        pendulum: 2 equilibria
          q1 = 0
          q1 = pi
          taken not to be zero: g, l, m
        """
        from symdyn.analytic.equilibria import equilibria

        return equilibria(_motion(self), fixed, values, seconds)

    def explain(self, quantity: str, *index: int, simplify: bool = True) -> Explanation:
        """Origin of an entry: `explain("M_tilde", i, j)` and `explain("k_tilde", i)`, indices from 0.

        The contributions of each body, translational and rotational, and for k_tilde the centrifugal, Coriolis and gyroscopic
        ones. See symdyn.formulation.printed.provenance.

        >>> print(sd.systems.pendulum().embedding().explain("M_tilde", 0, 0))
        M_tilde[0, 0] is the sum of
          bob  translational  l**2*m
        """
        from symdyn.formulation.printed.provenance import explain

        return explain(_motion(self), quantity, *index, simplify=simplify)

    def _repr_latex_(self) -> str:
        from symdyn.report.notebook import equation_page

        return equation_page(_motion(self))
