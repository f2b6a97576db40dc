"""Arguments of `symdyn`."""

from __future__ import annotations

import argparse
import difflib
import math
from collections.abc import Callable, Sequence
from typing import Any

import symdyn
from symdyn.cli import bench
from symdyn.cli.compare import compare
from symdyn.cli.demo import demo
from symdyn.cli.derive import READABLE, derive
from symdyn.cli.diagnose import diagnose
from symdyn.cli.export import add_export, export
from symdyn.cli.generate import generate
from symdyn.cli.list import list_systems
from symdyn.cli.measurements import MEASUREMENTS, overview
from symdyn.cli.report import report
from symdyn.cli.schema import schema
from symdyn.cli.simulate import simulate
from symdyn.cli.stress import stress
from symdyn.cli.sweep import sweep
from symdyn.cli.values import path, stabilization, whole
from symdyn.cli.view import view


class _Parser(argparse.ArgumentParser):
    """The parser of commands, which offers the nearest ones for one that there is not."""

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            known = [name for name in action.choices if " " not in name]
            near = difflib.get_close_matches(str(value), known, 3, cutoff=0.5)
            hint = f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(known)}"
            raise argparse.ArgumentError(None, f"there is no command {value!r}; {hint}")


class _Completion(argparse.Action):
    """Prints the completion of a shell, and ends."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any,
                 option_string: str | None = None) -> None:
        try:
            import shtab
        except ImportError:
            parser.error("--print-completion needs the package shtab: pip install 'symdyn[completion]'")
        if values not in shtab.SUPPORTED_SHELLS:
            parser.error(f"--print-completion: there is no shell {values!r}; there are {', '.join(shtab.SUPPORTED_SHELLS)}")
        print(shtab.complete(parser, values))
        parser.exit()


def make_parser() -> argparse.ArgumentParser:
    """The parser; what it returns holds the function of the command as `run`."""
    parser = _Parser(prog="symdyn", description="Equations of motion of multibody systems: derived "
                     "symbolically, generated as C and NumPy, simulated fast.")
    parser.add_argument("--version", action="version", version=f"symdyn {symdyn.__version__}")
    parser.add_argument("--print-completion", action=_Completion, metavar="SHELL", help="print what a shell completes commands "
                        "and options by: bash, zsh, tcsh (needs shtab)")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True, parser_class=argparse.ArgumentParser)

    def command(name: str, run: Callable[[argparse.Namespace], int], text: str, system: bool = True) -> Any:
        sub = commands.add_parser(name, help=text, description=text)
        sub.set_defaults(run=run)
        if system:
            sub.add_argument("system", metavar="NAME", help="a system of the catalogue (see symdyn list), a Python "
                             "file that defines system(), or a TOML data file (see symdyn schema)")
            sub.add_argument("--option", metavar="KEY=VALUE", nargs="+", action="extend", default=[],
                             help="options of the system, such as n=5")
        return sub

    command("list", list_systems, "list the systems of the catalogue", system=False)
    command("schema", schema, "print the JSON schema of data files, by which editors complete them", system=False)

    def formulation(sub: argparse.ArgumentParser, default: str | None = "auto") -> argparse.ArgumentParser:
        default_text = default or "embedding, of closed loops and constraints augmented"
        sub.add_argument("--formulation", choices=("auto", "embedding", "recursive", "augmented"), default=default,
                         help=f"auto takes the one with the fastest right-hand side (default: {default_text})")
        return coordinates(sub)

    def coordinates(sub: argparse.ArgumentParser) -> argparse.ArgumentParser:
        sub.add_argument("--coordinates", choices=("relative", "absolute"), default="relative",
                         help="of the augmented formulation: those of the joints, or of every body its own (default: relative)")
        return sub

    _add_derive(formulation(command("derive", derive, "print the equations of motion M_tilde u_dot + k_tilde = F_tilde, with "
                                    "multipliers where there are constraints"), None))
    _add_generate(formulation(command("generate", generate, "write source files; no compiler is needed")))
    exported = formulation(command("export", export, "write a mechanism for CasADi, JAX or PyTorch, in Fortran, Julia, "
                                 "MATLAB, Rust or Modelica, as an FMU or a CMake package"))
    add_export(exported)
    _add_output(exported)
    _add_simulate(formulation(command("simulate", simulate, "simulate, and save data and a picture")))
    _add_view(formulation(command("view", view, "look at a mechanism with a slider for every coordinate, or at its motion: one "
                                  "HTML page, which is opened in the browser")))
    _add_sweep(command("sweep", sweep, "simulate many samples of parameters and initial states, as a TOML file describes",
                       system=False))
    proof = command("report", report, "what is generated, what is skipped and why, operation counts, and a proof by "
                    "identities at random states")
    formulation(proof)
    proof.add_argument("--tune", action="store_true", help="compile the candidates and time them, instead of predicting")
    proof.add_argument("--no-verify", action="store_true", help="leave out the proof")
    _add_full(proof)
    _add_diagnose(coordinates(command("diagnose", diagnose, "what the constraints do: freedoms, redundant and contradictory "
                                      "ones, singular configurations, idle motions")))
    _add_compare(command("compare", compare, "what slides print and what symdyn derives, with a verdict on every entry; "
                         "without names the cases are listed", system=False))
    _add_bench(commands)
    _add_stress(command("stress", stress, "numerical stability: every check with a figure, a bound with its reason, and a "
                        "verdict; without names the catalogue, and mechanisms made for the purpose", system=False))
    _add_output(command("demo", demo, "derive, generate, compile, simulate and draw a robot arm that falls freely",
                        system=False))
    return parser


def _add_derive(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quantity", metavar="NAME", nargs="+",
                        help="what to print (default: M_tilde k_tilde F_tilde, with constraints also C_r F_d C)")
    parser.add_argument("--latex", action="store_true", help="print LaTeX")
    parser.add_argument("--shorthand", action="store_true", help="in LaTeX s_1 for sin q_1, c_12 for cos(q_1 + q_2)")
    parser.add_argument("--intermediates", action="store_true", help="in LaTeX velocities, forces and inertias of links by name")
    parser.add_argument("--no-simplify", action="store_true", help="print as derived")
    parser.add_argument("--force", action="store_true", help=f"print also what has more than {READABLE} operations")


def _add_generate(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--backend", metavar="NAME", action="append", help="c, numpy or a folder of --templates; may be "
                        "repeated (default: c and numpy)")
    parser.add_argument("--templates", metavar="DIR", help="folder whose templates take precedence")
    parser.add_argument("--functions", metavar="NAME", nargs="+", help="what to generate (default: rhs, mass_matrix, ...)")
    _add_output(parser)


def _add_simulate(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--t", metavar="TIME", nargs="+", type=float, help="END or START END, s (default: the system's)")
    parser.add_argument("--rtol", type=float, default=1e-8, help="relative tolerance of a step (default: 1e-8)")
    parser.add_argument("--atol", type=float, help="absolute tolerance of a step (default: as rtol)")
    parser.add_argument("--method", help="compiled: dop853 (default), bs54 (loose tolerances), taylor (fine ones), radau "
                        "(stiff), radau5 (stiff, loose tolerances), gauss (long conservative motion); auto (one of dop853, "
                        "bs54, taylor, radau, without a compiler of DOP853, Radau); RK23, RK45, DOP853, Radau, BDF, LSODA of "
                        "SciPy; with constraints also ggl (pip install 'symdyn[dae]')")
    parser.add_argument("--backend", choices=("c", "numpy"), help="default: c if there is a compiler, else numpy")
    for flag, what in (("--set", "parameters, such as m1=2.0"), ("--q", "initial coordinates, such as q1=0.1"),
                       ("--u", "initial speeds, such as q1_dot=1"), ("--z", "initial extra states"),
                       ("--input", "constant inputs, such as F=1")):
        parser.add_argument(flag, metavar="NAME=NUMBER", nargs="+", action="extend", default=[], help=what)
    parser.add_argument("--consistent", action="store_true", help="begin with the nearest state that fulfils the constraints, "
                        "and report what it changes")
    parser.add_argument("--keep", metavar="NAME", nargs="+", action="extend", default=[], help="coordinates and speeds that "
                        "--consistent leaves as they are given")
    parser.add_argument("--stabilization", metavar="WAY", type=stabilization, help="what keeps constraints: projection, "
                        "baumgarte, baumgarte=GAIN (1/s) or none (default: projection; with BDF and LSODA baumgarte)")
    parser.add_argument("--no-picture", action="store_true", help="save data only")
    parser.add_argument("--gif", action="store_true", help="save an animation too")
    parser.add_argument("--report", metavar="FILE", type=path, help="write a report of the run: one HTML file, no network needed")
    parser.add_argument("--progress", action="store_true", help="show a bar (needs tqdm)")
    _add_output(parser)


def _add_view(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--motion", action="store_true", help="simulate, and play the motion")
    parser.add_argument("--t", metavar="TIME", nargs="+", type=float, help="with --motion, END or START END, s (default: the "
                        "system's)")
    parser.add_argument("--forces", action="store_true", help="with --motion, forces in the joints and of loads as arrows")
    for flag, what in (("--set", "parameters, such as m1=2.0"), ("--q", "initial coordinates, such as q1=0.1")):
        parser.add_argument(flag, metavar="NAME=NUMBER", nargs="+", action="extend", default=[], help=what)
    parser.add_argument("--backend", choices=("c", "numpy"), help="default: c if there is a compiler, else numpy")
    parser.add_argument("--no-browser", action="store_true", help="write the page only")
    _add_output(parser)


def _add_sweep(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE.toml", type=path, help="what varies, and what is kept of each motion")
    parser.add_argument("--system", metavar="NAME", help="in the place of the file's: a system of the catalogue, or a Python "
                        "file that defines system()")
    parser.add_argument("--jobs", metavar="N", type=int, help="motions that are computed at a time (default: one a processor)")
    parser.add_argument("--dask", metavar="ADDRESS", help="scheduler of a Dask cluster, such as tcp://host:8786")
    parser.add_argument("--dask-timeout", metavar="SECONDS", type=float, default=30.0, help="how long it is waited for")
    parser.add_argument("--resume", action="store_true", help="go on with a run that was stopped, in the same folder")
    parser.add_argument("--dry-run", action="store_true", help="predict time, memory and disk from ten samples, and what breaks "
                        "first with more of them")
    parser.add_argument("--count", metavar="N", type=whole, help="with --dry-run: samples in place of the file's, such as 1e9")
    parser.add_argument("--workers", metavar="N", type=whole, help="of the cluster, in place of the file's")
    parser.add_argument("--status", action="store_true", help="show what all workers have done so far, and which there are")
    parser.add_argument("--join", action="store_true", help="share the work with all that run in the same folder, at any time "
                        "and on any machine that reaches it; ends when nothing is left to begin")
    parser.add_argument("--stay", action="store_true", help="with --join: wait for the others, and take over what they leave")
    parser.add_argument("--backend", choices=("c", "numpy"), help="default: c if there is a compiler, else numpy")
    parser.add_argument("--no-picture", action="store_true", help="save data only")
    parser.add_argument("--progress", action="store_true", help="show a bar (needs tqdm)")
    _add_output(parser)


def _add_full(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--full", action="store_true", help="write a page that works offline: equations, operations, condition "
                        "of the mass matrix along a motion, work against error, stability under stress, proof")
    parser.add_argument("--budget", metavar="SECONDS", type=float, help="with --full, for work against error (default: 20)")
    parser.add_argument("--output", metavar="DIR", type=path, help="with --full, folder for report.html (default: "
                        "generated/NAME)")


def _add_diagnose(parser: argparse.ArgumentParser) -> None:
    for flag, what in (("--q", "coordinates of the state to look at, such as q1=0.1"), ("--set", "parameters, such as l=2.0")):
        parser.add_argument(flag, metavar="NAME=NUMBER", nargs="+", action="extend", default=[], help=what)
    parser.add_argument("--reach", metavar="ANGLE", type=float, default=math.pi, help="how far from the state singular "
                        "configurations are looked for: rad, or parts of the mechanism's length (default: pi)")


def _add_compare(parser: argparse.ArgumentParser) -> None:
    parser.epilog = ("Exit codes: 0 all is decided; 1 an entry is different or not decided, or something is missing that the "
                     "reports need; 2 it was asked wrongly, or a case has faults.")
    parser.add_argument("cases", metavar="NAME", nargs="*", help="a case of the lecture, a section such as 3.5 or a chapter such "
                        "as 3 for all of its cases, or a Python file that defines CASES")
    parser.add_argument("--all", action="store_true", help="the whole lecture: prints one table, writes reports and errata")
    parser.add_argument("--jobs", metavar="N", type=int, help="processes that share the cases of the lecture (default: 1, "
                        "with --all one a processor)")
    parser.add_argument("--output", metavar="DIR", type=path, help="folder for the reports (default with --all: "
                        "generated/compare)")
    parser.add_argument("--no-pages", action="store_true", help="with --all: the table alone, no reports")


def joined(argv: Sequence[str]) -> list[str]:
    """The arguments with `bench peers` and the like as one word: a command of its own next to `bench`, which takes names."""
    words = list(argv)
    return [" ".join(words[:2]), *words[2:]] if words[:1] == ["bench"] and words[1:2] and words[1] in MEASUREMENTS else words


def _add_bench(commands: Any) -> None:
    text = "what motions cost at every accuracy: time, evaluations and operations against the error"
    work = commands.add_parser("bench", help=f"{text}; also {', '.join(MEASUREMENTS)}",
                               formatter_class=argparse.RawDescriptionHelpFormatter,
                               description=f"Measure {text},\nfor formulations, methods and tolerances, against references of "
                               f"more digits. Measurements of their own:\n\n{overview()}")
    work.set_defaults(run=bench.work)
    work.add_argument("systems", metavar="NAME", nargs="*", help="a system of the catalogue, with its first option such as "
                      "'n_link_pendulum(5)', one of lagrange_top, heavy_top, torque_free_body, or a Python file that defines "
                      "system()")
    work.add_argument("--option", metavar="KEY=VALUE", nargs="+", action="extend", default=[], help="options of the systems, "
                      "such as n=5")
    work.add_argument("--all", action="store_true", help="sixteen mechanisms from the pendulum to the floating turbine")
    for flag, what in (("--formulations", "embedding, recursive, augmented, absolute, absolute:angles, and with Euler "
                        "parameters embedding:parameters and the like (default: all that there are)"),
                       ("--methods", "compiled ones, SciPy's, auto (default: all compiled ones; without a compiler RK45, DOP853, "
                        "Radau, LSODA)"),
                       ("--against", "other programs in the same run: scipy cvode ida heyoka casadi pinocchio mujoco exudyn; "
                        "or all")):
        work.add_argument(flag, metavar="NAME", nargs="+", help=what)
    for flag, metavar, what in (("--rtol", "TOLERANCE", "tolerances, relative and absolute (default: 1e-3 to 1e-15)"),
                                ("--steps", "STEP", "s, for gauss, whose steps have one length, besides the tolerances"),
                                ("--at", "TIME", "s, times besides the end at which errors are reported; runs that end there are "
                                 "timed alone")):
        work.add_argument(flag, metavar=metavar, nargs="+", type=float, help=what)
    work.add_argument("--per-decade", metavar="N", type=int, default=1, help="tolerances to a decade (default: 1); with more "
                      "the least time below an error is reported more sharply")
    work.add_argument("--end", metavar="TIME", type=float, help="s (default: the system's duration)")
    work.add_argument("--repeats", metavar="N", type=int, default=5, help="timed runs, of which the least time is compared "
                      "(default: 5)")
    work.add_argument("--budget", metavar="SECONDS", type=float, help="begin no run after this time, in which derivation, "
                      "references, compilation and what other programs prepare count; of several mechanisms each has its part; "
                      "the same command goes on")
    work.add_argument("--progress", action="store_true", help="show a bar (needs tqdm)")
    _add_output(work, "generated/bench; what an unfinished run left there is gone on with")
    for word, measurement in MEASUREMENTS.items():
        sub = commands.add_parser(f"bench {word}", prog=f"symdyn bench {word}", description=measurement.text)
        sub.set_defaults(run=measurement.run)
        for option in measurement.options:
            option.add(sub)


def _add_stress(parser: argparse.ArgumentParser) -> None:
    parser.epilog = "Exit codes: 0 nothing failed; 1 a check failed; 2 it was asked wrongly."
    parser.add_argument("systems", metavar="NAME", nargs="*", help="as of symdyn bench: a system of the catalogue, such as "
                        "\"n_link_pendulum(3)\", or a Python file that defines system()")
    parser.add_argument("--option", metavar="KEY=VALUE", nargs="+", action="extend", default=[], help="options of the systems, "
                        "such as n=5")
    parser.add_argument("--short", action="store_true", help="fewer states, systems and ratios, shorter runs, rounding of C code "
                        "at -O0 only, and of checks that are not named those that need no long time: less than half a minute")
    parser.add_argument("--checks", metavar="CHECK", nargs="+", help="some of the checks, by name")
    parser.add_argument("--list", action="store_true", help="list the checks and do nothing else")
    parser.add_argument("--jobs", metavar="N", type=int, help="processes that share the work (default: one a processor)")
    parser.add_argument("--progress", action="store_true", help="show a bar (needs tqdm)")
    _add_output(parser, "generated/stress")


def _add_output(parser: argparse.ArgumentParser, default: str = "generated/NAME") -> None:
    parser.add_argument("--output", metavar="DIR", type=path, help=f"folder for the files (default: {default})")
