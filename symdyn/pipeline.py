"""The pipeline, once.

    stage         takes in                          gives out
    describe      bodies, joints, loads             System          (symdyn.model)
    check         System                            Model           frozen, every fault reported at once
    formulate     Model                             Equations       (symdyn.formulation) quantities on a tape
    emit          Equations, function names         Source          (symdyn.backend) text of files
    load          Source                            Module          (symdyn.runtime) evaluate, simulate
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from symdyn import kinds
from symdyn.backend.methods import method_of
from symdyn.backend.source import CORRECTIONS, Content, Source, render
from symdyn.collector import collector_paused
from symdyn.errors import SymdynError
from symdyn.formulation.constrained import BAUMGARTE, residual_names
from symdyn.formulation.equations import Equations
from symdyn.formulation.event_bounds import BOUNDS, RANGES, bound_names, enclosed, event_bounds, event_leaves, unknowns
from symdyn.formulation.linearization import multiplier_names, variation_names
from symdyn.formulation.skipped import skipped
from symdyn.model.symbols import GivenMotion
from symdyn.runtime.arguments import some
from symdyn.runtime.compiler import find_compiler, no_compiler_reason, plain, require_compiler
from symdyn.runtime.methods import split_name
from symdyn.runtime.module import Module
from symdyn.runtime.paths import as_path
from symdyn.runtime.unit import CUnit, PythonUnit, Unit
from symdyn.shown import name_of, shown
from symdyn.tape.balance import balance
from symdyn.tape.jumps import Jump, description, jumps
from symdyn.tape.node import Node
from symdyn.tape.passes import specialize as specialize_tape
from symdyn.tape.tape import Output, Tape
from symdyn.tape.taylor import not_smooth

# Functions of a module: name -> (quantity, what the header of generated code says about it).
FUNCTIONS = {
    "rhs": ("rhs", "x_dot = f(t, x) with x = [q; u; z]: M_tilde u_dot = F_tilde - k_tilde"),
    "mass_matrix": ("M_tilde", "mass matrix M_tilde = J^T M J"),
    "k_tilde": ("k_tilde", "k_tilde = J^T (M J_dot u + Q J u): Coriolis, centrifugal and gyroscopic terms"),
    "F_tilde": ("F_tilde", "F_tilde = J^T F: generalized forces of loads and gravity"),
    "J": ("J", "velocity transformation: [v_G; omega] of every body = J u, n-frame"),
    "energy": ("energy", "kinetic and potential energy, J"),
    "inverse_dynamics": ("inverse_dynamics", "tau = M_tilde u_dot + k_tilde - F_tilde for given accelerations ud"),
    "outputs": ("outputs", "the named outputs, one after the other"),
    "coriolis": ("coriolis", "C with C u = k_tilde and M_tilde_dot - 2 C skew-symmetric"),
    "gravity_load": ("gravity_load", "forces along the speeds that hold the weights"),
    "momentum": ("momentum", "angular momentum about the origin, then linear momentum, n-frame"),
    "momentum_G": ("momentum_G", "angular momentum about the centre of mass, then linear momentum, n-frame"),
    "center_of_mass": ("center_of_mass", "centre of mass of all bodies, n-frame, m"),
    "regressor": ("regressor", "Y, tau = Y pi: ten inertial parameters a body, for given accelerations ud"),
    "inertial_parameters": ("inertial_parameters", "pi: m, h = m c, I about its origin (xx xy xz yy yz zz) of every body"),
    "base_regressor": ("base_regressor", "Y_b, tau = Y_b pi_b: base parameters, for given accelerations ud"),
    "base_parameters": ("base_parameters", "pi_b from the parameters of the model"),
    "C": ("C", "constraints, zero where they hold; 0 in rows of velocity constraints"),
    "C_r": ("C_r", "Jacobian of the constraints in the speeds"),
    "C_t": ("C_t", "partial derivative of the constraints by time"),
    "C_dot": ("C_dot", "rate of the constraints, C_r u + C_t"),
    "F_d": ("F_d", "right side of C_r u_dot = F_d"),
    "lam": ("lam", "multipliers: M_tilde u_dot + k_tilde + C_r^T lam = F_tilde"),
    "reactions": ("reactions", "force and moment of every joint on its child, at the joint's point on it, n-frame"),
    "cut_loads": ("cut_loads", "the whole load in every joint: its reaction, and what acts along its speeds, likewise"),
    "ground_rotation": ("ground_rotation", "rotation of the ground's frame, which moves, to the n-frame"),
    "reactions_by_lam": ("reactions_by_lam", "derivatives of the reactions, row by row, by the multipliers"),
    "C_scale": ("C_scale", "factors that make every constraint a length"),
    "length": ("length", "the mechanism's length, m"),
    "N": ("N", "q_dot = N u + what is given"),
    "position_correction": ("position_correction", "constraints as lengths, and the smallest change of q that makes them zero"),
    "velocity_correction": ("velocity_correction", "their rates, m/s, and the smallest change of u that makes them zero"),
    "residual": ("residual", "residual of the stabilized index-2 form; ud: q_dot, u_dot, z_dot, lam, mu"),
    "power": ("power", "power of all loads but gravity and springs, and of prescribed motions, W"),
    "power_x": ("power_x", "derivative of the power by x"),
    "Jd_qd": ("Jd_qd", "accelerations [a_G; alpha] of every body with u_dot = 0, n-frame"),
    "joint_points": ("joint_points", "where every joint sits on its parent, then on its child, n-frame, m"),
    "frames": ("frames", "origin and rotation (row by row) of every body's frame, n-frame"),
    "positions": ("positions", "centres of mass, n-frame, m"),
    "watches": ("watches", "values that loads want to be looked at: draft, tilt and the like"),
    "events": ("events", "what vanishes at the events, in their order"),
    "event_resets": ("event_resets", "what entries of the state become at events that reset them"),
    "reset_directions": ("reset_directions", "changes of [q; u] along each coordinate and speed that events reset"),
    "switches": ("switches", "what passes zero where the right-hand side may jump"),
    "drawn_lengths": ("drawn_lengths", "lengths in pictures that follow from parameters, m"),
    "jacobian_x": ("jacobian_x", "exact derivative of x_dot by x"),
    "jacobian_inputs": ("jacobian_inputs", "exact derivative of x_dot by the inputs"),
    "jacobian_params": ("jacobian_params", "exact derivative of x_dot by the parameters"),
    "input_matrix": ("input_matrix", "exact derivative of F_tilde by the inputs"),
}
# What the header adds where there are constraints, which these functions leave out.
OF_THE_CUT_TREE = {"inverse_dynamics": ", of the tree: loops cut, without constraints"}
# Of statics and linearization, compiled together, with what they are used with; the headers' words.
STATICS = {
    "balance": "[M_tilde u_dot + k_tilde - F_tilde + C_r^T lam; C; z_dot; C_dot; C_ddot; q_dot; q_ddot]; ud: u_dot, lam",
    "N_dot": "derivative of N by time",
}
# Along directions that are arguments: one short function in place of long matrices.
VARIATIONS = {
    "variation": "derivative of the balance along a direction of [q; u; z; inputs; p; u_dot; lam]",
    "second_variation": "the same derivative of the linear form of its first three parts in v (q' = N v), u', u_dot', z', lam'",
    "outputs_variation": "the same derivative of the outputs",
}
# Further derivatives, each made by itself when it is asked for.
DERIVATIVES = {
    "stiffness": "derivative of M_tilde u_dot + k_tilde - F_tilde + C_r^T lam by q; ud: u_dot, lam",
    "damping": "derivative of M_tilde u_dot + k_tilde - F_tilde + C_r^T lam by u; ud: u_dot, lam",
}
# The extra state of a simulation that integrates the work of the loads.
WORK = "(work)"
# What consistent states are found with: compiled together.
CONSISTENCY = ("C", "C_r", "C_t", "C_dot", "C_scale", "N", "mass_matrix")
# What is written to files unless asked otherwise; Jacobians and the like are long and made on request.
STANDARD = ("rhs", "mass_matrix", "k_tilde", "F_tilde", "J", "energy", "inverse_dynamics", "outputs")
# What constraints add to it; with the corrections the integrator keeps a motion on its manifold.
OF_CONSTRAINTS = ("C", "C_r", "F_d", "lam", *CORRECTIONS)


def emit(equations: Equations, backend: str, functions: Sequence[str] | None = None,
         templates: str | os.PathLike | None = None, standalone: bool = True, integrator: bool = True,
         specialize: Mapping[Any, float] | None = None, work: bool = False, baumgarte: bool = False,
         batch: bool = False, method: str = "dop853", states: int = 2) -> Source:
    """The source of the named functions (default: STANDARD and OF_CONSTRAINTS, those the formulation has) in a backend.

    specialize   parameters, by symbol or name, that become numbers in the code and are folded
    work         rhs gets one more state at the end: the work of all loads but gravity and springs
    baumgarte    rhs is stabilized by Baumgarte's method, with one more parameter at the end: its gain, 1/s
    batch        C only: also rhs and integrator of many states at once, a state in each lane of the processor's vectors
    method       C only: the integrator's, one of symdyn.backend.methods.METHODS; what it needs besides rhs is emitted with it
    states       how many random states the reference vectors of a standalone source begin with

    Raises SymdynError for an unknown function, parameter, backend, method or a broken template.
    """
    if standalone and equations.again is not None:
        equations = equations.again()
    bound = some(specialize, [p.name for p in equations.symbols.parameters], "specialize", equations.name)
    usual = (*STANDARD, *(OF_CONSTRAINTS if equations.constraints else ()))
    listed = isinstance(functions, (list, tuple)) and functions and all(isinstance(n, str) for n in functions)
    if functions is not None and not listed:
        raise SymdynError(f"{equations.name}: functions is {shown(functions)}; pass a list of names such as "
                          "['rhs', 'mass_matrix']")
    kinds.text(backend, f"{equations.name}: the backend", "c")
    method_of(method)
    if templates is not None:
        as_path(templates, "of the templates", "my_templates")
    names = tuple(functions) if functions is not None else tuple(n for n in usual if has_function(equations, n))
    if integrator and "rhs" in names and backend == "c":
        names = tuple(dict.fromkeys((*names, *method_of(method).needs)))
    unknown = [n for n in names if not has_function(equations, n)]
    if unknown:
        there = ", ".join(n for n in FUNCTIONS if has_function(equations, n))
        raise SymdynError(f"{equations.name} has no function {', '.join(n[:80] for n in unknown)}; it has {there}")
    with collector_paused():
        content = _content(equations, names, standalone, bound, work, baumgarte)
        return render(content, backend, templates, standalone, integrator, batch, method, states)


def has_function(equations: Equations, name: str) -> bool:
    """Whether the equations can give a function."""
    if name == "outputs":
        return any(q.startswith("output_") for q in equations.quantities)
    if name == "switches":
        return bool(switches(equations))
    if name in (BOUNDS, RANGES):
        return bool(event_leaves(equations))
    return _quantity(name) in equations.quantities


def _quantity(name: str) -> str:
    """The quantity behind a function; any quantity is a function under its own name, too."""
    return FUNCTIONS[name][0] if name in FUNCTIONS else name


def compile_equations(equations: Equations, backend: str | None = None, templates: str | os.PathLike | None = None,
                      specialize: Mapping[Any, float] | None = None) -> Module:
    """A numeric module from equations.

    backend      "c", "numpy", or None: C if a compiler is found, else NumPy, and `module.fallback` says why
    templates    folder whose templates take precedence
    specialize   parameters, by symbol or name, that become numbers in the code and are folded

    Only what is called is generated: rhs with the integrator first, every other function when it is first used.
    Raises CompilerNotFound if C is asked for and there is no compiler, CompileError if it rejects the code.
    """
    fallback = ""
    if templates is not None:
        as_path(templates, "of the templates", "my_templates")
    compiler = require_compiler() if isinstance(backend, str) and backend == "c" else find_compiler() if backend is None else None
    if backend is None:
        backend = "c" if compiler is not None else "numpy"
        fallback = "" if compiler is not None else no_compiler_reason()
    if not isinstance(backend, str) or backend not in ("c", "numpy"):
        raise SymdynError(f"backend {shown(backend)} asked for; modules can be loaded from 'c' and 'numpy'; "
                          "emit() writes source for others")

    def source_of(name: str) -> Source:
        if name == "rhs_batch":
            return emit(equations, backend, ("rhs",), templates, standalone=False, specialize=specialize, batch=True)
        if not name.startswith("rhs"):
            group: tuple[str, ...] = CONSISTENCY if equations.constraints and name in CONSISTENCY else (name,)
            if name in STATICS:
                group = (*STATICS, "mass_matrix", "N", *(("C_r", "C_scale") if equations.constraints else ()))
            return emit(equations, backend, group, templates, standalone=False, specialize=specialize)
        needed = ("rhs", *CORRECTIONS) if equations.constraints else ("rhs",)
        if name == "rhs":  # looked at in or after every simulation
            needed = (*needed, *(["watches"] if "watches" in equations.quantities else []),
                      *(["switches"] if switches(equations) else []))
        needed = (*needed, *(n for n in ("events", "event_resets", "reset_directions", BOUNDS, RANGES)
                             if has_function(equations, n)))
        field, method = split_name(name)
        return emit(equations, backend, needed, templates, standalone=False, specialize=specialize, work="work" in field,
                    baumgarte="baumgarte" in field, method=method)

    rhs = source_of("rhs")

    def provide(name: str) -> Unit:
        source = rhs if name == "rhs" else source_of(name)
        text = next(iter(source.files.values()))
        if backend == "c":
            assert compiler is not None
            seldom = name in STATICS or name in VARIATIONS or name in DERIVATIVES
            return CUnit(text, source.metadata, plain(compiler) if seldom else compiler)
        return PythonUnit.from_source(text, source.metadata["name"])

    def write(folder: Path) -> list[Path]:
        return write_source(emit(equations, backend, templates=templates, specialize=specialize), folder)

    def report() -> Any:
        from symdyn.report.text import report as make

        return make(equations, backend, fallback)

    rates = _given_rates(equations, ("rhs",))
    metadata = {**rhs.metadata, "ud": rates, "sizes": {**rhs.metadata["sizes"], "ud": len(rates)},
                "outputs": output_shapes(equations), "duration": equations.symbols.duration,
                "constraints": list(equations.constraints), "holonomic": list(equations.holonomic),
                "reactions": [name for name, *_ in equations.joints], "bodies": list(equations.bodies),
                "drawn": list(equations.drawn), "flexible": list(equations.flexible), "planar": equations.planar,
                "reaction_bodies": [[parent, child] for _, parent, child, _ in equations.joints],
                "reaction_kinds": [kind for *_, kind in equations.joints],
                "unit_groups": [[q.name for q in group] for group in equations.unit_groups],
                "implicit_loads": list(equations.implicit_loads), "of_reactions": list(equations.of_reactions),
                "motions": [s.name for s in equations.symbols.inputs if isinstance(s, GivenMotion)],
                "charts": [list(chart) for chart in equations.charts],
                "masses": {p.name: body for p, body in equations.symbols.masses.items()},
                "output_units": dict(equations.symbols.point_units),
                "events": event_records(equations), "event_leaves": event_leaves(equations),
                "not_smooth": not_smooth(equations.quantity("rhs").tolist()),
                "switches": [description(jump, equations.printed_leaves()) for jump in switches(equations)],
                "watches": [[w.label, w.least, w.most, w.message] for w in equations.watched()],
                "functions": [n for n in FUNCTIONS if has_function(equations, n)],
                "conservative": "power" in equations.quantities and not isinstance(equations.quantity("power").item(), Node)}
    return Module(metadata, provide, backend, fallback, write, report)


def write_source(source: Source, folder: Path) -> list[Path]:
    """Write the files of a source into a folder (made if absent); returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, text in source.files.items():
        path = folder / name
        path.write_text(text, encoding="utf-8")
        paths.append(path)
    return paths


def output_shapes(equations: Equations) -> list[list[Any]]:
    """Names and shapes of the user's outputs."""
    return [[q.removeprefix("output_"), list(equations.quantity(q).shape)]
            for q in equations.quantities if q.startswith("output_")]


def event_records(equations: Equations) -> list[dict[str, Any]]:
    """Events as plain data: name, direction, whether it ends the motion, entries of x = [q; u; z] that it resets; whether it can
    be enclosed; which inputs and functions of the user its value depends on."""
    symbols = equations.symbols
    places = {s: k for k, s in enumerate((*symbols.coordinates, *symbols.speeds, *symbols.states))}
    about = zip(equations.events, enclosed(equations), unknowns(equations), strict=True)
    return [{"name": e.name, "direction": e.direction, "stop": e.stop, "reset": [places[s] for s, _ in e.reset],
             "enclosed": can, "inputs": inputs, "functions": functions} for e, can, (inputs, functions) in about]


def _content(equations: Equations, names: Sequence[str], standalone: bool, bound: Mapping[str, float],
             work: bool, baumgarte: bool) -> Content:
    symbols = equations.symbols
    tapes = _tapes(equations, names, work, baumgarte)
    if equations.otherwise is not None:
        there = _tapes(equations.otherwise, names, work, baumgarte)
        differ = {n: t for n, t in there.items() if _entries(t) != _entries(tapes[n])}
        tapes |= {f"{n} otherwise": t for n, t in differ.items()}
    if bound:
        tapes = _together(tapes, lambda whole: specialize_tape(whole, bound))
    tapes = _together(tapes, balance)
    otherwise = {n: tapes.pop(f"{n} otherwise") for n in names if f"{n} otherwise" in tapes}
    groups = {"q": [s.name for s in symbols.coordinates], "u": [s.name for s in symbols.speeds],
              "z": [*[s.name for s in symbols.states], *[WORK] * work], "ud": _given_rates(equations, names),
              "inputs": [s.name for s in symbols.inputs],
              "p": [*[s.name for s in symbols.parameters if s.name not in bound], *[BAUMGARTE] * baumgarte]}
    outputs = [(n, tuple(shape)) for n, shape in output_shapes(equations)] if "outputs" in names else []
    told = {**{n: title for n, (_, title) in FUNCTIONS.items()}, **STATICS, **VARIATIONS, **DERIVATIVES}
    cut = OF_THE_CUT_TREE if equations.constraints else {}
    titles = {n: told.get(n, n) + cut.get(n, "") for n in names}
    return Content(equations.name, equations.formulation, tapes, titles, groups,
                   {s.name: unit for s, unit in symbols.units.items()}, _by_name(symbols.defaults),
                   _by_name(symbols.initial), outputs, skipped(equations) if standalone else (),
                   [[q.name for q in group] for group in equations.unit_groups], otherwise,
                   event_records(equations) if "events" in names else (), event_leaves(equations) if BOUNDS in names else ())


def _tapes(equations: Equations, names: Sequence[str], work: bool, baumgarte: bool) -> dict[str, Tape]:
    """The tapes of functions; of rhs and its derivative by x with the variations asked for."""
    tapes = {name: tape_as_derived(equations, name) for name in names}
    if work or baumgarte:
        field = equations.quantity("rhs_baumgarte" if baumgarte else "rhs")
        if work:
            field = np.concatenate([field, equations.quantity("power").reshape(1)])
        tapes["rhs"] = Tape.of(equations.recorder, rhs=field)
    if (work or baumgarte) and "jacobian_x" in names:
        by_x = equations.quantity("jacobian_x_baumgarte" if baumgarte else "jacobian_x")
        if work:  # nothing depends on the work
            by_x = np.vstack([by_x, equations.quantity("power_x").reshape(1, -1)])
            by_x = np.column_stack([by_x, np.zeros(len(by_x), dtype=object)])
        tapes["jacobian_x"] = Tape.of(equations.recorder, jacobian_x=by_x)
    return tapes


def _entries(tape: Tape) -> tuple[Any, ...]:
    return next(iter(tape.outputs.values())).entries


def _given_rates(equations: Equations, names: Sequence[str]) -> list[str]:
    """What stands in the group ud: accelerations; for the balance also multipliers, for its variations what they are along;
    for the residual the rates of the coordinates, too, and multipliers."""
    symbols, n_c = equations.symbols, len(equations.constraints)
    if BOUNDS in names:
        return bound_names(event_leaves(equations))
    if "residual" in names:
        return residual_names(symbols.coordinates, symbols.speeds, symbols.states, n_c)
    given = [f"{s.name}_dot" for s in symbols.speeds]
    if any(n in STATICS or n in VARIATIONS or n in DERIVATIVES for n in names):
        given += multiplier_names(n_c)
    if any(n in VARIATIONS for n in names):
        given += variation_names(symbols, n_c, "second_variation" in names)
    return given


def switches(equations: Equations) -> list[Jump]:
    """Where the right-hand side may jump along a motion."""
    return jumps(equations.recorder, equations.quantity("rhs").tolist())


def function_tape(equations: Equations, name: str) -> Tape:
    """The tape behind a function of a module, as it is emitted."""
    return balance(tape_as_derived(equations, name))


def tape_as_derived(equations: Equations, name: str) -> Tape:
    """The quantities that a function of a module returns."""
    if name == "switches":
        surfaces = np.array([jump.surface for jump in switches(equations)], dtype=object)
        return Tape(equations.recorder, {name: Output.of(name, surfaces)})
    if name in (BOUNDS, RANGES):
        return event_bounds(equations, name)
    if name != "outputs":
        return equations.tape(_quantity(name))
    values = [equations.quantity(q).ravel() for q in equations.quantities if q.startswith("output_")]
    whole = np.concatenate(values) if values else np.zeros(0, dtype=object)
    return Tape(equations.recorder, {"outputs": Output.of("outputs", whole)})


def _together(tapes: Mapping[str, Tape], change: Callable[[Tape], Tape]) -> dict[str, Tape]:
    """A pass over all functions' tapes as one, so that they still share their steps."""
    recorder = next(iter(tapes.values())).recorder
    whole = change(Tape(recorder, {n: next(iter(t.outputs.values())) for n, t in tapes.items()}))
    return {n: whole.prune((n,)) for n in tapes}


def _by_name(values: Any) -> dict[str, float]:
    return {name_of(key): float(value) for key, value in values.items()}


