"""Mutation sampling: how many small changes of the package its tests notice.

    python tests/mutate.py --count 300 --seed 1             # goes on where an earlier run stopped
    python tests/mutate.py --count 300 --seed 1 --summary   # what is known so far, with the survivors
    python tests/mutate.py --jobs 2 --again                 # the survivors once more, after tests were added

Each mutant is one changed operator, comparison, condition, constant or result in model, formulation, tape, backend or runtime. It
stands in a copy of the working tree, where the tests that enter the changed function run, those first that enter few others,
until one fails; then the other tests of their files. One that takes far more processor time than the tests need counts as
killed. The functions that each test enters are noted once, in a copy whose functions count themselves; tests that only enter it
in other processes (notebooks, commands) are not seen. `--folder` holds the notes and the results, a line of JSON for each mutant.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from tests.mutation.changes import Change, changes, functions  # noqa: E402

PACKAGES = ("model", "formulation", "tape", "backend", "runtime")
# Files of tests that start other programs, or check the text of the package, and what takes minutes.
LEFT_OUT = ("tests/bench", "tests/checks", "tests/lecture", "tests/test_wheel.py", "tests/test_release.py", "tests/test_types.py",
            "tests/test_architecture.py", "tests/backend/test_c_tools.py", "tests/test_notebooks.py")
QUICK_TESTS = 12    # run first, so that few files are read for most mutants, and
QUICK = 5.0         # no more seconds of them
FILE_SECONDS = 300  # processor time of one file of tests while functions are noted
SLACK = 4.0         # times the noted seconds, and
SPARE = 60.0        # seconds more, of processor time, before a mutant counts as one that never ends
PYTEST = ("-m", "pytest", "-q", "-x", "-m", "not sweep", "-o", "addopts=", "-p", "tests.mutation.plugin", "-p",
          "no:cacheprovider", "-p", "no:nbmake")


@dataclass(frozen=True)
class Mutant:
    """A change of a file, which is named from the root of the repository; `before` and `after` are its line."""

    file: str
    change: Change
    before: str
    after: str

    @property
    def function(self) -> str:
        """The function around it."""
        return f"{self.file}:{self.change.function}"

    @property
    def name(self) -> str:
        """The same as long as the line is the same."""
        return f"{self.function}: {self.before} -> {self.after}"


@dataclass(frozen=True)
class Result:
    """Fate of a mutant: "killed" (`by` is the test), "endless", "survived", or "unseen" by any test."""

    name: str
    file: str
    line: int
    before: str
    after: str
    verdict: str
    by: str
    tests: int
    seconds: float


def tree(folder: Path) -> Path:
    """A copy of the files of the working tree that git knows, and of new ones."""
    command = ["git", "ls-files", "-co", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    for name in listed.stdout.splitlines():
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
    return folder


def compiled(folder: Path) -> Path:
    """The copy with the bytecode of its files, which is passed over where a file has changed."""
    command = [sys.executable, "-m", "compileall", "-q", "--invalidation-mode", "checked-hash", "symdyn", "tests"]
    subprocess.run(command, cwd=folder, check=True)
    return folder


def sources() -> list[str]:
    """The files that are changed."""
    return [str(path.relative_to(ROOT)) for package in PACKAGES for path in sorted((ROOT / "symdyn" / package).rglob("*.py"))]


def sample(seed: int, count: int) -> list[Mutant]:
    """The first `count` mutants of a random order; more mutants of the same seed begin with the same ones."""
    texts = {file: (ROOT / file).read_text(encoding="utf-8") for file in sources()}
    every = [(file, change) for file, text in texts.items() for change in changes(text)]
    random.Random(seed).shuffle(every)
    return [Mutant(file, change, *change.lines(texts[file])) for file, change in every[:count]]


def run_tests(folder: Path, files: Sequence[str], limit: float, **environment: str) -> tuple[str, str]:
    """Run files of tests in a copy: "passed", "failed" or "endless", and the output."""
    def bound() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 1, int(limit) + 5))

    known = {**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1", **environment}
    command = [sys.executable, *PYTEST, *files]
    try:
        done = subprocess.run(command, cwd=folder, env=known, capture_output=True, text=True, preexec_fn=bound, check=False,
                              timeout=20 * limit)
    except subprocess.TimeoutExpired:
        return "endless", ""
    ended = done.returncode in (-signal.SIGXCPU, -signal.SIGKILL)
    return ("passed" if done.returncode in (0, 5) else "endless" if ended else "failed"), done.stdout


def note_functions(notes: Path, jobs: int) -> None:
    """Write which test enters which functions, a line for each test; files that are noted as they are now are passed over.

    The lines hold numbers of functions; `functions.json` next to them holds their names.
    """
    notes.mkdir(parents=True, exist_ok=True)
    finished, names = notes / "files.json", notes / "functions.json"
    known: dict[str, str] = json.loads(finished.read_text(encoding="utf-8")) if finished.is_file() else {}
    numbers: dict[str, int] = json.loads(names.read_text(encoding="utf-8")) if names.is_file() else {}
    with tempfile.TemporaryDirectory(prefix="mutation-") as made:
        folder = tree(Path(made))
        tests = {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.glob("tests/**/test_*.py"))}
        for name in sources():
            (folder / name).write_text(_counting((folder / name).read_text(encoding="utf-8"), name, numbers), encoding="utf-8")
        names.write_text(json.dumps(numbers), encoding="utf-8")
        lines, lock = str(notes.absolute() / "tests.jsonl"), threading.Lock()

        def note(name: str, digest: str) -> None:
            begun = time.monotonic()
            verdict, _ = run_tests(folder, [name, "--maxfail=1000"], FILE_SECONDS, MUTATION_NOTE=lines)
            with lock:
                known[name] = digest
                finished.write_text(json.dumps(known, indent=1), encoding="utf-8")
                print(f"{name}: {verdict}, {time.monotonic() - begun:.1f} s", flush=True)

        digests = {name: hashlib.sha256(text).hexdigest() for name, text in tests.items() if not name.startswith(LEFT_OUT)}
        with ThreadPoolExecutor(jobs) as side_by_side:
            list(side_by_side.map(lambda one: note(*one), [one for one in digests.items() if known.get(one[0]) != one[1]]))


def _counting(text: str, file: str, numbers: dict[str, int]) -> str:
    """The text of a file whose functions add their number to a set when they are entered."""
    whole = ast.parse(text)
    for name, function in functions(whole):
        number = numbers.setdefault(f"{file}:{name}", len(numbers))
        begin = 1 if ast.get_docstring(function, clean=False) is not None else 0
        function.body.insert(begin, ast.parse(f"_ENTERED.add({number})").body[0])
    begin = next((k for k, node in enumerate(whole.body) if not _is_head(node)), len(whole.body))
    shared = "import builtins\n_ENTERED = builtins.__dict__.setdefault('functions_entered', set())"
    whole.body[begin:begin] = ast.parse(shared).body
    return ast.unparse(ast.fix_missing_locations(whole))


def _is_head(node: ast.stmt) -> bool:
    return (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)) or (
        isinstance(node, ast.ImportFrom) and node.module == "__future__")


@dataclass(frozen=True)
class Tests:
    """Notes on the tests: the seconds of each, how many functions it enters, and the tests that enter a function."""

    seconds: dict[str, float]
    breadth: dict[str, int]
    entering: dict[str, list[str]]

    @classmethod
    def read(cls, notes: Path) -> Tests:
        """Read from the notes; the last line of a test counts."""
        lines = [json.loads(line) for line in (notes / "tests.jsonl").read_text(encoding="utf-8").splitlines()]
        last = {line["test"]: line for line in lines}
        names = {number: name for name, number in json.loads((notes / "functions.json").read_text(encoding="utf-8")).items()}
        entering: dict[str, list[str]] = {}
        for test, line in last.items():
            for number in line["entered"]:
                entering.setdefault(names[number], []).append(test)
        return cls({test: line["seconds"] for test, line in last.items()},
                   {test: len(line["entered"]) for test, line in last.items()}, entering)

    def chosen(self, mutant: Mutant, seconds: float) -> tuple[list[str], list[str], list[str]]:
        """Tests that enter the changed function, those first that enter few others; the rest of these tests; and the others of
        their files, each within these seconds in all."""
        first = self._ordered(self.entering.get(mutant.function, ()), seconds)
        files = {test.split("::")[0] for test in first}
        others = [test for test in self.seconds if test.split("::")[0] in files and test not in set(first)]
        narrow = sorted(first, key=lambda test: self.breadth[test])[:QUICK_TESTS]
        quick = self._ordered(narrow, QUICK)
        return quick, [test for test in first if test not in set(quick)], self._ordered(others, seconds)

    def _ordered(self, tests: Sequence[str], limit: float) -> list[str]:
        """File by file, the quickest first, as far as the seconds suffice; at least one test."""
        files: dict[str, list[str]] = {}
        for test in tests:
            files.setdefault(test.split("::")[0], []).append(test)
        total = {file: sum(self.seconds[test] for test in group) + 1 for file, group in files.items()}
        taken: list[str] = []
        spent = 0.0
        for file in sorted(files, key=lambda one: total[one]):
            for test in sorted(files[file], key=lambda one: self.seconds[one]):
                spent += self.seconds[test]
                if spent > limit and taken:
                    return taken
                taken.append(test)
            spent += 1
        return taken


def judge(mutant: Mutant, folder: Path, tests: Tests, seconds: float) -> Result:
    """Run the tests with the mutant in the copy, and take it out again."""
    file = folder / mutant.file
    text = file.read_text(encoding="utf-8")
    begun, verdict, by, number = time.monotonic(), "unseen", "", 0
    try:
        file.write_text(mutant.change.apply(text), encoding="utf-8")
        for chosen in tests.chosen(mutant, seconds):
            if not chosen:
                continue
            (folder / "order.json").write_text(json.dumps(chosen), encoding="utf-8")
            files = list(dict.fromkeys(test.split("::")[0] for test in chosen))
            limit = SLACK * sum(tests.seconds[test] for test in chosen) + SPARE
            found, output = run_tests(folder, files, limit, MUTATION_ORDER=str(folder / "order.json"))
            number += len(chosen)
            verdict = {"passed": "survived", "failed": "killed", "endless": "endless"}[found]
            if found == "failed":
                by = next((line for line in output.splitlines() if line.startswith(("FAILED", "ERROR"))), output[-200:])[:200]
            if verdict != "survived":
                break
    finally:
        file.write_text(text, encoding="utf-8")
    return Result(mutant.name, mutant.file, mutant.change.line, mutant.before, mutant.after, verdict, by, number,
                  round(time.monotonic() - begun, 1))


def results(file: Path) -> dict[str, Result]:
    """The results so far, by the name of the mutant; a later one replaces an earlier one."""
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    return {one.name: one for one in (Result(**json.loads(line)) for line in lines)}


def summary(known: dict[str, Result]) -> Iterator[str]:
    """The count of each verdict, and what was not killed as a difference."""
    verdicts = [one.verdict for one in known.values()]
    killed = verdicts.count("killed") + verdicts.count("endless")
    share = f", {100 * killed / len(verdicts):.1f} %" if verdicts else ""
    yield (f"{len(verdicts)} mutants: {killed} killed{share} ({verdicts.count('endless')} of them by their time), "
           f"{verdicts.count('survived')} survived, {verdicts.count('unseen')} in functions that no test enters")
    for one in sorted(known.values(), key=lambda one: (one.file, one.line)):
        if one.verdict in ("survived", "unseen"):
            yield f"{one.file}:{one.line}: {one.verdict} {one.tests} tests"
            yield f"  - {one.before}"
            yield f"  + {one.after}"


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python tests/mutate.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=300, help="mutants (default 300)")
    parser.add_argument("--seed", type=int, default=1, help="of the random order (default 1)")
    parser.add_argument("--seconds", type=float, default=120.0, help="of tests for a mutant, by their noted times")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="stop after these")
    parser.add_argument("--jobs", type=int, default=1, help="copies of the tree that are tested side by side (default 1)")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "mutation", help="of notes and results")
    parser.add_argument("--summary", action="store_true", help="print what is known, run nothing")
    parser.add_argument("--again", action="store_true", help="run survivors once more, after noting the functions of new tests")
    options = parser.parse_args(arguments)
    file = options.folder / f"results-{options.seed}.jsonl"
    chosen, known = sample(options.seed, options.count), results(file)
    known = {mutant.name: known[mutant.name] for mutant in chosen if mutant.name in known}
    if not options.summary:
        note_functions(options.folder, options.jobs)
        tests, lock, waiting = Tests.read(options.folder), threading.Lock(), iter(list(enumerate(chosen, 1)))
        end = time.monotonic() + 60 * options.minutes

        def work(folder: Path) -> None:
            while time.monotonic() < end:
                with lock:
                    number, mutant = next(waiting, (0, None))
                if mutant is None:
                    return
                before = known.get(mutant.name)
                if before and not (options.again and before.verdict in ("survived", "unseen")):
                    continue
                one = judge(mutant, folder, tests, options.seconds)
                with lock, file.open("a", encoding="utf-8") as lines:
                    known[mutant.name] = one
                    lines.write(json.dumps(asdict(one)) + "\n")
                    print(f"{number:4} {one.verdict:8} {one.seconds:6.1f} s  {one.file}:{one.line}: {one.before} -> {one.after}",
                          flush=True)

        with tempfile.TemporaryDirectory(prefix="mutation-") as made, ThreadPoolExecutor(options.jobs) as side_by_side:
            list(side_by_side.map(work, [compiled(tree(Path(made) / str(number))) for number in range(options.jobs)]))
    print("\n".join(summary(known)))
    return int(any(one.verdict in ("survived", "unseen") for one in known.values()))


if __name__ == "__main__":
    sys.exit(main())
