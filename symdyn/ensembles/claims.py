"""Assignment of pieces to workers, where workers have nothing in common but a folder, come at any time and may be killed.

    claims/PIECE.G    claim number G of a piece; the worker that made the file has the piece as long as it touches the file

A claim that is no longer touched ends after `lease` seconds, and the next number can be claimed. Files are made by
O_CREAT | O_EXCL, in which one worker alone succeeds, on network drives as well, and nobody removes claims of others: so two
workers never get the same number. A worker that was only suspended completes a piece that another one has taken over; both then
write the same file, which takes time and changes nothing. All times are those of the file system: clocks of machines may differ.
"""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Callable, Iterable
from pathlib import Path
from types import TracebackType

from symdyn.ensembles.store import CLAIMS

# Seconds without a touch after which a claim ends; network drives may show times of files a minute late.
LEASE = 120.0
# Touches within a lease.
BEATS = 5
# Claims of a piece that may end with their workers; a piece that has ended so many is not tried again.
ATTEMPTS = 3


class Heartbeat:
    """Calls a function in a thread of its own, every so many seconds, while the context lasts."""

    def __init__(self, period: float, action: Callable[[], object]) -> None:
        self.period, self.action = period, action
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._beat, daemon=True)

    def _beat(self) -> None:
        while not self._end.wait(self.period):
            self.action()

    def __enter__(self) -> Heartbeat:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._end.set()
        self._thread.join()


class Claims:
    """The claims of one worker in a folder that it shares.

    name    of the worker, for people who look into the files
    lease   seconds; the same for all workers
    """

    def __init__(self, folder: Path, name: str, lease: float = LEASE) -> None:
        self.folder, self.name, self.lease = folder / CLAIMS, name, lease
        self._own: dict[str, Path] = {}
        self._clock = self.folder / f".{name}"

    def __enter__(self) -> Claims:
        self.folder.mkdir(parents=True, exist_ok=True)
        self._clock.touch()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Give back what was not done: another worker need not wait for the lease."""
        for piece in list(self._own):
            self.release(piece)
        with contextlib.suppress(OSError):
            self._clock.unlink()

    def touch(self) -> None:
        """Keep what is claimed."""
        for path in list(self._own.values()):
            with contextlib.suppress(OSError):  # the folder goes when all is done
                os.utime(path)

    def take(self, pieces: Iterable[str]) -> str | None:
        """Claim the first piece that is free; None where there is none."""
        latest = self._latest()
        now = self._now()
        for piece in pieces:
            number, path = latest.get(piece, (-1, None))
            if piece in self._own or (path is not None and not self._ended(path, now)) or number + 1 == ATTEMPTS:
                continue
            if self._make(piece, number + 1):
                return piece
        return None

    def release(self, piece: str) -> None:
        """Give a piece back, done or not."""
        with contextlib.suppress(OSError):
            self._own.pop(piece).unlink()

    def given_up(self) -> list[str]:
        """Pieces that as many workers as may try have ended with."""
        now = self._now()
        return sorted(piece for piece, (number, path) in self._latest().items()
                      if number + 1 == ATTEMPTS and piece not in self._own and self._ended(path, now))

    def forget_ended(self) -> None:
        """Remove claims that have ended, so that their pieces are tried as often as at first. No worker may be at work."""
        now = self._now()
        for path in self.folder.glob("[!.]*"):
            if self._ended(path, now):
                path.unlink(missing_ok=True)

    def at_work(self) -> list[str]:
        """Pieces that other workers have claimed."""
        now = self._now()
        return sorted(piece for piece, (_, path) in self._latest().items()
                      if piece not in self._own and not self._ended(path, now))

    def _make(self, piece: str, number: int) -> bool:
        path = self.folder / f"{piece}.{number}"
        try:
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
        except FileExistsError:
            return False
        with open(handle, "w", encoding="utf-8") as file:
            file.write(self.name)
        self._own[piece] = path
        return True

    def _latest(self) -> dict[str, tuple[int, Path]]:
        """Piece -> number and file of its last claim."""
        result: dict[str, tuple[int, Path]] = {}
        with contextlib.suppress(FileNotFoundError):  # all was done, and the folder is gone
            for entry in os.scandir(self.folder):
                piece, _, number = entry.name.rpartition(".")
                if piece and number.isdigit() and result.get(piece, (-1,))[0] < int(number):
                    result[piece] = int(number), Path(entry.path)
        return result

    def _ended(self, path: Path, now: float) -> bool:
        try:
            return now - path.stat().st_mtime > self.lease
        except FileNotFoundError:  # given back meanwhile: the next look shows it
            return False

    def _now(self) -> float:
        """The file system's time."""
        try:
            os.utime(self._clock)
            return self._clock.stat().st_mtime
        except FileNotFoundError:
            return 0.0
