"""Share of corruptions of a written module that its self-test finds.

One constant, operation, function or index of the generated functions is changed at a time, and the self-test of the changed file
is run. Corruptions that it does not find are judged by a thorough self-test with many more states: one that this does not find
either is equivalent, in the sampled region, to the file as written.

    python -m symdyn.lab.mutants                       # 84 corruptions of each of some mechanisms, NumPy and C
    python -m symdyn.lab.mutants four_bar --backend c --count 20
"""

from __future__ import annotations

import argparse
import contextlib
import io
import random
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from symdyn import systems
from symdyn.backend.source import Source
from symdyn.pipeline import emit
from symdyn.runtime.building.compiler import require_compiler

# Mechanisms with open chains, loops and contacts, whose functions hold choices.
NAMES = ("two_link_arm", "cart_pole", "four_bar", "slider_crank")
# States of the self-test that judges what the usual one leaves.
THOROUGH = 60
# A corrupted file that takes longer, in seconds, counts as found.
LIMIT = 20
# The part of a constant by which it is changed.
PART = 1 / 128

_EXCHANGED = {" + ": " - ", " - ": " + ", "*": "/", "/": "*", "sin(": "cos(", "cos(": "sin(", "sqrt(": "exp(",
              " < ": " > ", " > ": " < ", " <= ": " >= ", " >= ": " <= "}
_TOKEN = re.compile(r"(?<=[\w)\]]) [+-] (?=[\w(-])|(?<=[\w)\]])[*/](?=[\w(])|\b(?:sin|cos|sqrt)\(| [<>]=? |"
                    r"(?<![\w.\[])\d+\.\d*(?:e[+-]?\d+)?|(?<=\b[quzpc]\[)\d+(?=\])|(?<=\bud\[)\d+(?=\])|(?<=\binputs\[)\d+(?=\])")
_STATEMENT = re.compile(r"^\s+(?:const double \w+ = .*;|out\[\d+\] = .*;|\w+ = .*|.*,)$")
_COMMENT = ("#", "//", "/*", "*")


@dataclass(frozen=True)
class Mutant:
    """A corruption: the line (from 1), what stood there, what stands there now, the whole text."""

    line: int
    before: str
    after: str
    text: str

    def __str__(self) -> str:
        return f"line {self.line}: {self.before.strip()}  ->  {self.after.strip()}"


@dataclass(frozen=True)
class Count:
    """Numbers of corruptions of one file by outcome."""

    name: str
    backend: str
    found: int
    missed: tuple[Mutant, ...]
    equivalent: tuple[Mutant, ...]

    def __str__(self) -> str:
        total = self.found + len(self.missed) + len(self.equivalent)
        return (f"{self.name} ({self.backend}): {self.found} of {total} corruptions found, {len(self.equivalent)} equivalent, "
                f"{len(self.missed)} missed")


def mutants(text: str, backend: str) -> list[Mutant]:
    """All corruptions of the generated functions in the text of a file, in its order."""
    lines = text.splitlines(keepends=True)
    highest = {group: max(map(int, re.findall(rf"\b{group}\[(\d+)\]", text)), default=0)
               for group in ("q", "u", "z", "p", "c", "ud", "inputs")}
    made = []
    for k in _of_functions(lines, backend):
        line = lines[k]
        if line.strip().startswith(_COMMENT) or not _STATEMENT.match(line.rstrip("\n")):
            continue
        for token in _TOKEN.finditer(line):
            if token.start() < line.find("= ") and not line.strip().endswith(","):
                continue
            changed = _changed(token, line, highest)
            if changed is not None:
                after = line[:token.start()] + changed + line[token.end():]
                made.append(Mutant(k + 1, line.rstrip(), after.rstrip(), "".join([*lines[:k], after, *lines[k + 1:]])))
    return made


def _of_functions(lines: Sequence[str], backend: str) -> Iterator[int]:
    """The lines of the functions that were generated from the equations."""
    inside = False
    for k, line in enumerate(lines):
        if backend == "numpy":
            inside = (inside or line.startswith("def _define(")) and not line.startswith("_ONE =")
            begun = re.match(r"    def \w+\((?:p|t, q.*)\):", line)
            usable = inside and not begun and line.startswith("        ") and "m." not in line
        else:
            if re.match(r"(?:SYMDYN_EXPORT|static) int \w+\(.*\) \{$", line):
                inside = "double *out)" in line and " symdyn_" not in line
            inside = inside and not line.startswith("}")
            usable = inside
        if usable:
            yield k


def _changed(token: re.Match[str], line: str, highest: dict[str, int]) -> str | None:
    text = token.group()
    if text in _EXCHANGED:
        return _EXCHANGED[text]
    if text.isdigit():
        group = re.search(r"\w+(?=\[$)", line[:token.start()])
        top = highest.get(group.group(), 0) if group else 0
        return str((int(text) + 1) % (top + 1)) if top else None
    value = float(text)
    return repr(value * (1 + PART) if value else PART)


def _survives_python(text: str, test: str) -> bool:
    """Whether the self-test of a NumPy module with another module's functions finds nothing."""
    module = ModuleType("corrupted")
    module.__dict__["__name__"] = "corrupted"
    begin = text.index("# Reference vectors:")
    whole = text[:begin] + test[test.index("# Reference vectors:"):]
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            exec(compile(whole, "corrupted", "exec"), module.__dict__)
            return module.selftest() == 0
    except Exception:  # whatever a corrupted file raises shows that it is corrupted
        return False


def _survives_c(text: str, source: Source, main: str, folder: Path) -> bool:
    stem = next(name for name in source.files if name.endswith(".c") and name != "main.c")
    for name, content in {**source.files, stem: text, "main.c": main}.items():
        (folder / name).write_text(content, encoding="utf-8")
    command = [*require_compiler().command, "-std=c99", "-O0", "-w", "-o", "check", "main.c", stem, "-lm"]
    if subprocess.run(command, cwd=folder, capture_output=True).returncode:
        return False
    try:
        return subprocess.run([folder / "check"], capture_output=True, timeout=LIMIT).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def measure(name: str, backend: str, count: int = 84, seed: int = 0) -> Count:
    """Corrupt the written module of a mechanism of the catalogue `count` times and run its self-test.

    Raises RuntimeError if the file as written does not pass its own self-test.
    """
    system = systems.get(name)
    equations = system.augmented() if name in systems.names(constrained=True) else system.embedding()
    source = emit(equations, backend)
    stem = next(file for file in source.files if file.endswith((".py", ".c")) and file != "main.c")
    text = source.files[stem]
    with tempfile.TemporaryDirectory() as made:
        def survives(corrupted: str, test: Source) -> bool:
            if backend == "numpy":
                return _survives_python(corrupted, test.files[stem])
            return _survives_c(corrupted, source, test.files["main.c"], Path(made))

        def check(test: Source) -> None:
            if not survives(text, test):
                raise RuntimeError(f"the self-test of {name} ({backend}) reports wrong results in the file as written")

        check(source)
        every = mutants(text, backend)
        chosen = random.Random(seed).sample(every, min(count, len(every)))
        left = [mutant for mutant in chosen if survives(mutant.text, source)]
        missed: tuple[Mutant, ...] = ()
        if left:
            thorough = emit(equations, backend, states=THOROUGH)
            check(thorough)
            missed = tuple(mutant for mutant in left if not survives(mutant.text, thorough))
    return Count(name, backend, len(chosen) - len(left), missed, tuple(mutant for mutant in left if mutant not in missed))


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m symdyn.lab.mutants", description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("names", nargs="*", default=NAMES, metavar="NAME", help=f"of the catalogue (default {' '.join(NAMES)})")
    parser.add_argument("--backend", choices=("numpy", "c"), help="default both")
    parser.add_argument("--count", type=int, default=84, help="corruptions of each file (default 84)")
    parser.add_argument("--seed", type=int, default=0, help="of the random numbers (default 0)")
    options = parser.parse_args(arguments)
    counts = []
    for name in options.names:
        for backend in [options.backend] if options.backend else ["numpy", "c"]:
            counts.append(measure(name, backend, options.count, options.seed))
            print(counts[-1], flush=True)
            for word, group in (("missed", counts[-1].missed), ("equivalent", counts[-1].equivalent)):
                for mutant in group:
                    print(f"  {word:10} {mutant}")
    return int(any(count.missed for count in counts))


if __name__ == "__main__":
    sys.exit(main())
