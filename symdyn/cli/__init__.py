"""The command line: symdyn list | schema | derive | generate | export | simulate | view | sweep | report | diagnose | compare |
bench | stress | demo.

Everything is imported when it is needed, so that help and list come at once and a simulation that was done before
starts without SymPy. Exit codes: 0 done, 1 it could not be done, 2 it was asked wrongly, 3 the simulation stopped
early, 130 interrupted.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Sequence

from symdyn.cli.messages import FAILED, INTERRUPTED, WRONG, Stop, complain, show_warning
from symdyn.cli.parser import joined, make_parser
from symdyn.errors import CompileError, CompilerNotFound, EvaluationError, MissingExtra, SymdynError


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; returns its exit code."""
    arguments = make_parser().parse_args(joined(sys.argv[1:] if argv is None else argv))
    with warnings.catch_warnings():
        warnings.showwarning = show_warning
        try:
            code = int(arguments.run(arguments))
            sys.stdout.flush()
            return code
        except Stop as stop:
            return complain(str(stop), stop.code)
        except (CompileError, CompilerNotFound, EvaluationError, MissingExtra) as error:
            return complain(str(error), FAILED)
        except SymdynError as error:
            return complain(str(error), WRONG)
        except BrokenPipeError:
            # The reader had enough. Output that Python flushes at exit must go nowhere.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return FAILED
        except OSError as error:
            return complain(str(error), FAILED)
        except KeyboardInterrupt:
            return complain("interrupted", INTERRUPTED)
