"""The command line: symdyn list | derive | generate | simulate | report | demo.

Everything is imported when it is needed, so that help and list come at once and a simulation that was done before
starts without SymPy. Exit codes: 0 done, 1 it could not be done, 2 it was asked wrongly, 3 the simulation stopped
early, 130 interrupted.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import time as clock
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symdyn.errors import CompileError, CompilerNotFound, EvaluationError, MissingExtra, SymdynError

if TYPE_CHECKING:
    from symdyn.formulation.embedding import EmbeddedEquations
    from symdyn.model.system import System
    from symdyn.runtime.module import Module
    from symdyn.runtime.solution import Solution

FAILED, WRONG, STOPPED, INTERRUPTED = 1, 2, 3, 130
# Quantities with more operations than this, written out, are counted and not printed: nobody reads them.
READABLE = 1000
SHOWN = 12
FILM_SECONDS = 20.0
_LATEX = {"M_tilde": r"\tilde{M}", "k_tilde": r"\tilde{k}", "F_tilde": r"\tilde{F}", "Jdot": r"\dot{J}",
          "Jd_qd": r"\dot{J} \dot{q}"}


class _Stop(Exception):
    """Ends the program with a message and an exit code."""

    def __init__(self, message: str, code: int = WRONG) -> None:
        super().__init__(message)
        self.code = code


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; returns its exit code."""
    arguments = _parser().parse_args(argv)
    with warnings.catch_warnings():
        warnings.showwarning = _show_warning
        try:
            code = int(arguments.run(arguments))
            sys.stdout.flush()
            return code
        except _Stop as stop:
            return _complain(str(stop), stop.code)
        except (CompileError, CompilerNotFound, EvaluationError, MissingExtra) as error:
            return _complain(str(error), FAILED)
        except SymdynError as error:
            return _complain(str(error), WRONG)
        except BrokenPipeError:
            # The reader had enough. What Python still wants to flush at exit must go nowhere.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return FAILED
        except OSError as error:
            return _complain(str(error), FAILED)
        except KeyboardInterrupt:
            return _complain("interrupted", INTERRUPTED)


def _complain(message: str, code: int) -> int:
    sys.stdout.flush()
    print(f"symdyn: {message}", file=sys.stderr)
    return code


def _show_warning(message: Any, category: type[Warning], filename: str, lineno: int, file: Any = None,
                  line: str | None = None) -> None:
    print(f"symdyn: warning: {message}", file=sys.stderr)


# -- arguments


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="symdyn", description="Equations of motion of multibody systems: derived "
                                     "symbolically, generated as C and NumPy, simulated fast.")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def command(name: str, run: Callable[[argparse.Namespace], int], text: str, system: bool = True) -> Any:
        sub = commands.add_parser(name, help=text, description=text)
        sub.set_defaults(run=run)
        if system:
            sub.add_argument("system", metavar="NAME", help="a system of the catalogue (see symdyn list), or a Python "
                             "file that defines system()")
            sub.add_argument("--option", metavar="KEY=VALUE", nargs="+", action="extend", default=[],
                             help="options of the system, such as n=5")
        return sub

    command("list", _list, "list the systems of the catalogue", system=False)

    derive = command("derive", _derive, "print the equations of motion M_tilde u_dot + k_tilde = F_tilde")
    derive.add_argument("--quantity", metavar="NAME", nargs="+", default=["M_tilde", "k_tilde", "F_tilde"],
                        help="what to print (default: M_tilde k_tilde F_tilde)")
    derive.add_argument("--latex", action="store_true", help="print LaTeX")
    derive.add_argument("--no-simplify", action="store_true", help="print as derived")
    derive.add_argument("--force", action="store_true", help=f"print also what has more than {READABLE} operations")

    generate = command("generate", _generate, "write source files; no compiler is needed")
    generate.add_argument("--backend", metavar="NAME", action="append", help="c, numpy or a folder of --templates; may be "
                          "repeated (default: c and numpy)")
    generate.add_argument("--templates", metavar="DIR", help="folder whose templates take precedence")
    generate.add_argument("--functions", metavar="NAME", nargs="+", help="what to generate (default: rhs, mass_matrix, ...)")
    _add_output(generate)

    simulate = command("simulate", _simulate, "simulate, and save data and a picture")
    simulate.add_argument("--t", metavar="TIME", nargs="+", type=float, help="END or START END, s (default: the system's)")
    simulate.add_argument("--rtol", type=float, default=1e-8, help="relative tolerance of a step (default: 1e-8)")
    simulate.add_argument("--atol", type=float, help="absolute tolerance of a step (default: as rtol)")
    simulate.add_argument("--method", help="dop853 (compiled), or RK23, RK45, DOP853, Radau, BDF, LSODA of SciPy")
    simulate.add_argument("--backend", choices=("c", "numpy"), help="default: c if there is a compiler, else numpy")
    for flag, what in (("--set", "parameters, such as m1=2.0"), ("--q", "initial coordinates, such as q1=0.1"),
                       ("--u", "initial speeds, such as q1_dot=1"), ("--z", "initial extra states"),
                       ("--input", "constant inputs, such as F=1")):
        simulate.add_argument(flag, metavar="NAME=NUMBER", nargs="+", action="extend", default=[], help=what)
    simulate.add_argument("--no-picture", action="store_true", help="save data only")
    simulate.add_argument("--gif", action="store_true", help="save an animation too")
    simulate.add_argument("--progress", action="store_true", help="show a bar (needs tqdm)")
    _add_output(simulate)

    report = command("report", _report, "what is generated, what is skipped and why, operation counts, and a proof by "
                     "identities at random states")
    report.add_argument("--no-verify", action="store_true", help="leave out the proof")

    demo = command("demo", _demo, "derive, generate, compile, simulate and draw a robot arm that falls freely",
                   system=False)
    _add_output(demo)
    return parser


def _add_output(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--output", metavar="DIR", type=Path, help="folder for the files (default: generated/NAME)")


def _pairs(items: Iterable[str], what: str) -> dict[str, str]:
    """name -> text from name=text."""
    found: dict[str, str] = {}
    for item in items:
        name, sign, text = item.partition("=")
        if not (name and sign and text):
            raise _Stop(f"{what} {item!r}: write name=value")
        if name in found:
            raise _Stop(f"{what} {name} is given twice: {found[name]} and {text}")
        found[name] = text
    return found


def _numbers(items: Iterable[str], what: str) -> dict[str, float] | None:
    """name -> number from name=number; None if there are none."""
    found = {}
    for name, text in _pairs(items, what).items():
        try:
            found[name] = float(text)
        except ValueError:
            raise _Stop(f"{what} {name}={text}: {text!r} is not a number") from None
    return found or None


def _value(text: str) -> bool | int | float | str:
    """What an option's text stands for."""
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    if re.fullmatch(r"[+-]?\d+", text):
        return int(text)
    if re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", text):
        return float(text)
    return text


# -- systems


def _system(name: str, options: Mapping[str, Any]) -> System:
    """The system of the catalogue, or of a Python file."""
    from symdyn import systems

    if name in systems.names():
        _check_options(name, getattr(systems, name), options)
        return systems.get(name, **options)
    if name.endswith(".py") or Path(name).is_file():
        return _from_file(Path(name), options)
    try:
        return systems.get(name)
    except SymdynError as error:
        raise _Stop(f"{error}; the path of a Python file that defines system() is taken too") from None


def _check_options(name: str, function: Callable[..., Any], options: Mapping[str, Any]) -> None:
    """Options that the function takes, of the kinds of their defaults."""
    import inspect

    known = inspect.signature(function).parameters
    if any(p.kind is p.VAR_KEYWORD for p in known.values()):
        return
    for key, value in options.items():
        if key not in known:
            takes = ", ".join(f"{p.name}={p.default}" for p in known.values() if p.default is not p.empty)
            raise _Stop(f"{name} has no option {key!r}; it has {takes or 'none'}")
        default = known[key].default
        kinds: tuple[type, ...] = (int, float) if type(default) is float else (type(default),)
        if isinstance(default, (bool, int, float, str)) and type(value) not in kinds:
            raise _Stop(f"option {key} of {name} must be of the kind {type(default).__name__}, such as {default}; found "
                        f"{value!r}")
    missing = [p.name for p in known.values() if p.default is p.empty and p.kind in (
        p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY) and p.name not in options]
    if missing:
        raise _Stop(f"{name} needs --option {' '.join(f'{m}=...' for m in missing)}")


def _from_file(path: Path, options: Mapping[str, Any]) -> System:
    """What system() of a user's file returns. The file is a program, and is run."""
    import importlib.util

    if not path.is_file():
        raise _Stop(f"there is no file {path}")
    spec = importlib.util.spec_from_file_location(f"symdyn_user_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise _Stop(f"{path} is not a Python file; its name must end in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    try:
        spec.loader.exec_module(module)
        make = getattr(module, "system", None)
        if not callable(make):
            raise _Stop(f"{path} defines no function system(); add one that returns a symdyn System")
        _check_options(f"system() of {path}", make, options)
        result = make(**options)
    except _Stop:
        raise
    except (Exception, SystemExit) as error:  # whatever the user's program raises is told as its own
        raise _Stop(_users_fault(error, path)) from None
    from symdyn.model.system import System

    if not isinstance(result, System):
        raise _Stop(f"system() of {path} returned {result!r}; it must return a symdyn System")
    return result


def _users_fault(error: BaseException, path: Path) -> str:
    """The sentence, and the lines of the user's file that led there."""
    import traceback

    here = path.resolve()
    frames = [f for f in traceback.extract_tb(error.__traceback__) if Path(f.filename).resolve() == here]
    lines = "".join([*traceback.format_list(frames), *traceback.format_exception_only(error)]).rstrip()
    return f"{path} ended with {type(error).__name__}:\n{lines}"


def _options(arguments: argparse.Namespace) -> dict[str, Any]:
    return {name: _value(text) for name, text in _pairs(arguments.option, "--option").items()}


def _equations(arguments: argparse.Namespace) -> EmbeddedEquations:
    return _system(arguments.system, _options(arguments)).embedding()


def _module(arguments: argparse.Namespace) -> Module:
    """The numeric module; one of the catalogue is remembered from run to run."""
    from symdyn import systems

    if arguments.system not in systems.names():
        return _equations(arguments).compile(arguments.backend)  # type: ignore[no-any-return]
    from symdyn.runtime.recall import recall

    options = _options(arguments)
    if options:
        _check_options(arguments.system, getattr(systems, arguments.system), options)
    return recall(arguments.system, options, arguments.backend)


# -- list


def _list(arguments: argparse.Namespace) -> int:
    rows = [(name, *_about(name)) for name in _names()]
    width = max(len(row[0]) for row in rows) + 2
    for name, text, options in rows:
        print(f"{name:{width}}{text}")
        if options:
            print(f"{'':{width}}--option {options}")
    return 0


def _names() -> list[str]:
    from symdyn import systems

    return systems.names()


def _about(name: str) -> tuple[str, str]:
    """First line of the docstring, and options, read from the source: importing it would import SymPy."""
    import ast

    import symdyn

    for path in sorted(Path(symdyn.__file__).parent.joinpath("systems").glob("*.py")):
        source = path.read_text(encoding="utf-8")
        if f"def {name}(" not in source:
            continue
        for node in ast.parse(source).body:
            if isinstance(node, ast.FunctionDef) and node.name == name:
                text = (ast.get_docstring(node) or "").partition("\n")[0]
                options = zip(reversed(node.args.args), reversed(node.args.defaults))
                return text, " ".join(reversed([f"{a.arg}={ast.unparse(d).strip(chr(39))}" for a, d in options]))
    return "", ""


# -- derive


def _derive(arguments: argparse.Namespace) -> int:
    equations = _equations(arguments)
    for name in arguments.quantity:
        equations.quantity(name)
    s = equations.symbols
    if not arguments.latex:
        print(f"{equations.name}: M_tilde u_dot + k_tilde = F_tilde")
        for what, symbols in (("coordinates q", s.coordinates), ("speeds u", s.speeds), ("inputs", s.inputs),
                              ("parameters", s.parameters)):
            if symbols:
                print(f"  {what}: " + ", ".join(f"{x.name} [{s.units[x]}]" if s.units.get(x) else x.name for x in symbols))
    for name in arguments.quantity:
        count, shape = _written_out(equations, name), equations.quantity(name).shape
        if count > READABLE and not arguments.force:
            size = " x ".join(map(str, shape)) or "a number"
            steps = equations.tape(name).operations
            note = f"{name} ({size}): {count} operations written out, {steps} in generated code; --force prints it"
            print(f"% {note}" if arguments.latex else f"\n{note}")
            continue
        value = equations.explicit(name, simplify=not arguments.no_simplify)
        print(_latex(name, value) if arguments.latex else f"\n{name} =\n{_pretty(value)}")
    return 0


def _written_out(equations: EmbeddedEquations, name: str) -> int:
    """Operations of the quantity as explicit expressions, where nothing is shared."""
    from symdyn.tape.node import Node

    tape = equations.tape(name)
    counts: dict[Node, int] = {}
    for node in tape.steps:
        below = sum(counts[a] for a in node.args if isinstance(a, Node)) if node.op != "leaf" else -1
        counts[node] = 1 + below
    return sum(counts[e] for e in tape.outputs[name].entries if isinstance(e, Node))


def _pretty(value: Any) -> str:
    import shutil

    import sympy as sp

    wide = (sys.stdout.encoding or "").lower().startswith("utf")
    columns = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    if wide:
        value = value.xreplace({x: _dotted(x.name) for x in value.free_symbols if x.name.endswith("_dot")})
    return str(sp.pretty(value, use_unicode=wide, wrap_line=columns is not None, num_columns=columns))


def _dotted(name: str) -> Any:
    """The symbol that SymPy prints with a dot: qdot_1 for q1_dot."""
    import sympy as sp

    letters, index = re.fullmatch(r"(.*?)(_?\d*)", name.removesuffix("_dot")).groups()  # type: ignore[union-attr]
    return sp.Symbol(f"{letters}dot{index}")


def _latex(name: str, value: Any) -> str:
    import sympy as sp

    return f"{_LATEX.get(name, sp.latex(sp.Symbol(name)))} = {sp.latex(value)}"


# -- generate


def _generate(arguments: argparse.Namespace) -> int:
    equations = _equations(arguments)
    _write_files(equations, arguments.backend or ["c", "numpy"], arguments.output, arguments.functions,
                 arguments.templates)
    return 0


def _write_files(equations: EmbeddedEquations, backends: Sequence[str], output: Path | None,
                 functions: Sequence[str] | None = None, templates: str | None = None) -> Path:
    """Write and tell; returns the folder."""
    from symdyn.pipeline import emit, write_source

    operations: Mapping[str, int] = {}
    sources = [emit(equations, backend, functions, templates) for backend in backends]
    folder = output or Path("generated") / sources[0].metadata["name"]
    for source in sources:
        for path in write_source(source, folder):
            print(f"wrote {path}")
        operations = source.metadata["operations"]
    print("operations: " + ", ".join(f"{name} {count}" for name, count in operations.items()))
    print("No compiler was needed; the first lines of main.c tell how to build." if "c" in backends else
          "No compiler was needed.")
    return folder


# -- simulate


def _simulate(arguments: argparse.Namespace) -> int:
    from symdyn.errors import SimulationInterrupted, SimulationWarning

    if arguments.t is not None and len(arguments.t) > 2:
        raise _Stop(f"--t takes END or START END, found {len(arguments.t)} times")
    t = None if arguments.t is None else (0.0, *arguments.t)[-2:]
    values = {what: _numbers(items, flag) for what, flag, items in (
        ("params", "--set", arguments.set), ("q", "--q", arguments.q), ("u", "--u", arguments.u), ("z", "--z", arguments.z),
        ("inputs", "--input", arguments.input))}
    module = _module(arguments)
    folder = arguments.output or Path("generated") / module.name
    folder.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore", SimulationWarning)
    code = 0
    try:
        solution = module.simulate(t, **values, rtol=arguments.rtol, atol=arguments.atol, method=arguments.method,
                                   progress=arguments.progress)
    except SimulationInterrupted as stop:
        solution, code = stop.solution, INTERRUPTED  # type: ignore[assignment]
    if not solution.success:
        code = code or STOPPED
        _complain(solution.message, code)
    _summarize(solution)
    _save(solution, folder, picture=not arguments.no_picture, film=arguments.gif)
    return code


def _summarize(solution: Solution) -> None:
    module, metadata = solution.module, solution.module.metadata
    where = {"c": "compiled C", "numpy": "NumPy"}.get(solution.backend, solution.backend)
    end = f"{solution.t[-1]:.6g}" if len(solution.t) else "nothing"
    print(f"{module.name}: {solution.method} on {where} to t = {end} s" + ("" if solution.success else ", stopped early"))
    if module.fallback:
        print(f"  {module.fallback}")
    inside = solution.integrator_seconds
    time = f"{1e3 * solution.seconds:.3g} ms" if inside is None else f"{1e3 * inside:.3g} ms inside the integrator"
    print(f"  {solution.n_steps} steps, {solution.nfev} evaluations, {time}")
    if "energy" in module.functions and len(solution.t):
        print(f"  {_energy(solution)}")
    if len(solution.t):
        names = metadata["x"]
        state = ", ".join(f"{n} = {v:.6g}" for n, v in list(zip(names, solution.x[-1]))[:SHOWN])
        more = f", and {len(names) - SHOWN} more in the files" if len(names) > SHOWN else ""
        print(f"  at the end: {state}{more}")


def _energy(solution: Solution) -> str:
    """The energy error where energy is kept, else how it changed."""
    module = solution.module
    kept = "power" in module.functions and not module.evaluate("power", solution.t, solution.x, solution.params,
                                                               solution.inputs).any()
    if kept:
        return f"energy is kept to {solution.energy_error():.2g} of its largest part"
    return f"energy goes from {solution.energy[0]:.6g} J to {solution.energy[-1]:.6g} J by loads and drives"


def _save(solution: Solution, folder: Path, picture: bool, film: bool) -> None:
    stem = folder / solution.module.name
    for ending in (".npz", ".csv"):
        print(f"wrote {solution.save(stem.with_name(stem.name + ending))}")
    try:
        if picture:
            path = stem.with_name(stem.name + ".png")
            solution.plot(path)
            print(f"wrote {path}")
        if film:
            path = stem.with_name(stem.name + ".gif")
            length = abs(solution.t[-1] - solution.t[0]) if len(solution.t) else 0.0
            solution.animate(path, speed=max(1.0, length / FILM_SECONDS))
            print(f"wrote {path}")
    except MissingExtra as missing:
        print(f"no picture: {missing}")


# -- report


def _report(arguments: argparse.Namespace) -> int:
    equations = _equations(arguments)
    print(equations.compile().report())
    if not arguments.no_verify:
        print()
        print(equations.verify())
    return 0


# -- demo


def _demo(arguments: argparse.Namespace) -> int:
    """The main job on a real mechanism, stage by stage."""
    begun = clock.perf_counter()
    print("The PUMA 560 falls freely under gravity: six joints in space, no motors.")
    with _Stage("derive"):
        equations = _system("puma560", {}).embedding()
        rhs = equations.tape("rhs")
        print(f"  {len(equations.symbols.coordinates)} coordinates; accelerations take {rhs.operations} operations")
    with _Stage("generate"):
        folder = _write_files(equations, ["c", "numpy"], arguments.output)
    with _Stage("compile"):
        module = equations.compile()
        module.unit("rhs")
        print(f"  {_loaded(module)}")
    with _Stage("simulate"):
        solution = module.simulate()
        _summarize(solution)
    with _Stage("save and draw"):
        _save(solution, folder, picture=True, film=False)
    print(f"all of it: {clock.perf_counter() - begun:.2f} s")
    return 0 if solution.success else STOPPED


def _loaded(module: Module) -> str:
    from symdyn.runtime.compiler import find_compiler

    compiler = find_compiler() if module.backend == "c" else None
    if compiler is None:
        return f"NumPy. {module.fallback}"
    return f"C, by {compiler.version}; a library that was built before is used again"


class _Stage:
    """Tells the name of a stage before it, and its time after it."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __enter__(self) -> None:
        print(f"{self.name}", flush=True)
        self.begun = clock.perf_counter()

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        if kind is None:
            print(f"  {clock.perf_counter() - self.begun:.2f} s", flush=True)


if __name__ == "__main__":
    raise SystemExit(main())
