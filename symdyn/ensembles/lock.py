"""One run at a time in a folder, or workers that share it: a lock on the folder itself, which the system takes back however the
process ends."""

from __future__ import annotations

import contextlib
import errno
import functools
import os
import weakref
from pathlib import Path
from types import TracebackType

from symdyn.errors import ArgumentError

try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None  # type: ignore[assignment]


class OneRun:
    """Keeps other runs, of this process or of others, out of a folder, which is made if it is not there.

    shared   lets others in that share the folder, too

    Raises ArgumentError where another run is at work there, and where the folder cannot be made. Where the file system knows no
    locks (some network drives), and on Windows, nothing is locked.
    """

    def __init__(self, folder: Path, shared: bool = False) -> None:
        self.folder, self.shared = folder, shared
        self.handle: int | None = None
        self.made = False

    def __enter__(self) -> OneRun:
        try:
            self.made = not self.folder.exists()
            self.folder.mkdir(parents=True, exist_ok=True)
            if fcntl is None:
                return self
            self.handle = os.open(self.folder, os.O_RDONLY)
        except OSError as error:
            raise ArgumentError(f"the folder {self.folder} cannot be used ({error.strerror}); name another folder") from None
        # A worker that is forked would hold the lock, too, and outlive a run that is killed.
        os.register_at_fork(after_in_child=functools.partial(_leave, weakref.ref(self)))
        try:
            fcntl.flock(self.handle, (fcntl.LOCK_SH if self.shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno in (errno.EWOULDBLOCK, errno.EACCES):
                self.leave()
                remedy = ("it does not share its work; wait until it has ended, and start it so that it does" if self.shared else
                          "two would write the same files; wait until it has ended, or name another folder")
                raise ArgumentError(f"another run is at work in {self.folder}: {remedy}") from None
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self.made and kind is not None:
            with contextlib.suppress(OSError):
                self.folder.rmdir()  # where nothing was written
        self.leave()

    def leave(self) -> None:
        """Let others in."""
        handle, self.handle = self.handle, None
        if handle is not None:
            os.close(handle)


def _leave(lock: weakref.ref[OneRun]) -> None:
    held = lock()
    if held is not None:
        held.leave()
