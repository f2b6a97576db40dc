"""Measurements of `symdyn bench` with words of their own: a row of a table for each."""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from symdyn.cli.messages import FAILED
from symdyn.cli.values import path


@dataclass(frozen=True)
class Option:
    """An option of a word: the parameter of the function that takes it, its flag ("" for what stands without one), and further
    settings of argparse."""

    parameter: str
    flag: str
    settings: dict[str, Any]

    def add(self, parser: argparse.ArgumentParser) -> None:
        """Add it to a parser."""
        if self.flag:
            parser.add_argument(self.flag, dest=self.parameter, **self.settings)
        else:
            parser.add_argument(self.parameter, **self.settings)


@dataclass(frozen=True)
class Measurement:
    """A word after `symdyn bench`: where its function is ("module:name", imported when it is called; it returns how many bounds
    are missed), what it does, its options."""

    where: str
    text: str
    options: tuple[Option, ...] = ()

    def function(self) -> Callable[..., int]:
        """Function that is called."""
        module, _, name = self.where.partition(":")
        return getattr(importlib.import_module(module), name)  # type: ignore[no-any-return]

    def run(self, arguments: argparse.Namespace) -> int:
        """Measure; a missed bound is a failure. Arguments that are not given take the function's defaults."""
        given = {o.parameter: getattr(arguments, o.parameter) for o in self.options}
        return FAILED if self.function()(**{name: value for name, value in given.items() if value is not None}) else 0


def _names(flag: str, parameter: str, text: str, metavar: str = "NAME") -> Option:
    return Option(parameter, flag, {"metavar": metavar, "nargs": "+", "help": f"{text} (default: all)"})


def _number(flag: str, parameter: str, text: str, kind: type = int, metavar: str = "N") -> Option:
    return Option(parameter, flag, {"metavar": metavar, "type": kind, "help": text})


def _folder(name: str) -> Option:
    return Option("folder", "--output", {"metavar": "DIR", "type": path, "help": f"folder for files (default: generated/{name})"})


_ONLY = _names("--only", "only", "some of the groups of figures", "GROUP")
_TIMED = _number("--repeats", "repeats", "timed runs, of which the median counts (default: 5)")
_LEAST = _number("--repeats", "repeats", "timed runs, of which the least time is compared (default: 5)")
_BEST = _number("--repeats", "repeats", "timings of each program, of which the best counts (default: 40)")
_JSON = Option("to_json", "--json", {"metavar": "FILE", "type": path, "help": "write everything that was measured into a file"})
_STORE = Option("file", "--store", {"metavar": "FILE", "type": path,
                                    "help": "file to store them in next to what it holds (default: the package's own)"})

MEASUREMENTS: dict[str, Measurement] = {
    "figures": Measurement(
        "symdyn.lab.pipeline:run", "the pipeline, from description to motion: times, operations, energy errors", (_ONLY,)),
    "peers": Measurement(
        "symdyn.lab.peers.command:run", "accelerations compared with Pinocchio and CasADi's C code, in one run", (
            _names("--models", "names", "some of the mechanisms, such as spatial_chain or 'spatial_chain(7)'"), _BEST, _JSON,
            Option("of_derivatives", "--derivatives", {"action": "store_true", "help": "derivatives of the accelerations by q "
                   "and u, in place of the accelerations"}))),
    "sympy": Measurement(
        "symdyn.lab.sympy_models.measure:run",
        "examples of SymPy's and PyDy's taken over: agreement, operations, times compared with lambdify",
        (_names("--only", "only", "some of the examples, such as bicycle or pendulum_on_cart"),)),
    "robots": Measurement(
        "symdyn.lab.robots.command:run", "robots from URDF files compared with Pinocchio: agreement, operations, times", (
            _names("--only", "only", "some of the robots; names with * and ?", "ROBOT"),
            _number("--states", "states", "random states of each robot (default: 100)"),
            Option("no_times", "--no-times", {"action": "store_true", "help": "compile nothing"}))),
    "loops": Measurement(
        "symdyn.lab.loops:run", "mechanisms with loops compared with published motions and closed forms", (
            _names("--systems", "names", "some of the mechanisms, such as andrews_squeezer or 'n_four_bar(2)'"), _TIMED, _JSON)),
    "published": Measurement(
        "symdyn.lab.published.command:run", "published mechanisms within their bounds, in the least time of all programs", (
            _names("--only", "names", "some of the mechanisms, such as A03"),
            _names("--against", "peers", "other programs, as of symdyn bench"), _LEAST,
            _number("--budget", "budget", "begin nothing new after this time, in which derivation, compilation and the "
                    "search for tolerances count; the same command goes on", float, "SECONDS"),
            _folder("published"), Option("progress", "--progress", {"action": "store_true", "help": "show a bar (needs tqdm)"}))),
    "contacts": Measurement(
        "symdyn.lab.contacts:run", "contact by work against error: switches located and time stepping, MuJoCo, Exudyn", (
            _names("--only", "names", "some of the motions ball, oscillator, billiard, and of the costs walker, open"),
            _number("--repeats", "repeats", "timed runs, of which the least time counts (default: 3)"), _folder("contacts"))),
    "balls": Measurement(
        "symdyn.lab.many_contacts:run", "balls in a box by time stepping: times, and how far the laws of contact are missed", (
            Option("numbers", "--numbers", {"metavar": "N,N", "help": "numbers of balls (default: 30,60,125,250,500)"}),
            _number("--step", "step", "length of the steps, s (default: 0.005)", float, "SECONDS"))),
    "growth": Measurement(
        "symdyn.lab.growth:run", "how everything grows with the number of bodies: table and picture", (
            Option("sizes", "--sizes", {"metavar": "N", "nargs": "+", "type": int,
                                        "help": "numbers of bodies (default: 2 to 100)"}),
            _folder("growth"))),
    "rolled": Measurement(
        "symdyn.lab.rolled:run", "loops for what like bodies repeat, compared with straight-line code: table and picture", (
            _names("--only", "names", "some of n_link_pendulum, spatial_chain, cable, legs"),
            Option("sizes", "--sizes", {"metavar": "N", "nargs": "+", "type": int,
                                        "help": "numbers of bodies (default: 10 to 1000)"}),
            _folder("rolled"))),
    "stiff": Measurement(
        "symdyn.lab.stiff_cables:run",
        "stiff cables by factors in a band and by SciPy's sparse ones; at rest compared with closed forms", (
            Option("sizes", "--sizes", {"metavar": "N", "nargs": "+", "type": int,
                                        "help": "numbers of links (default: 10, 100, 250, 500, 1000)"}), _JSON)),
    "bridges": Measurement(
        "symdyn.lab.bridges:run", "footbridges of up to 200 bars: growth, accelerations compared with 60 digits, energy", (
            Option("sizes", "--sizes", {"metavar": "N", "nargs": "+", "type": int,
                                        "help": "numbers of bars, each 3 n + 2 (default: 20, 50, 101, 200)"}), _JSON)),
    "nets": Measurement(
        "symdyn.lab.nets:run", "nets of rods: growth, accelerations compared with 60 digits, energy", (
            Option("sizes", "--sizes", {"metavar": "N", "nargs": "+", "type": int,
                                        "help": "numbers of particles along a side (default: 5, 10)"}), _JSON)),
    "windows": Measurement(
        "symdyn.lab.windows:run", "chains of up to 100 four-bars: growth, accelerations compared with 60 digits, energy", (
            Option("sizes", "--sizes", {"metavar": "N", "nargs": "+", "type": int,
                                        "help": "numbers of four-bars (default: 25, 50, 100)"}), _JSON)),
    "printing": Measurement(
        "symdyn.lab.printing:run", "operations of printed equations in every form, and the time", (
            _names("--systems", "only", "some of the mechanisms of the catalogue"),
            Option("against", "--against", {"choices": ("sympy",), "default": "", "help": "with what SymPy simplifies "
                   "KanesMethod's equations to, a minute at most each"}))),
    "batch": Measurement(
        "symdyn.lab.batch:run", "many states and motions at once, compared with one after the other and Pinocchio", (_ONLY,)),
    "gpu": Measurement(
        "symdyn.lab.gpu:run", "a million motions on a GPU compared with the processor; without one, what kernels need",
        (_ONLY,)),
    "sweep": Measurement(
        "symdyn.lab.sweep:run", "a sweep of a million short motions: rate, memory, a run that is killed and goes on", (
            _number("--count", "count", "motions (default: 1000000)"),
            _number("--seed", "seed", "of the moment of the kill (default: another one every time)"))),
    "predictions": Measurement(
        "symdyn.lab.predictions:run", "dry runs of three sweeps compared with the sweeps; memory in which results are merged", (
            _number("--rows", "rows", "that are put together (default: 10000000)"),
            _number("--part", "part", "of the motions of the sweeps (default: 1)", float, "PART"),
            _number("--jobs", "jobs", "threads of a sweep (default: 1)"))),
    "sensitivities": Measurement(
        "symdyn.lab.sensitivities:run", "derivatives of motions: errors, times compared with CasADi's CVODES and diffrax",
        (_ONLY,)),
    "optimize": Measurement(
        "symdyn.lab.optimize:run", "optimal motions: cost, iterations, time, compared with the same problems in plain CasADi",
        (_ONLY,)),
    "turbine": Measurement(
        "symdyn.lab.turbine:run", "the floating wind turbine: agreement, energy, equilibria, periods, run time", (_ONLY,)),
    "flexible": Measurement(
        "symdyn.lab.flexible:run", "flexible bodies: published frequencies and motions, energy, limits", (_ONLY,)),
    "pages": Measurement(
        "symdyn.lab.pages:run", "pages that play, without a graphics card: pictures a second, processor time of each", (_ONLY,)),
    "costs": Measurement(
        "symdyn.lab.cost_model:run", "the constants by which the fastest formulation is predicted, from 40 systems", (_BEST,)),
    "references": Measurement(
        "symdyn.bench.work.store:run", "make the references of work against error again, with more digits than floats", (
            Option("names", "", {"metavar": "NAME", "nargs": "*", "help": "some of symdyn bench --all (default: all)"}),
            _number("--digits", "digits", "of the local errors (default: 20)"), _STORE)),
    "extended": Measurement(
        "symdyn.lab.extended:run", "make the references of symdyn bench loops again, with more digits than floats", (
            Option("names", "", {"metavar": "NAME", "nargs": "+", "help": "such as puma560, or 'flyball_governor(rods)'"}),
            _number("--t", "end", "s (default: the system's duration, which is the published one)", float, "END"),
            _number("--digits", "digits", "of the local errors (default: 26)"), _STORE,
            Option("print_only", "--print", {"action": "store_true", "help": "print only, store nothing"}))),
}


def overview() -> str:
    """A line of every word, for help."""
    return "\n".join(f"  symdyn bench {word:11} {m.text}" for word, m in MEASUREMENTS.items())
