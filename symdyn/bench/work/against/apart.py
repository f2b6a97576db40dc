"""Other programs prepared for a motion: in this process, or, where time is short, each in one of its own that can be ended.

A program's compiler cannot be stopped from within, and may take minutes for a long right-hand side; its process can. Should this
process end before, by a signal that lets it do nothing any more, a guard of a shell ends the other one: that may be in a library
that lets no thread of Python run.
"""

from __future__ import annotations

import contextlib
import math
import multiprocessing
import os
import signal
import subprocess
import tempfile
import time as clock
import warnings
from collections.abc import Sequence
from multiprocessing.connection import wait
from typing import Any

import numpy as np

from symdyn.bench.work.against.peer import Failed, Peer, Ran, Runner, Unfit
from symdyn.bench.work.timing import one_pass
from symdyn.errors import SymdynError
from symdyn.runtime.building.compiler import LINUX

# A first call, which may compile for a tolerance, may take this part of the time that is left, and at least so many seconds.
_PART, _LEAST = 1 / 4, 1.0
# s that a process whose pipe is closed may take to end by itself, so that its code is known.
_DYING = 5.0
# Waits until the other end of its input is closed, then ends a group of processes and removes a folder.
_GUARD = 'read -r _; kill -s KILL -- "-$1"; rm -rf -- "$2"'
# s of every run of a pass, evaluations of the last one, its state (n_x,)
Timed = tuple[list[float], int, np.ndarray]


class TooLong(SymdynError):
    """A program that was not ready within its part of a budget."""


class Here:
    """A program prepared in this process for a motion, until one of several times; the last of them is its end."""

    def __init__(self, runners: Sequence[Runner]) -> None:
        self.runners = list(runners)

    def timed(self, index: int, tolerance: float, repeats: int, deadline: float = math.inf) -> Timed:
        """A pass of runs until one of the times; deadline: of time.perf_counter, see `timing.one_pass`."""
        ran: list[Ran] = []

        def run() -> float:
            ran[:] = [self.runners[index](tolerance)]
            return ran[0][0]

        seconds = one_pass(run, repeats, deadline)
        return seconds, *(ran[0][1:] if ran else (0, np.zeros(0)))

    def states(self, tolerance: float, times: np.ndarray) -> tuple[float, np.ndarray]:
        """s, and states (n_t, n_x) at times of which the last is the end."""
        return self.runners[-1](tolerance, times)[::2]

    def close(self) -> None:
        """Let go of what was prepared."""
        self.runners.clear()


class Apart:
    """The same in a process of its own, forked from this one.

    until   of time.perf_counter, by when it must be prepared; deadline: the same for its runs
    Raises Unfit, or TooLong; runs raise Failed, or TooLong, after which the process is gone.
    """

    def __init__(self, peer: Peer, motion: tuple[Any, ...], ends: Sequence[float], until: float, deadline: float) -> None:
        self.deadline, self.done = deadline, set[Any]()
        self.gone: SymdynError | None = None
        self.folder = tempfile.TemporaryDirectory(prefix="symdyn-bench-", ignore_cleanup_errors=True)
        context: Any = multiprocessing.get_context("fork")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, self.pipe, self.folder.name, peer, motion, ends), daemon=True)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # of threads, which this package does not start
            self.process.start()
        with contextlib.suppress(OSError):  # it did so itself, or has ended
            os.setpgid(self.process.pid, self.process.pid)
        self.guard = _guard(self.process.pid, self.folder.name)
        theirs.close()
        try:
            self._answer(until - clock.perf_counter(), "its preparation", Unfit)
        except BaseException:
            self.close()
            raise

    def timed(self, index: int, tolerance: float, repeats: int, deadline: float = math.inf) -> Timed:
        """As of Here."""
        return self._asked("timed", (index, tolerance), index, tolerance, repeats, deadline)  # type: ignore[no-any-return]

    def states(self, tolerance: float, times: np.ndarray) -> tuple[float, np.ndarray]:
        """As of Here."""
        return self._asked("states", (-1, tolerance), tolerance, times)  # type: ignore[no-any-return]

    def _asked(self, name: str, key: tuple[int, float], *arguments: Any) -> Any:
        """Result of the method of Here of this name; key: place and tolerance, for which something may be done once."""
        if self.gone is not None:
            raise self.gone
        rest = self.deadline - clock.perf_counter()
        with contextlib.suppress(BrokenPipeError):  # that it died is reported below
            self.pipe.send((name, arguments))
        allowed = max(_LEAST, rest if key in self.done else _PART * rest)
        result = self._answer(allowed, f"what it does for a tolerance of {key[1]:g}", Failed)
        self.done.add(key)
        return result

    def _answer(self, seconds: float, what: str, fault: type[SymdynError]) -> Any:
        if not self.pipe.poll(max(0.0, seconds)):
            raise self._end(TooLong(f"{what} was not done after {max(0.0, seconds):.2g} s, its part of the budget"))
        try:
            good, result = self.pipe.recv()
        except (EOFError, ConnectionResetError):
            wait([self.process.sentinel], _DYING)
            self._end(TooLong("its process was ended"))
            self.gone = fault(f"its process died with code {self.process.exitcode}")
            raise self.gone from None
        if not good:
            raise fault(result)
        return result

    def close(self) -> None:
        """End the process, and what it started."""
        self._end(TooLong("its process was ended"))

    def _end(self, reason: SymdynError) -> SymdynError:
        if self.gone is None:
            self.gone = reason
            # Also where it died: what it started lives on. Before `join`, after which its number may be that of another process.
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.process.pid, signal.SIGKILL)
            self.guard.kill()
            self.guard.communicate()
            self.process.join()
            self.pipe.close()
            self.folder.cleanup()
        return self.gone


def _guard(group: int, folder: str) -> subprocess.Popen[bytes]:
    """A process that ends a group and removes a folder as soon as this process has ended, however it did."""
    return subprocess.Popen(["/bin/sh", "-c", _GUARD, "sh", str(group), folder], stdin=subprocess.PIPE,
                            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)


Prepared = Here | Apart


def prepared(peer: Peer, motion: tuple[Any, ...], ends: Sequence[float], until: float = math.inf,
             deadline: float = math.inf) -> Prepared:
    """A program ready for a motion; in a process of its own if time is short and the system can fork.

    motion      equations, params (n_p,), x0 (n_x,), system, as of Peer.prepare;  ends: s, increasing
    until       of time.perf_counter, by when it must be prepared; deadline: the same for its runs
    Raises Unfit, or whatever the program does; TooLong.
    """
    if clock.perf_counter() > until:
        raise TooLong("the budget was used up before it was prepared")
    if math.isfinite(deadline) and LINUX:
        return Apart(peer, motion, ends, until, deadline)
    return _here(peer, motion, ends)


def _here(peer: Peer, motion: tuple[Any, ...], ends: Sequence[float]) -> Here:
    equations, params, x0, system = motion
    return Here([peer.prepare(equations, params, x0, t, system) for t in ends])


def _serve(pipe: Any, ours: Any, folder: str, peer: Peer, motion: tuple[Any, ...], ends: Sequence[float]) -> None:
    """Work of the process: prepare, then answer until nobody asks."""
    ours.close()
    os.setpgid(0, 0)  # so that compilers end with it, and it does not end by keys that are meant for the other one
    tempfile.tempdir = folder
    try:
        here = _here(peer, motion, ends)
    except Exception as error:
        pipe.send((False, str(error) or type(error).__name__))
        return
    pipe.send((True, None))
    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            name, arguments = pipe.recv()
            try:
                answer = True, getattr(here, name)(*arguments)
            except Exception as error:
                answer = False, str(error) or type(error).__name__
            pipe.send(answer)
