"""Messages next to the results, with the exit codes they go with."""

from __future__ import annotations

import sys
from typing import Any

# It could not be done, it was asked wrongly, the simulation stopped early, the user stopped it.
FAILED, WRONG, STOPPED, INTERRUPTED = 1, 2, 3, 130


class Stop(Exception):
    """Ends the program with a message and an exit code."""

    def __init__(self, message: str, code: int = WRONG) -> None:
        super().__init__(message)
        self.code = code


def complain(message: str, code: int) -> int:
    """Say what is wrong; returns the exit code."""
    sys.stdout.flush()
    print(f"symdyn: {message}", file=sys.stderr)
    return code


def show_warning(message: Any, category: type[Warning], filename: str, lineno: int, file: Any = None,
                 line: str | None = None) -> None:
    """In the place of warnings.showwarning: one line, without the place in the source."""
    print(f"symdyn: warning: {message}", file=sys.stderr)
