"""Modelica models: a mechanism as flat equations with parameters, inputs, outputs, units and events, and a model that tests it.

Source: Modelica Association, Modelica Language Specification 3.6.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

import symdyn
from symdyn.arguments import some
from symdyn.backend.context import Algorithms
from symdyn.backend.dialect import Dialect, read_dialect
from symdyn.backend.metadata import EventRecord, ModuleMetadata, ValidityRange
from symdyn.backend.reference import result_at
from symdyn.backend.right_side import RightSide
from symdyn.backend.source import CORRECTIONS, VIOLATION, Content, template_environment, with_violation
from symdyn.backend.user_functions import called
from symdyn.backend.user_functions import texts as texts_of_user_functions
from symdyn.collector import collector_paused
from symdyn.errors import ArgumentError, UnsupportedExpression
from symdyn.exact.dimensions import parsed
from symdyn.folders import templates_folder
from symdyn.formulation.constraints.motion import BAUMGARTE
from symdyn.formulation.equations import Equations
from symdyn.functions.content import content_of
from symdyn.functions.tapes import has_function
from symdyn.runtime.module import Module
from symdyn.runtime.paths import as_path, writing
from symdyn.tape.external import UserFunction
from symdyn.tape.tape import Tape
from symdyn.targets.modelica_context import (
    Clause,
    Declared,
    ModelicaContext,
    ModelicaEquations,
    ModelicaModel,
    Sample,
    Variable,
    Violation,
)
from symdyn.targets.modelica_equations import Equations as FlatEquations
from symdyn.targets.modelica_equations import Flat, combined
from symdyn.targets.start import equations_of, start_values

FOLDER = "modelica"
# 1/s: what Baumgarte's method pulls violations of constraints back with, until a user sets it.
GAIN = 10.0
# States at which the test compares, how far they are from the start, and what a comparison has to hold to at least.
SAMPLES, REACH, COARSEST = 3, 0.3, 1e-6
# A unit quaternion is made one again when the square of its length is off by so much; a violation of constraints that is
# reported, as a part of the mechanism's length.
UNIT, VIOLATED = "1e-6", "1e-3"
_FUNCTIONS = ("rhs", "outputs", "energy", "events", "event_resets", "validity_checks")
_OWN_FUNCTIONS = ("symdyn_asinh", "symdyn_acosh", "symdyn_atanh", "symdyn_erf")


def write_modelica(module: Module, folder: Any, *, q: Any = None, u: Any = None, z: Any = None, params: Any = None,
                   inputs: Any = None) -> list[Path]:
    """See Module.to_modelica."""
    target = as_path(folder, "of the folder to write to", "generated/arm")
    start = start_values(module, "a Modelica model", q, u, z, params, inputs)
    equations, specialize = equations_of(module, "a Modelica model")
    whole = equations.again() if equations.again is not None else equations
    moved = [e.name for e in module.metadata.events if e.reset]
    if moved and whole.constraints:
        raise ArgumentError(f"{module.name}: a Modelica model asked for, but its constraints have to hold again after the resets "
                            f"of the event {moved[0]}, which equations do not see to; take an FMU, which projects the state")
    with collector_paused():
        content = _content(whole, specialize)
        dialect = read_dialect(templates_folder() / FOLDER / "equations")
        context = _context(module.metadata, content, dialect, start)
        environment = template_environment(templates_folder())
        files = {file.format(name=context.model.name): environment.get_template(f"{FOLDER}/{template}").render(context.names())
                 for template, file in (dialect.files or {}).items()}
    with writing(target):
        target.mkdir(parents=True, exist_ok=True)
        for file, text in files.items():
            (target / file).write_text(text, encoding="utf-8")
    return [target / file for file in files]


def _content(equations: Equations, specialize: Mapping[Any, float] | None) -> Content:
    """The functions whose statements become equations: with constraints, the right-hand side with Baumgarte's stabilization."""
    bound = some(specialize, [p.name for p in equations.symbols.parameters], "specialize", equations.name)
    constrained = bool(equations.constraints)
    names = [n for n in _FUNCTIONS if has_function(equations, n)] + [*(CORRECTIONS if constrained else ())]
    return with_violation(content_of(equations, names, True, bound, RightSide(baumgarte=constrained)))


def _context(metadata: ModuleMetadata, content: Content, dialect: Dialect, start: Mapping[str, np.ndarray]) -> ModelicaContext:
    names = [n for n in (*_FUNCTIONS, VIOLATION, "length") if n in content.tapes]
    whole = combined(content, names)
    tape = whole.tape
    codes = {reason: k for k, reason in enumerate(dict.fromkeys(tape.recorder.checks.values()), 1)}
    taken = dialect.names()
    name = variable_name(content.name, taken)
    identifiers = {BAUMGARTE: "baumgarte"}
    for symbol in (*metadata.x, *metadata.inputs, *metadata.parameters):
        identifiers[symbol] = variable_name(symbol, taken)
    outputs = [(variable_name(output, taken), shape, metadata.output_units.get(output, "")) for output, shape in metadata.outputs]
    events = [variable_name(f"event_{e.name}", taken) for e in metadata.events]
    flat = Flat(dialect, whole, identifiers, taken, codes).equations()
    intrinsics = {n.args[0].name for n in tape.steps if n.op == "call" and not isinstance(n.args[0], UserFunction)}
    user_texts = texts_of_user_functions(called(tape), FOLDER, name)
    body = repr(flat) + repr(user_texts)
    _check_intrinsics(content.name, intrinsics)
    entries = _entries_of(outputs)
    return ModelicaContext(
        model=ModelicaModel(name, _quoted(f"{metadata.formulation} equations of motion of {metadata.name}"), symdyn.__version__,
                            hashlib.sha256(body.encode()).hexdigest()[:16], repr(metadata.duration or 1.0)),
        declared=_declared(metadata, content, identifiers, outputs, flat, start),
        equations=_equations(metadata, flat, codes, [identifiers[n] for n in metadata.x], entries, events),
        algorithms=Algorithms(tuple(sorted(intrinsics)), (), ()), functions=tuple(f for f in _OWN_FUNCTIONS if f"{f}(" in body),
        user_texts=tuple(user_texts), samples=tuple(_samples(metadata, content, identifiers, entries, start)))


def _declared(metadata: ModuleMetadata, content: Content, identifiers: Mapping[str, str],
              outputs: Sequence[tuple[str, tuple[int, ...], str]], flat: FlatEquations,
              start: Mapping[str, np.ndarray]) -> Declared:
    stabilized = [Variable("baumgarte", '(unit="1/s")', f" = {GAIN!r}", "gain that pulls violated constraints back")
                  for _ in range(BAUMGARTE in content.groups["p"])]
    inputs = [_real(identifiers[n], metadata.units.get(n, ""), "input", start=value)
              for n, value in zip(metadata.inputs, start["inputs"], strict=True)]
    return Declared(
        parameters=(*_parameters(metadata, identifiers, start["p"]), *stabilized), inputs=tuple(inputs),
        states=tuple(_states(metadata, identifiers, start["x"])), outputs=tuple(_outputs(outputs, "energy" in content.tapes)),
        constants=flat.constants, steps=tuple(_lines(flat.declared)))


def _equations(metadata: ModuleMetadata, flat: FlatEquations, codes: Mapping[str, int], x: Sequence[str], entries: Sequence[str],
               events: Sequence[str]) -> ModelicaEquations:
    """Equations with the variables of the states, of the entries of the outputs and of the events."""
    reasons = {f"reasons[{code}]": f'"{_quoted(reason)}"' for reason, code in codes.items()}
    asserts = [re.sub(r"reasons\[\d+\]", lambda result: reasons[result[0]], line) for line in flat.asserts]
    residuals = flat.results.get(VIOLATION, ())
    violations = (Violation("violation", "m", "violation of a constraint, as a length", _moving(residuals[:len(residuals) // 2])),
                  Violation("violation_rate", "m/s", "rate of a violation", _moving(residuals[len(residuals) // 2:])))
    energies = ("kinetic_energy", "potential_energy") if "energy" in flat.results else ()
    values = *flat.results.get("outputs", ()), *flat.results.get("energy", ())
    checks = zip(metadata.validity_checks, flat.results.get("validity_checks", ()), strict=True)
    return ModelicaEquations(
        sections=flat.sections, asserts=tuple(asserts), rates=tuple(zip(x, flat.results["rhs"], strict=True)),
        values=tuple(zip((*entries, *energies), values, strict=True)),
        violations=tuple(v for v in violations if v.residuals), violated=VIOLATED, length=flat.results.get("length", ("1",))[0],
        validity_checks=tuple((" and ".join(_within(w, value)), _message(w.message, value))
                              for w, value in checks if not w.summed and _within(w, value)),
        events=tuple(zip(events, flat.results.get("events", ()), strict=True)),
        clauses=tuple(map(tuple, _clauses(metadata, x, events, flat.results.get("event_resets", ())))))


def variable_name(name: str, taken: set[str]) -> str:
    """A name as it is, as far as it is none of Modelica's and not taken; adds it to `taken`."""
    result = re.sub(r"\W", "_", name, flags=re.ASCII)
    result = f"v{result}" if not result or result[0].isdigit() else result
    while result in taken:
        result += "_"
    taken.add(result)
    return result


def _moving(residuals: Sequence[str]) -> tuple[str, ...]:
    """Those that are not zero all the time, as the positions of rows of speeds are."""
    return tuple(r for r in residuals if r != "0.0")


def _check_intrinsics(owner: str, intrinsics: set[str]) -> None:
    """Raise UnsupportedExpression for a numeric algorithm without a text in Modelica."""
    known = {path.name.partition(".")[0] for path in (templates_folder() / FOLDER).glob("symdyn_*.jinja")}
    missing = sorted(intrinsics - known)
    if missing:
        raise UnsupportedExpression(f"{owner} calls the numeric algorithm {missing[0]}, by sd.Buoyancy or sd.MooringLine, and "
                                    "there is no text of it in Modelica; take an FMU, which has it in C, or model the load by "
                                    "expressions")


def _real(name: str, unit: str, about: str, value: Any = None, start: Any = None, fixed: bool = False) -> Variable:
    """A variable with the attributes that are known; a unit that Modelica has no text for stands in the description."""
    in_modelica = unit_of(unit)
    attributes = [f'unit="{in_modelica}"'] * bool(in_modelica)
    if start is not None:
        attributes.append(f"start={float(start)!r}")
    attributes += ["fixed=true"] * fixed
    text = f"{about} [{unit}]" if unit and not in_modelica else about
    return Variable(name, f"({', '.join(attributes)})" if attributes else "", "" if value is None else f" = {float(value)!r}",
                    _quoted(text))


def unit_of(unit: str) -> str:
    """A unit as Modelica writes it, "" where it is not known: products by points, powers by numbers alone."""
    known = bool(unit) and parsed(unit) is not None and re.fullmatch(r"[\w\s^/()-]+", unit, flags=re.ASCII)
    return re.sub(r"\s+", ".", unit.strip()).replace("^", "") if known else ""


def _quoted(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"')


def _parameters(metadata: ModuleMetadata, identifiers: Mapping[str, str], values: np.ndarray) -> list[Variable]:
    return [_real(identifiers[n], metadata.units.get(n, ""),
                  f"mass of {metadata.masses[n]}" if n in metadata.masses else "parameter", value=value)
            for n, value in zip(metadata.parameters, values, strict=True)]


def _states(metadata: ModuleMetadata, identifiers: Mapping[str, str], values: np.ndarray) -> list[Variable]:
    kinds = {**dict.fromkeys(metadata.q, "coordinate"), **dict.fromkeys(metadata.u, "speed"),
             **dict.fromkeys(metadata.z, "extra state")}
    return [_real(identifiers[n], metadata.units.get(n, ""), kinds[n], start=value, fixed=True)
            for n, value in zip(metadata.x, values, strict=True)]


def _outputs(outputs: Sequence[tuple[str, tuple[int, ...], str]], energy: bool) -> list[Variable]:
    result = []
    for name, shape, unit in outputs:
        variable = _real(name, unit, "output")
        size = f"[{', '.join(map(str, shape))}]" if shape else ""
        attributes = variable.attributes.replace("(unit", "(each unit") if shape else variable.attributes
        result.append(replace(variable, name=f"{name}{size}", attributes=attributes))
    return result + [_real(f"{kind}_energy", "J", f"{kind} energy") for kind in ("kinetic", "potential") if energy]


def _entries_of(outputs: Sequence[tuple[str, tuple[int, ...], str]]) -> list[str]:
    """The entries of the outputs row by row."""
    return [f"{name}[{', '.join(map(str, place))}]" if shape else name
            for name, shape, _ in outputs for place in product(*(range(1, n + 1) for n in shape))]


def _lines(names: Sequence[str]) -> list[str]:
    """Names with commas between, a few lines long."""
    return fill(", ".join(names), 116, break_long_words=False, break_on_hyphens=False).splitlines() if names else []


def _clauses(metadata: ModuleMetadata, x: Sequence[str], events: Sequence[str], resets: Sequence[str]) -> list[list[Clause]]:
    """Clauses for events and for unit quaternions that have drifted; those that set the same states are in one list, of which
    only one may do so at a time."""
    rest = iter(resets)
    clauses = []
    for event, value in zip(metadata.events, events, strict=True):
        made = tuple((x[k], next(rest)) for k in event.reset)
        stops = _quoted(f"the event {event.name}") if event.stop else ""
        if made or stops:
            clauses.append(Clause(_condition(event, value), made, stops))
    for group in metadata.unit_groups:
        entries = [x[metadata.x.index(n)] for n in group]
        square = " + ".join(f"{e}*{e}" for e in entries)
        clauses.append(Clause(f"abs({square} - 1) > {UNIT}", tuple((e, f"{e}/sqrt({square})") for e in entries), ""))
    together: list[list[Clause]] = []
    for clause in clauses:
        states = {state for state, _ in clause.resets}
        touched = [group for group in together if any(state in states for c in group for state, _ in c.resets)]
        together = [group for group in together if group not in touched] + [[*(c for g in touched for c in g), clause]]
    return together


def _condition(event: EventRecord, value: str) -> str:
    rising, falling = f"{value} > 0", f"{value} < 0"
    return rising if event.direction > 0 else falling if event.direction < 0 else f"{{{rising}, {falling}}}"


def _within(validity: ValidityRange, value: str) -> list[str]:
    """The conditions that a value is in its range, which may be open."""
    bounds = (">=", validity.least), ("<=", validity.most)
    return [f"{value} {sign} {bound!r}" for sign, bound in bounds if math.isfinite(bound)]


def _message(message: str, value: str) -> str:
    """A text in Modelica with a value in it."""
    before, there, after = message.partition("{value}")
    return f'"{_quoted(before)}" + String({value}) + "{_quoted(after)}"' if there else f'"{_quoted(message)}"'


def _samples(metadata: ModuleMetadata, content: Content, identifiers: Mapping[str, str], outputs: Sequence[str],
             start: Mapping[str, np.ndarray]) -> list[Sample]:
    """States near the start with results of 30 digits."""
    stream = np.random.default_rng(1)
    made = []
    for k in range(1, SAMPLES + 1):
        x = np.round(start["x"] + stream.uniform(-REACH, REACH, len(start["x"])), 6)
        inputs = np.round(start["inputs"] + stream.uniform(-1, 1, len(start["inputs"])), 6)
        point = {**dict(zip(metadata.x, x, strict=True)), **dict(zip(metadata.inputs, inputs, strict=True)),
                 **dict(zip(metadata.parameters, start["p"], strict=True)), BAUMGARTE: GAIN, "t": 0.0}
        values = {n: float(v) for n, v in point.items()}
        instance = f"sample{k}"
        claims = []
        rates, states = f"rates{k}", tuple(f"{instance}.{identifiers[n]}" for n in metadata.x)
        places = {"rhs": [f"{rates}[{i + 1}]" for i in range(len(states))],
                  "outputs": [f"{instance}.{entry}" for entry in outputs],
                  "energy": [f"{instance}.{kind}_energy" for kind in ("kinetic", "potential")]}
        for function, variables in places.items():
            claims += _claims(content, function, variables, values)
        if claims:
            set_ = [f"{identifiers[n]}(start={values[n]!r})" for n in metadata.x]
            set_ += [f"{identifiers[n]}={values[n]!r}" for n in metadata.inputs]
            modifications = fill(", ".join(set_), 112, subsequent_indent="    ", break_on_hyphens=False)
            made.append(Sample(instance, modifications, rates, states, tuple(claims)))
    return made


def _claims(content: Content, function: str, variables: Sequence[str], values: Mapping[str, float]) -> list[tuple[str, str]]:
    """Claims about the results of a function at a state, if it is defined there."""
    tapes: list[Tape | None] = [content.tapes.get(function), content.singular_fallback.get(function)]
    for tape in tapes:
        result = result_at(function, tape, values, "") if tape is not None else None
        if result is not None and float(result.tolerance) <= COARSEST:
            largest = max((abs(float(v)) for v in result.values), default=0.0) or 1.0
            allowed = f"{100 * float(result.tolerance) * largest:.0e}"
            return [(f"abs({variable} - ({value})) <= {allowed}", _quoted(f"{variable} is not {value}"))
                    for variable, value in zip(variables, result.values, strict=True)]
    return []
