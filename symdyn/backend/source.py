"""Renders a backend's templates: from equations and function names to the texts of files."""

from __future__ import annotations

import functools
import hashlib
import os
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import jinja2
import numpy as np

import symdyn
from symdyn.backend.band import Band
from symdyn.backend.batch import Batch, batch_of
from symdyn.backend.columns import Columns
from symdyn.backend.context import (
    Algorithms,
    Calls,
    Context,
    Corrections,
    Integrator,
    Manifold,
    Model,
    Needs,
    Options,
    Row,
    call_of,
)
from symdyn.backend.dialect import Dialect, identifier, read_dialect
from symdyn.backend.function import Function
from symdyn.backend.gathered import Gathered
from symdyn.backend.integrated import Shape, functions, switches
from symdyn.backend.integrated import sizes as runtime_sizes
from symdyn.backend.metadata import EventRecord, Metadata
from symdyn.backend.methods import Method, method_of, needs_of
from symdyn.backend.parts import Parts
from symdyn.backend.program import Program, build
from symdyn.backend.reference import Reference, make_reference
from symdyn.backend.right_side import RightSide
from symdyn.backend.single import in_single
from symdyn.backend.units import divided, whole
from symdyn.backend.user_functions import header as header_of_user_functions
from symdyn.backend.user_functions import texts as texts_of_user_functions
from symdyn.errors import SymdynError, UnsupportedExpression
from symdyn.folders import templates_folder
from symdyn.shown import shown
from symdyn.tape.algorithms import text_of
from symdyn.tape.intrinsics import CLEANINGS, LOOSE, MASSLESS, ROUNDS, SMOOTHED
from symdyn.tape.tape import Output, Tape
from symdyn.turning import is_angle, turns

if TYPE_CHECKING:
    from symdyn.given import Rolling

# Functions by which the integrator keeps a state on its constraints, if there are all: of positions, of speeds, and their scale.
CORRECTIONS = ("position_correction", "velocity_correction", "length")
VIOLATION = "violation"
EVENTS = "events"
# The module that algorithms need for many states at once.
_STATES = "symdyn.tape.algorithms.states"
_SYMBOLS = {"q": "coordinates q", "u": "speeds u", "z": "extra states z", "inputs": "inputs", "p": "parameters p"}


@dataclass(frozen=True)
class Content:
    """Tapes to emit by function name, their titles, and the names behind every group of arguments.

    groups   names in the groups q, u, z, ud, inputs, p, in order; units: name -> unit; defaults: name -> number
    outputs  user outputs: (name, shape) in the order of the function `outputs`
    unit_groups   coordinates that form a unit vector: the compiled integrator keeps its length
    singular_fallback   tapes by function name for where the first ones fail
    events        what the function `events` is about: see EventRecord
    event_leaves  what the function `event_bounds` takes bounds of in the group ud: 0 stands for t, then come x and the inputs
    columns       of sensitivities, which are the last entries of z; carried: weights that are carried back besides those of x
    jacobians     those whose tapes are derivatives along directions
    rows          functions that take rows of states with a state in each lane
    band          the order in which an implicit method eliminates the entries of the derivative by x; None: as a whole matrix
    """

    name: str
    formulation: str
    tapes: Mapping[str, Tape]
    titles: Mapping[str, str]
    groups: Mapping[str, Sequence[str]]
    units: Mapping[str, str]
    defaults: Mapping[str, float]
    initial: Mapping[str, float]
    outputs: Sequence[tuple[str, tuple[int, ...]]] = ()
    notes: Sequence[str] = ()
    unit_groups: Sequence[Sequence[str]] = ()
    singular_fallback: Mapping[str, Tape] = field(default_factory=dict)
    events: Sequence[EventRecord] = ()
    event_leaves: Sequence[int] = ()
    columns: int = 0
    carried: int | None = None
    jacobians: Mapping[str, Columns] = field(default_factory=dict)
    rows: Sequence[str] = ()
    band: Band | None = None


@dataclass(frozen=True)
class Source:
    """Rendered files, file name -> text, with the program they hold and the record that a loader needs."""

    backend: str
    files: Mapping[str, str]
    program: Program
    metadata: Metadata


def template_folders(extra: str | os.PathLike | None = None) -> list[Path]:
    """Folders in which templates are looked for: the user's folder, then the shipped ones (in the wheel or in the checkout).

    Raises SymdynError if the user's folder does not exist.
    """
    folders = [templates_folder()]
    if extra is not None:
        if not Path(extra).is_dir():
            raise SymdynError(f"the template folder {extra} does not exist; pass a folder that holds one folder a backend")
        folders.insert(0, Path(extra))
    return folders


def backends(extra: str | os.PathLike | None = None) -> list[str]:
    """Names of the backends: every template folder with a dialect."""
    return sorted({path.parent.name for folder in template_folders(extra) for path in folder.glob("*/dialect.toml")})


def render(content: Content, backend: str, templates: str | os.PathLike | None = None, standalone: bool = True,
           right_side: RightSide | None = None, states: int = 2, only: Sequence[str] = (), rolled: Rolling = "auto") -> Source:
    """Render a backend's files.

    templates    folder whose files take precedence over the shipped ones
    standalone   with reference vectors, header and example; False for a module that is only loaded
    right_side   what the content was made for, of which the integrator, lanes, threads and precision are those of C, where rhs
                 is in the content; None: RightSide()
    rolled       whether what functions repeat becomes loops, see symdyn.backend.program.build; not in texts for devices
    states       how many random states the reference vectors begin with
    only         the templates of the files that are wanted, without reference vectors; none: all, or the first one where they are
                 not standalone
    Raises SymdynError for an unknown backend, a broken template, and loops that a backend has no words for.
    """
    right_side = right_side or RightSide()
    threads, single = right_side.threads, right_side.single
    folders = template_folders(templates)
    known = backends(templates)
    if backend not in known:
        instead = "a Modelica model is written by module.to_modelica; " if backend == "modelica" else ""
        raise SymdynError(f"there is no backend {shown(backend)}; {instead}there are {', '.join(known)}; "
                          "a folder with a dialect.toml and templates adds one, in the folder that is given as templates")
    folder = next(f / backend for f in folders if (f / backend / "dialect.toml").is_file())
    dialect = read_dialect(folder)
    if rolled is True and dialect.loops is None:
        raise SymdynError(f"rolled=True was asked for, and the backend {backend} writes no loops; take 'c', rolled='auto', or a "
                          "dialect.toml with [loops]")
    environment = template_environment(*folders) if templates is not None else _shipped(*folders)
    content = with_violation(content)
    leaves = {"t": ("t", 0)}
    for group, names in content.groups.items():
        leaves.update({name: (group, k) for k, name in enumerate(names)})
    vectors = read_dialect(folder / "columns") if content.jacobians else None
    program = build(dialect, content.tapes, content.titles, leaves, singular_fallback=content.singular_fallback,
                    columns=content.jacobians, vectors=vectors, rolled=not threads and rolled)
    lanes, many = None, None
    if backend == "c":
        shipped = next(f / backend for f in folders if (f / backend / "batch" / "dialect.toml").is_file())
        on_vectors = functools.partial(batch_of, shipped, dialect, program, content.tapes, content.titles, leaves,
                                       content.singular_fallback, content.jacobians)
        lanes = on_vectors() if right_side.lanes and "rhs" in content.tapes else None
        many = on_vectors(content.rows) if content.rows and not standalone else None
    integrator = right_side.integrated and "rhs" in content.tapes
    if single:
        _check_single(content.name, program)
    record = method_of(right_side.method)
    asks = integrator and backend == "c" and record.gather is not None
    gathered = record.gather(content, program, dialect, leaves) if asks and record.gather is not None else Gathered()
    # A module that is only loaded is compiled as several units; the functions of a series belong to the integrator.
    divides = backend == "c" and integrator and not standalone and lanes is None and not threads and record.template != "taylor"
    context = _context(content, program, dialect, Options(standalone, threads, divides), _reader(environment), record, gathered,
                       integrator, lanes, many, single, 0 if only else states)
    files = {}
    wanted = dialect.files or {}
    if only or not standalone:
        wanted = {template: wanted[template] for template in only or list(wanted)[:1]}
    for template, target in wanted.items():
        try:
            text = environment.get_template(f"{backend}/{template}").render(context.names())
        except jinja2.TemplateNotFound as error:
            name = Path(str(error.name)).name.partition(".")[0]
            missing = next((a for a in program.algorithms if a.name == name), None)
            if missing is None:
                raise SymdynError(_template_fault(f"{backend}/{template}", error)) from error
            raise UnsupportedExpression(
                f"{content.name} calls the numeric algorithm {name}, by {missing.called_by}, and the templates of "
                f"{backend} have no text of it; take C or NumPy, model the load by expressions, or add {error.name}") from None
        except (jinja2.TemplateError, TypeError, ValueError, LookupError, AttributeError) as error:
            raise SymdynError(_template_fault(f"{backend}/{template}", error)) from error
        if backend == "c":
            text = divided(text) if divides else whole(text)
            text = in_single(text) if single else text
        files[target.format(name=context.model.name)] = text
    return Source(backend, files, program, context.model.metadata)


def _check_single(name: str, program: Program) -> None:
    """Raises UnsupportedExpression for algorithms, and functions of the user, whose texts are in double precision."""
    faults = [f"{a.name} ({a.called_by})" for a in program.algorithms]
    faults += [f.signature for f in program.user_functions]
    if faults:
        raise UnsupportedExpression(f"{name}: there is no single precision of {', '.join(faults)}, which its right-hand side "
                                    "calls; pass precision='double'")


def template_environment(*folders: Path) -> jinja2.Environment:
    """The environment of templates of text: undefined names are errors, and block statements leave no lines behind."""
    return jinja2.Environment(loader=jinja2.FileSystemLoader(folders), undefined=jinja2.StrictUndefined,
                              trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True)


def _reader(environment: jinja2.Environment) -> Callable[[str], str]:
    """The function that reads the parts of the runtime in C."""
    def read(name: str) -> str:
        assert environment.loader is not None
        return environment.loader.get_source(environment, f"c/runtime/{name}")[0]

    return read


# Reading the templates takes longer than filling them in, and the shipped ones stay as they are.
_shipped = functools.cache(template_environment)


def with_violation(content: Content) -> Content:
    """The content, with the function `violation` where it has corrections: their residuals alone, which show whether they were
    enough."""
    if not all(n in content.tapes for n in CORRECTIONS):
        return content
    position, velocity = (content.tapes[n].outputs[n].entries for n in CORRECTIONS[:2])
    n_rows = len(position) - len(content.groups["q"])
    values = np.array([*position[:n_rows], *velocity[:n_rows]], dtype=object)
    tape = Tape(content.tapes[CORRECTIONS[0]].recorder, {VIOLATION: Output.of(VIOLATION, values)})
    return replace(content, tapes={**content.tapes, VIOLATION: tape},
                   titles={**content.titles, VIOLATION: "constraints as lengths, then their rates, m/s"})


def _template_fault(template: str, error: Exception) -> str:
    """The message which template is wrong, in which line, and why."""
    if isinstance(error, jinja2.TemplateNotFound):
        return f"template {template} needs {error.name}, which is in none of the template folders"
    if isinstance(error, jinja2.TemplateSyntaxError):
        return f"template {error.filename or template}, line {error.lineno}: {error.message}"
    # Jinja2 gives the frames of a template its file and lines.
    frames = [f for f in traceback.extract_tb(error.__traceback__) if Path(f.filename).suffix not in (".py", "")]
    where = f"{frames[-1].filename}, line {frames[-1].lineno}" if frames else template
    return f"template {where}: {error}"


def _context(content: Content, program: Program, dialect: Dialect, options: Options, read: Callable[[str], str], method: Method,
             gathered: Gathered, integrates: bool, lanes: Batch | None, many: Batch | None, single: bool, states: int) -> Context:
    # A file with the name of a standard module would be imported in its place by whatever runs next to it.
    # The runtime in C has names that begin with symdyn_.
    name = identifier(content.name, {"symdyn", *sys.stdlib_module_names})
    written = [way for f in program.functions for way in f.with_called]
    arguments = {f.name: f.arguments for f in program.functions}
    metadata = _metadata(name, content, program)
    text = repr([(f.name, f.loads, f.sections, f.results, f.parts) for f in (*written, *program.common, program.prologue)])
    user_texts = texts_of_user_functions(program.user_functions, dialect.name, name)
    identity = text + "".join("\n".join(("", *t.lines)) for t in user_texts)
    model = Model(metadata, hashlib.sha256(identity.encode()).hexdigest()[:16], tuple(_header(content, program)),
                  _tables(content))
    calls = Calls(metadata.sizes, arguments)
    needs = Needs(sign="symdyn_sign(" in text, sincos="symdyn_sincos(" in text or gathered.sincos,
                  columns=any(f.along and not f.motion for f in written), motion_columns=any(f.motion for f in written))
    manifold = _manifold(content, program)
    shape = _shape(content, manifold, arguments)
    called = functions(needs_of(method, content.band is not None), arguments, calls.at, shape.sizes["inputs"], shape.n_rows > 0)
    runtime = Parts(read, switches(method, shape, gathered, options.threads, single))
    return Context(
        model=model, program=program, options=options, calls=calls, needs=needs, algorithms=_algorithms(program),
        user_texts=tuple(user_texts), manifold=manifold, runtime=runtime, lanes=lanes, many=many,
        integrator=Integrator(method, shape, gathered, tuple(called), tuple(runtime_sizes(method, shape, gathered)))
        if integrates else None,
        reference=_reference(content, written, states) if options.standalone and states > 0 else None)


def _metadata(name: str, content: Content, program: Program) -> Metadata:
    groups = content.groups
    return Metadata(
        name, content.formulation, symdyn.__version__, q=tuple(groups["q"]), u=tuple(groups["u"]), z=tuple(groups["z"]),
        ud=tuple(groups["ud"]), inputs=tuple(groups["inputs"]), parameters=tuple(groups["p"]),
        defaults=tuple(content.defaults.get(n) for n in groups["p"]), initial=dict(content.initial),
        units={n: content.units.get(n, "") for g in ("q", "u", "z", "inputs", "p") for n in groups[g]},
        shapes={f.name: tuple(f.shape) for f in program.functions},
        outputs=tuple((n, tuple(shape)) for n, shape in content.outputs), reasons=tuple(program.reasons), n_c=program.n_c,
        operations={f.name: f.count for f in program.functions},
        arguments={f.name: tuple(f.arguments) for f in program.functions})


def _reference(content: Content, written: Sequence[Function], states: int) -> Reference:
    calls = {f.name: call_of(f) for f in written}
    return make_reference(content.tapes, content.groups, content.defaults, calls, content.singular_fallback, states)


def _manifold(content: Content, program: Program) -> Manifold:
    q, u = content.groups["q"], content.groups["u"]
    corrections = None
    if all(n in program.names for n in CORRECTIONS):
        n_rows = program.named(CORRECTIONS[0]).size - len(q)
        corrections = Corrections(n_rows, n_rows + max(len(q), len(u)), tuple(turns(content.units.get(n)) for n in u),
                                  tuple(is_angle(content.units.get(n)) for n in q))
    return Manifold(tuple(tuple(list(q).index(n) for n in group) for group in content.unit_groups), corrections)


def _shape(content: Content, manifold: Manifold, arguments: Mapping[str, Sequence[str]]) -> Shape:
    looks = EVENTS in arguments
    return Shape({g: len(content.groups[g]) for g in ("q", "u", "z", "inputs")},
                 manifold.corrections.n_rows if manifold.corrections else 0, manifold.unit_groups,
                 content.events if looks else (), content.event_leaves if looks else (), "reset_directions" in arguments,
                 content.columns, content.carried)


def _solver_sizes(program: Program) -> list[tuple[str, str]]:
    """Macros that the solvers in C read: their largest sizes, whether all calls have these, their numbers."""
    result: dict[str, str] = {}
    for intrinsic, numbers in (("saddle", {"LOOSE": LOOSE, "MASSLESS": MASSLESS, "ROUNDS": ROUNDS}),
                               ("multipliers", {"SMOOTHED": SMOOTHED, "ROUNDS": ROUNDS, "CLEANINGS": CLEANINGS})):
        if f"symdyn_{intrinsic}" in program.intrinsics:
            n, m = program.intrinsics[f"symdyn_{intrinsic}"]
            one_size = f"symdyn_{intrinsic}" in program.one_size and m > 0
            result |= {f"SYMDYN_{intrinsic.upper()}_N": repr(n), f"SYMDYN_{intrinsic.upper()}_M": repr(max(m, 1)),
                       f"SYMDYN_{intrinsic.upper()}_ONE_SIZE": repr(int(one_size)),
                       **{f"SYMDYN_{key}": repr(value) for key, value in numbers.items()}}
    return list(result.items())


def _algorithms(program: Program) -> Algorithms:
    modules = dict.fromkeys(module for a in program.algorithms for module in (_STATES, a.module))
    return Algorithms(tuple(program.intrinsics), tuple(map(text_of, modules)), tuple(_solver_sizes(program)))


def _header(content: Content, program: Program) -> list[str]:
    """Lines that document every argument: order, unit, default."""
    lines = ["SI units, radians. State x = [q; u; z]. Arguments, in order:"]
    for group, title in _SYMBOLS.items():
        names = content.groups[group]
        if not names:
            continue
        lines.append(f"  {title} ({len(names)}):")
        for k, n in enumerate(names):
            unit = content.units.get(n, "")
            default = content.defaults.get(n)
            tail = "".join([f"  [{unit}]" if unit else "", f"  default {default!r}" if default is not None else ""])
            lines.append(f"    {k}  {n}{tail}")
    if program.n_c:
        lines.append(f"  constants c ({program.n_c}): what the prologue computes from the parameters")
    lines += header_of_user_functions(program.user_functions)
    return [*lines, *[f"Skipped: {note}." for note in content.notes]]


def _tables(content: Content) -> dict[str, tuple[Row, ...]]:
    def rows(group: str, values: Mapping[str, float]) -> tuple[Row, ...]:
        return tuple(Row(n, content.units.get(n, ""), repr(float(values.get(n, 0.0)))) for n in content.groups[group])

    return {"coordinates": rows("q", content.initial), "speeds": rows("u", content.initial), "states": rows("z", content.initial),
            "inputs": rows("inputs", content.initial), "parameters": rows("p", content.defaults)}
