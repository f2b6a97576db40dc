"""Hostile values in every public call: each must end in an error of symdyn, or in a result that is valid and finite.

    python -m symdyn.lab.hostile --count 2000 --seed 0        as many calls, drawn at random
    python -m symdyn.lab.hostile --only 17 1203               some of them, with tracebacks
    python -m symdyn.lab.hostile --calls URDF "sweep file"    of these calls alone
    python -m symdyn.lab.hostile --list                       the calls, their slots and the values

A case is a call (symdyn.lab.hostile_calls) with one argument, or one entry of an argument, replaced by a hostile value
(symdyn.lab.hostile_values); of files and command lines, one word. Cases run in a process of their own, which may crash, hang or
take all of its memory, and is then replaced. A case fails with

    traceback   an exception that is no SymdynError
    accepted    a value that can be no argument of this kind passes, such as complex numbers in the place of a state
    not finite  a result that is returned as valid holds NaN or infinity
    warning     a warning of another program, such as NumPy's that it leaves out imaginary parts
    message     an error without a message, or with one of many thousand characters
    crash, hang the process ended, or the call took longer than LIMIT seconds

Exit code 1: a case failed.
"""

from __future__ import annotations

import argparse
import contextlib
import multiprocessing
import os
import random
import re
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.errors import CacheWarning, EvaluationWarning, ModelWarning, SimulationWarning, SymdynError
from symdyn.lab.hostile_calls import COMMAND_WORDS, COMMANDS, FILE_WORDS, Call, calls
from symdyn.lab.hostile_values import VALUES, Value

# Seconds that a call may take, with what it derives and compiles; bytes of memory that the process of the calls may take.
LIMIT, MEMORY = 60.0, 6 * 2**30
# Characters of the longest message that is taken for one.
LONGEST = 20_000
OWN = (CacheWarning, EvaluationWarning, ModelWarning, SimulationWarning)
# Words and numbers of a file or an attribute that are replaced.
_WORD = re.compile(r"(?<==)\s*[^\s\[\]{},]+|(?<=\")[^\"\n]*(?=\")")


@dataclass(frozen=True)
class Result:
    """Result of one case: what was called, and the fault of the outcome, "" if there is none."""

    number: int
    call: str
    what: str
    outcome: str
    fault: str = ""
    detail: str = ""

    def __str__(self) -> str:
        text = f"{self.number:>6}  {self.call}, {self.what}: {self.fault or 'as it should be'}: {self.outcome}"
        return f"{text}\n{self.detail}" if self.detail else text


@dataclass(frozen=True)
class Case:
    """A call with the slot whose value is replaced; entry: the place in a list or the name in a mapping that is, instead of "
      "all."""

    number: int
    call: Call
    slot: str
    value: Value | None
    entry: Any = None
    text: Any = None

    @property
    def what(self) -> str:
        if self.value is None:
            return f"{self.slot} = {self.text!r:.300}"
        return f"{self.slot}{'' if self.entry is None else f'[{self.entry!r}]'} = {self.value.name}"

    def arguments(self) -> dict[str, Any]:
        """The arguments of the call."""
        given = self.call.right()
        given[self.slot] = self.text if self.value is None else _placed(given[self.slot], self.value.make(), self.entry)
        return given


def _placed(right: Any, hostile: Any, entry: Any) -> Any:
    """The right value with the hostile one in the place of an entry, or of all."""
    if entry is None:
        return hostile
    if isinstance(right, Mapping):
        return {**right, entry: hostile}
    entries = right.tolist() if isinstance(right, np.ndarray) else list(right)
    entries[entry] = hostile
    return entries


def draw(number: int, seed: int, names: Sequence[str] = ()) -> Case:
    """The case of a number: the same for the same seed and names, whatever else is drawn. names: of the calls; none: all."""
    stream = random.Random(f"{seed} {number}")
    call = stream.choice([c for c in _calls() if not names or c.name in names])
    slot = stream.choice(list(call.kinds))
    if call.name in ("sweep file", "URDF"):
        return Case(number, call, slot, None, text=_damaged(call.right()[slot], stream))
    if call.name == "command line":
        words = list(stream.choice(COMMANDS))
        words[stream.randrange(len(words))] = stream.choice(COMMAND_WORDS)
        return Case(number, call, slot, None, text=words)
    value, right = stream.choice(VALUES), call.right()[slot]
    entry = None
    if stream.random() < 0.3:
        if isinstance(right, Mapping) and right:
            entry = stream.choice(list(right))
        elif isinstance(right, (list, tuple, np.ndarray)) and len(right):
            entry = stream.randrange(len(right))
    return Case(number, call, slot, value, entry)


def _damaged(text: str, stream: random.Random) -> str:
    """A file's text with one word replaced, now and then a line lost or bytes changed."""
    places = list(_WORD.finditer(text))
    place = stream.choice(places)
    word = stream.choice(FILE_WORDS)
    text = text[:place.start()] + word + text[place.end():]
    if stream.random() < 0.1:
        lines = text.splitlines(keepends=True)
        lines.pop(stream.randrange(len(lines)))
        text = "".join(lines)
    if stream.random() < 0.1:
        k = stream.randrange(len(text))
        text = text[:k] + chr(stream.randrange(256)) + text[k + 1:]
    return text


@cache
def _calls() -> tuple[Call, ...]:
    return tuple(calls())


def run(case: Case, detailed: bool = False) -> Result:
    """Do a case here, and judge it. detailed: with the traceback of what fails."""
    number, name, what = case.number, case.call.name, case.what
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            result = case.call.run(case.arguments())
        except SymdynError as error:
            return Result(number, name, what, f"{type(error).__name__}: {str(error)[:200]}", *_of_message(error))
        except BaseException as error:  # whatever it is, it is the outcome
            detail = traceback.format_exc() if detailed else _place(error)
            return Result(number, name, what, f"{type(error).__name__}: {_text(error)[:200]}", "traceback", detail)
    foreign = [w for w in said if not issubclass(w.category, OWN)]
    if foreign:
        return Result(number, name, what, f"{foreign[0].category.__name__}: {str(foreign[0].message)[:200]}", "warning")
    tags = frozenset() if case.value is None else case.value.tags
    if case.entry is not None and case.call.name.startswith("Module."):  # what a result does not depend on may be anything
        tags -= {"not finite"}
    if tags & case.call.forbidden(case.slot) and not {"empty", "mapping"} <= tags and not said:
        return Result(number, name, what, f"returns {_short(result)}", "accepted")
    bad = not_finite(result)
    if bad and not said:
        return Result(number, name, what, f"returns {bad}", "not finite")
    return Result(number, name, what, f"returns {_short(result)}")


def _text(error: BaseException) -> str:
    try:
        return str(error)
    except Exception as second:
        return f"(its message raises {type(second).__name__})"


def _of_message(error: SymdynError) -> tuple[str, str]:
    """A fault of the message, and more about it."""
    text = _text(error)
    return ("message", f"        of {len(text)} characters") if not text.strip() or len(text) > LONGEST else ("", "")


def _place(error: BaseException) -> str:
    """Where in symdyn an exception came from."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if "symdyn" in f.filename and "/lab/" not in f.filename]
    return "".join(f"        {Path(f.filename).name}:{f.lineno} {f.line}\n" for f in frames[-2:]).rstrip()


def _short(result: Any) -> str:
    with contextlib.suppress(Exception):
        return repr(result)[:100].replace("\n", " ")
    return type(result).__name__


def not_finite(result: Any, depth: int = 4) -> str:
    """Parts of a result that are not finite, in words; "" if there are none. Solutions that say that they failed are no valid
    results."""
    if getattr(result, "success", True) is False:
        return ""
    if isinstance(result, (float, np.floating)):
        return "" if np.isfinite(result) else repr(float(result))
    if isinstance(result, np.ndarray):
        return "" if result.dtype.kind not in "fc" or np.isfinite(result).all() else f"an array {result.shape}, not finite"
    if depth and isinstance(result, Mapping):
        return next((f"{k}: {bad}" for k, v in result.items() if (bad := not_finite(v, depth - 1))), "")
    if depth and isinstance(result, (tuple, list)):
        return next((f"[{k}]: {bad}" for k, v in enumerate(result) if (bad := not_finite(v, depth - 1))), "")
    for field in ("x", "A", "eigenvalues", "frequencies"):
        with contextlib.suppress(SymdynError):
            held = getattr(result, field, None)
            if isinstance(held, np.ndarray) and not isinstance(getattr(result, "success", None), np.ndarray) and (
                    bad := not_finite(held)):
                return f"{field}: {bad}"
    return ""


# -- a process that may crash


def _serve(inbox: Connection, seed: int, names: Sequence[str], detailed: bool, folder: str) -> None:
    """Do the cases whose numbers come in, in a folder of its own."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.chdir(folder)
    tempfile.tempdir = folder
    with contextlib.ExitStack() as stack:
        nowhere = stack.enter_context(open(os.devnull, "w", encoding="utf-8"))
        stack.enter_context(contextlib.redirect_stdout(nowhere))
        stack.enter_context(contextlib.redirect_stderr(nowhere))
        while (number := inbox.recv()) is not None:
            inbox.send(run(draw(number, seed, names), detailed))


class Worker:
    """The process of the calls; another one takes its place when it ends."""

    def __init__(self, seed: int, names: Sequence[str], detailed: bool, folder: str) -> None:
        self.seed, self.names, self.detailed, self.folder = seed, tuple(names), detailed, folder
        self._begin()

    def _begin(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.end, other = context.Pipe()
        self.process = context.Process(
            target=_serve, args=(other, self.seed, self.names, self.detailed, self.folder), daemon=True)
        self.process.start()
        other.close()

    def do(self, number: int) -> Result:
        """The result of a case, also of one that ends the process."""
        with contextlib.suppress(EOFError, ConnectionError):
            self.end.send(number)
            if self.end.poll(LIMIT):
                result: Result = self.end.recv()
                return result
        case = draw(number, self.seed, self.names)
        hangs = self.process.is_alive()
        self.process.kill()
        self.process.join()
        outcome = f"longer than {LIMIT:.0f} s" if hangs else f"the process ended with {self.process.exitcode}"
        self._begin()
        return Result(number, case.call.name, case.what, outcome, "hang" if hangs else "crash")

    def close(self) -> None:
        """End the process."""
        with contextlib.suppress(ConnectionError):
            self.end.send(None)
        self.process.join(1.0)
        self.process.kill()


def results(numbers: Sequence[int], seed: int, names: Sequence[str] = (), detailed: bool = False) -> Iterator[Result]:
    """Results of all cases, in their order; names: of the calls, none: all. Files are written to a temporary folder."""
    with tempfile.TemporaryDirectory(prefix="symdyn-hostile-", ignore_cleanup_errors=True) as folder:
        worker = Worker(seed, names, detailed, folder)
        try:
            for number in numbers:
                yield worker.do(number)
        finally:
            worker.close()


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m symdyn.lab.hostile", description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--count", type=int, default=2000, help="how many calls (default 2000)")
    parser.add_argument("--seed", type=int, default=0, help="of the random numbers (default 0)")
    parser.add_argument("--only", type=int, nargs="+", metavar="K", help="these cases alone, by number, with tracebacks")
    parser.add_argument("--calls", nargs="+", default=[], metavar="NAME", help="these calls alone, as --list names them")
    parser.add_argument("--list", action="store_true", help="list the calls and do nothing else")
    parser.add_argument("--all", action="store_true", help="print also what is as it should be")
    options = parser.parse_args(arguments)
    if options.list:
        for call in _calls():
            print(f"{call.name}: {', '.join(f'{slot} ({kind})' for slot, kind in call.kinds.items())}")
        print(f"values: {', '.join(v.name for v in VALUES)}")
        return 0
    unknown = [name for name in options.calls if name not in {call.name for call in _calls()}]
    if unknown:
        parser.error(f"there is no call {', '.join(unknown)}; see --list")
    faults: Counter[str] = Counter()
    seen = 0
    for result in results(options.only or range(options.count), options.seed, options.calls, bool(options.only)):
        seen += 1
        faults[result.fault] += 1
        if result.fault or options.all or options.only:
            print(result, flush=True)
    failed = seen - faults.pop("", 0)
    print(f"{seen} calls, {failed} fail" + (f": {', '.join(f'{n} {f}' for f, n in faults.most_common())}" if failed else ""))
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
