"""Hands chunks to an executor and takes their outcomes, a bounded number at a time."""

from __future__ import annotations

import os
import time as clock
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from typing import Any

from symdyn.ensembles.chunk import Chunk, Done, run_chunk
from symdyn.errors import SymdynError

# Number of attempts at a chunk before the run stops.
ATTEMPTS = 3
# Chunks that wait for every worker, so that none is ever idle.
AHEAD = 3
# Seconds after which the workers are counted again: those of a cluster come and go.
RECOUNT = 2.0


class ExecutorFailed(SymdynError):
    """An executor died, or cannot do a chunk; the message says which and why."""


def run_chunks(todo: Iterator[Chunk], make: Callable[[], Executor], again: bool,
               outstanding: int | None = None, ahead: int = AHEAD) -> Iterator[Done]:
    """Outcomes of the chunks, in the order in which they are done.

    make          gives the executor; after it has died it is asked for another one if `again`
    outstanding   chunks that are handed over at a time; default: `ahead` for every worker that there is by then
    Raises ExecutorFailed where there is no other executor, and where a chunk has failed ATTEMPTS times.
    """
    executor, born = make(), 0
    limit, counted = outstanding or ahead * _workers(executor), clock.monotonic()
    back: list[Chunk] = []
    attempts: dict[int, int] = {}
    pending: dict[Future[Done], tuple[Chunk, int]] = {}
    try:
        while True:
            chunk, of = None, born
            if outstanding is None and clock.monotonic() - counted >= RECOUNT:
                limit, counted = ahead * _workers(executor), clock.monotonic()
            try:
                while len(pending) < limit and (chunk := back.pop() if back else next(todo, None)) is not None:
                    pending[executor.submit(run_chunk, chunk)] = chunk, born
                chunk = None
                if not pending:
                    return
                for future in wait(pending, RECOUNT, FIRST_COMPLETED).done:
                    chunk, of = pending.pop(future)
                    result = future.result()
                    chunk = None
                    yield result
            except Exception as error:
                if chunk is None:
                    raise
                back.append(chunk)
                dead = isinstance(error, BrokenExecutor) or _is_shut(error)
                if dead and not again:
                    yield from _done(pending)
                    raise ExecutorFailed(f"the executor died: {error or type(error).__name__}") from error
                # A worker may have been killed, or a machine be short of memory: that is no fault of the chunk, at first.
                attempts[chunk.index] = attempts.get(chunk.index, 0) + 1
                if attempts[chunk.index] == ATTEMPTS:
                    yield from _done(pending)
                    raise ExecutorFailed(f"samples {chunk.first} to {chunk.first + len(chunk.values) - 1} cannot be computed, "
                                         f"tried {ATTEMPTS} times: {type(error).__name__}: {error}") from error
                if dead and of == born:  # not of one that was replaced already
                    executor, born = make(), born + 1
    finally:
        for future in pending:
            future.cancel()


def _done(pending: Mapping[Future[Done], Any]) -> Iterator[Done]:
    """Results that are there already when the run stops."""
    for future in pending:
        if future.done() and not future.cancelled() and future.exception() is None:
            yield future.result()


def _is_shut(error: Exception) -> bool:
    """The error that `submit` of an executor raises after its shutdown has no class of its own."""
    return isinstance(error, RuntimeError) and ("shutdown" in str(error) or "closed" in str(error).lower())


def _workers(executor: Any) -> int:
    """Number of tasks that an executor does at a time, as far as it reports this."""
    workers = getattr(executor, "_max_workers", None)
    if isinstance(workers, int):
        return max(1, workers)
    client = getattr(executor, "_client", None)
    if client is not None and hasattr(client, "nthreads"):  # Dask's
        return max(1, sum(client.nthreads().values()))
    return os.cpu_count() or 1
