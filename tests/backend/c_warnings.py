"""Warnings of clang in C and those that do not count, with reasons; `faults_of` is empty where a text is clean."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

RUNTIME = Path(__file__).parents[2] / "templates" / "c" / "runtime"
LANGUAGE = ("-std=c99", "-ffp-contract=off")

# Warnings of -Weverything.
ALLOWED_WARNINGS = {
    "padded": "records have gaps where the compiler wants them; no bytes of them are written to a file",
    "float-equal": "a comparison with == asks for the same bits: a step that ends where it should, a factor that is zero",
    "declaration-after-statement": "C99 allows it, and names are declared where their values are known",
    "unused-macros": "sizes of a mechanism are written down whether or not one of its parts reads them",
    "unsafe-buffer-usage": "it asks for the containers of C++; arrays and pointers are what C has",
    "implicit-void-ptr-cast": "it asks for a cast that only C++ needs",
}
# Checks of bugprone-* and clang-analyzer-*.
ALLOWED_CHECKS = {
    "bugprone-easily-swappable-parameters": "neighbours of one type cannot be avoided where nearly all arguments are numbers",
    "bugprone-assignment-in-if-condition": "`if ((failure = f())) return failure;` is how failures are handed on",
    "bugprone-assignment-in-selection-statement": "the same, where a second call follows the first with ||",
    "bugprone-signed-bitwise": "comparisons are 0 or 1, and & and | join them without a branch",
    "bugprone-implicit-widening-of-multiplication-result": "products of two sizes of a mechanism are far below the limit of int",
    "bugprone-sizeof-expression": "a block of lanes may be one number: its size over that of a number is then 1, as it should be",
    "bugprone-suspicious-include": "runtime.c is the list of parts, and one translation unit includes it",
    "bugprone-macro-parentheses": "rows of tableaus are sums, put between parentheses where they are used",
}
WARNINGS = ("-Weverything", "-Wno-unknown-warning-option", *(f"-Wno-{name}" for name in ALLOWED_WARNINGS))
CHECKS = ",".join(["-*", "bugprone-*", "clang-analyzer-*", *(f"-{name}" for name in ALLOWED_CHECKS)])


def faults_of(source: Path, *options: str, tidy: bool = True, checks: str = CHECKS) -> str:
    """Reports of clang and, unless left out, clang-tidy on a source, as far as there are such programs."""
    reports = []
    if clang := shutil.which("clang"):
        reports.append([clang, *LANGUAGE, *WARNINGS, "-fsyntax-only", *options, str(source)])
    analyzer = shutil.which("clang-tidy") if tidy else None
    if analyzer:
        reports.append([analyzer, "--quiet", f"--checks={checks}", "--header-filter=.*", str(source), "--", *LANGUAGE, *options])
    # A sanitizer that this process was started with is not for the tools.
    environment = {name: value for name, value in os.environ.items() if name != "LD_PRELOAD"}
    outputs = [subprocess.run(command, capture_output=True, text=True, env=environment) for command in reports]
    return "\n".join(line for done in outputs for line in (done.stdout + done.stderr).splitlines()
                     if done.returncode or ": warning: " in line or ": error: " in line)
