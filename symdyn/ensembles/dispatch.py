"""Hands chunks to an executor and takes their outcomes, a bounded number at a time."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import time as clock
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, InvalidStateError, wait
from typing import Any

from symdyn.ensembles.chunk import Chunk, Done, run_chunk
from symdyn.errors import SymdynError

# Number of attempts at a chunk before the run stops.
ATTEMPTS = 3
# Chunks that wait for every worker, so that none is ever idle.
AHEAD = 3
# Seconds after which the workers are counted again: those of a cluster come and go.
RECOUNT = 2.0
# Seconds between looks at a client that tries to connect again.
CONNECTING = 0.1
# Logs to which Dask writes the traceback of a connection that is lost, which symdyn reports in one line.
LOGS_OF_CONNECTIONS = ("distributed.batched", "distributed.client")


class ExecutorFailed(SymdynError):
    """An executor died, or cannot do a chunk; the message says which and why."""


def run_chunks(todo: Iterator[Chunk], make: Callable[[], Executor], again: bool,
               outstanding: int | None = None, ahead: int = AHEAD) -> Iterator[Done]:
    """Outcomes of the chunks, in the order in which they are done.

    make          gives the executor; after it has died it is asked for another one if `again`
    outstanding   chunks that are handed over at a time; default: `ahead` for every worker that there is by then
    Raises ExecutorFailed where there is no other executor, and where a chunk has failed ATTEMPTS times.
    """
    pool, born = _Pool(make()), 0
    limit, counted = outstanding or ahead * pool.workers(), clock.monotonic()
    back: list[Chunk] = []
    attempts: dict[int, int] = {}
    pending: dict[Future[Done], tuple[Chunk, int]] = {}
    try:
        while True:
            chunk, of = None, born
            try:
                if pool.is_new():
                    back += _taken_back(pending)
                if outstanding is None and clock.monotonic() - counted >= RECOUNT:
                    limit, counted = ahead * pool.workers(), clock.monotonic()
                while len(pending) < limit and (chunk := back.pop() if back else next(todo, None)) is not None:
                    pending[pool.submit(chunk)] = chunk, born
                chunk = None
                if not pending:
                    return
                for future in wait(pending, RECOUNT, FIRST_COMPLETED).done:
                    chunk, of = pending.pop(future)
                    result = future.result()
                    chunk = None
                    yield result
            except Exception as error:
                gone = pool.is_gone()
                if chunk is None and not gone:
                    raise
                failed = [*([] if chunk is None else [chunk]), *(_taken_back(pending) if gone else [])]
                back += failed
                dead = isinstance(error, BrokenExecutor) or _is_shut(error) or gone
                if dead and not again:
                    yield from _done(pending)
                    if gone:
                        raise ExecutorFailed(f"Dask's scheduler at {pool.address} is gone; start one again") from None
                    raise ExecutorFailed(f"the executor died: {error or type(error).__name__}") from error
                if pool.was_lost():
                    continue
                # A worker may have been killed, or a machine be short of memory: that is no fault of the chunk, at first.
                for chunk in failed:
                    attempts[chunk.index] = attempts.get(chunk.index, 0) + 1
                    if attempts[chunk.index] == ATTEMPTS:
                        yield from _done(pending)
                        last = chunk.first + len(chunk.values) - 1
                        raise ExecutorFailed(f"samples {chunk.first} to {last} cannot be computed, tried {ATTEMPTS} times: "
                                             f"{type(error).__name__}: {error}") from error
                if gone or (dead and of == born):  # not of one that was replaced already
                    pool, born = _Pool(make()), born + 1
    finally:
        for future in pending:
            future.cancel()


class _Pool:
    """An executor; where it is Dask's, its connection to the scheduler, which other executors neither lose nor have.

    A client that loses its scheduler cancels what it has handed over, tries to connect again for as long as its timeout lasts,
    and then closes.
    """

    def __init__(self, executor: Any) -> None:
        self.executor = executor
        client = getattr(executor, "_client", None)
        self.client = client if hasattr(client, "nthreads") else None
        self.address = str(getattr(getattr(client, "scheduler", None), "address", "an unknown address"))
        self._link = self._linked()

    def submit(self, chunk: Chunk) -> Future[Done]:
        """Hand a chunk over."""
        if self.client is None:
            result: Future[Done] = self.executor.submit(run_chunk, chunk)
            return result
        asked = self.client.submit(run_chunk, chunk, **self.executor._kwargs)
        result = Future()
        result.add_done_callback(lambda ended: asked.cancel() if ended.cancelled() else None)
        self.client.loop.add_callback(_follow, asked, result)
        return result

    def workers(self) -> int:
        """Number of chunks that are computed at a time, as far as the executor reports this."""
        workers = getattr(self.executor, "_max_workers", None)
        if isinstance(workers, int):
            return max(1, workers)
        if self.client is None:
            return os.cpu_count() or 1
        try:
            return max(1, sum(self.client.nthreads().values()))
        except Exception:  # the scheduler has gone meanwhile, as the next look at it will show
            return 1

    def is_gone(self) -> bool:
        """Whether the scheduler does not answer any more, after the client has tried to connect again."""
        if self.client is not None and self.client.status == "connecting":
            with silent_connections():  # who asks for it reports it
                while self.client.status == "connecting":
                    clock.sleep(CONNECTING)
        return self.client is not None and self.client.status != "running"

    def was_lost(self) -> bool:
        """Whether the client has another connection by now than the one that `is_new` has seen last."""
        return not self.is_gone() and self._linked() is not self._link

    def is_new(self) -> bool:
        """The same, and the connection is taken for the new one. Raises ConnectionError if the scheduler is gone."""
        if self.is_gone():
            raise ConnectionError(f"no scheduler at {self.address}")
        before, self._link = self._link, self._linked()
        return self._link is not before

    def _linked(self) -> Any:
        return getattr(self.client, "scheduler_comm", None)


@contextlib.contextmanager
def silent_connections() -> Iterator[None]:
    """Dask's logs of connections print nothing for a while."""
    logs = [logging.getLogger(name) for name in LOGS_OF_CONNECTIONS]
    before = [log.disabled for log in logs]
    for log in logs:
        log.disabled = True
    try:
        yield
    finally:
        for log, disabled in zip(logs, before, strict=True):
            log.disabled = disabled


async def _follow(asked: Any, result: Future[Done]) -> None:
    """Pass on how a future of Dask ends. Dask's own executor leaves those open whose results are lost on their way."""
    with contextlib.suppress(InvalidStateError):  # it was cancelled meanwhile
        try:
            result.set_result(await asked)
        except (Exception, asyncio.CancelledError) as error:
            result.set_exception(error if isinstance(error, Exception) else ConnectionError(str(error)))


def _taken_back(pending: dict[Future[Done], tuple[Chunk, int]]) -> list[Chunk]:
    """Chunks of futures that a lost connection has left without a result; they are pending no longer."""
    left = [future for future in pending if not _has_result(future)]
    return [pending.pop(future)[0] for future in left]


def _done(pending: Mapping[Future[Done], Any]) -> Iterator[Done]:
    """Results that are there already when the run stops."""
    for future in pending:
        if _has_result(future):
            yield future.result()


def _has_result(future: Future[Done]) -> bool:
    return future.done() and not future.cancelled() and future.exception() is None


def _is_shut(error: Exception) -> bool:
    """The error that `submit` of an executor raises after its shutdown has no class of its own."""
    return isinstance(error, RuntimeError) and ("shutdown" in str(error) or "closed" in str(error).lower())
