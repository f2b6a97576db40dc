"""A time limit for a computation that does not look at the clock itself, such as SymPy's."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from typing import TypeVar

Result = TypeVar("Result")

# Seconds between interruptions: one that arrives where exceptions are swallowed, as in a callback of the collector, is repeated.
AGAIN = 0.05


class TimeUp(Exception):
    """A computation was not finished within its time."""


class _Interruption(BaseException):
    """Raised inside the computation; no `except Exception` in it holds it up."""


class _Clock:
    """A thread that interrupts the one that made it after some seconds, until it is stopped."""

    def __init__(self, seconds: float) -> None:
        self.target = ctypes.c_ulong(threading.get_ident())
        self.over = threading.Event()
        self.lock = threading.Lock()
        self.running = True
        threading.Thread(target=self._run, args=(seconds,), daemon=True).start()

    def _run(self, seconds: float) -> None:
        wait = seconds
        while not self.over.wait(wait):
            with self.lock:
                if self.running:
                    ctypes.pythonapi.PyThreadState_SetAsyncExc(self.target, ctypes.py_object(_Interruption))
            wait = AGAIN

    def stop(self) -> None:
        """No interruption comes after this."""
        while True:
            try:
                self.over.set()
                with self.lock:
                    self.running = False
                # One that is on its way arrives where a function begins. It must not be called off by passing NULL: CPython 3.11
                # then takes it for pending for ever, looks for it at every jump, and never returns under a debugger or profiler.
                _checkpoint()
                return
            except _Interruption:
                continue


def _checkpoint() -> None:
    """Where Python looks for interruptions of this thread."""


def within(seconds: float, compute: Callable[[], Result]) -> Result:
    """Result of `compute`, if it returns within so many seconds.

    The computation is interrupted between two steps of Python, in any thread and on any platform; a single long operation in C,
    such as a product of very long integers, ends first. Raises TimeUp.
    """
    if seconds <= 0:
        raise TimeUp
    clock = _Clock(seconds)
    try:
        try:
            return compute()
        finally:
            clock.stop()
    except _Interruption:
        clock.stop()
        raise TimeUp from None
