"""Ctrl-C while C code calls a Python function."""

from __future__ import annotations

import signal
import threading
from types import CodeType, FrameType, TracebackType
from typing import Any


class Interrupts:
    """Keeps Ctrl-C that arrives in the frame of one function until that function asks for it.

    Python may handle a signal between a C caller and the first line of the function it calls; what is raised there is
    printed and lost. Everywhere else, also in what the function calls, Ctrl-C does what it always does.
    """

    def __init__(self, code: CodeType) -> None:
        self.code = code
        self.pending = False
        self.usual: Any = None

    def __enter__(self) -> Interrupts:
        if threading.current_thread() is threading.main_thread() and callable(signal.getsignal(signal.SIGINT)):
            self.usual = signal.signal(signal.SIGINT, self._handle)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self.usual is not None:
            signal.signal(signal.SIGINT, self.usual)
        if kind is None:
            self.check()

    def check(self) -> None:
        """Do now what Ctrl-C does, if it was kept."""
        if self.pending:
            self.pending = False
            self.usual(signal.SIGINT, None)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if frame is not None and frame.f_code is self.code:
            self.pending = True
        else:
            self.usual(number, frame)
