"""The folder of compiled code, where nobody but the user may write: what lies there runs with the user's rights."""

from __future__ import annotations

import atexit
import functools
import os
import shutil
import stat
import sys
import tempfile
import warnings
from pathlib import Path

from symdyn.errors import CacheError, CacheWarning
from symdyn.runtime.building.stored import writers
from symdyn.shown import shown

MACOS = sys.platform == "darwin"
WINDOWS = sys.platform == "win32"


def cache_dir() -> Path:
    """The folder of built libraries, created if need be.

    $SYMDYN_CACHE_DIR, else the platform's cache folder. A private folder among the temporary files takes its place if it cannot
    be written, and, with a CacheWarning, if others may write to it or to a folder that it lies in: a library that somebody else
    put there would be executed. Such a folder is reported and passed over rather than made an error, because all that is lost
    is time: the code is compiled again elsewhere.
    """
    folder = _preferred()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK | os.X_OK):
            return _temporary()
        why = _open_to_others(folder)
    except OSError:  # a file in the way, a read-only disk
        return _temporary()
    if not why:
        return folder
    private = _temporary()
    _report(folder, why, private)
    return private


def _preferred() -> Path:
    named = os.environ.get("SYMDYN_CACHE_DIR")
    if named:
        folder = Path(os.path.expanduser(named))
        if named.startswith("~") and not folder.is_absolute():
            raise CacheError(f"SYMDYN_CACHE_DIR={shown(named)} names the home folder of a user that is not known here; set it "
                             "to the "
                             "path of a folder of your own, or unset it")
        return folder.absolute()
    # expanduser keeps the "~" where no home is known; such a folder must not appear in the working directory.
    home = Path(os.path.expanduser("~"))
    if not home.is_absolute():
        return _temporary()
    if WINDOWS:
        return Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local") / "symdyn" / "cache"
    if MACOS:
        return home / "Library" / "Caches" / "symdyn"
    xdg = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return (xdg if xdg.is_absolute() else home / ".cache") / "symdyn"


def _open_to_others(folder: Path) -> str:
    """Why others can put files there, or another folder in its place; empty if they cannot."""
    why = writers(folder)
    if why or os.name != "posix":
        return why
    for above in folder.resolve().parents:
        mode = above.stat().st_mode
        if mode & stat.S_IWOTH and not mode & stat.S_ISVTX:
            return f"the mode {mode & 0o7777:04o} of {above} lets everyone put another folder in its place"
    return ""


@functools.cache
def _report(folder: Path, why: str, private: Path) -> None:
    """Warn, once for each folder and reason."""
    warnings.warn(f"the cache folder {folder} is not used: {why}, and what lies there is executed. {private} takes its place. "
                  f"Close it to others (chmod go-w), delete what is in it, or set SYMDYN_CACHE_DIR to a folder of your own",
                  CacheWarning, stacklevel=3)


def _temporary() -> Path:
    if WINDOWS:  # already a folder of this user alone
        folder = Path(tempfile.gettempdir(), "symdyn")
        try:
            folder.mkdir(exist_ok=True)
        except OSError:
            return _private()
        return folder
    folder = Path(tempfile.gettempdir(), f"symdyn-{os.getuid()}")
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        result = folder.lstat()
        # A link may lead to a folder of somebody else.
        mine = stat.S_ISDIR(result.st_mode) and result.st_uid == os.getuid() and not _open_to_others(folder)
    except OSError:
        return _private()
    return folder if mine else _private()


@functools.cache
def _private() -> Path:
    """A folder for this process alone, which goes with it."""
    try:
        folder = Path(tempfile.mkdtemp(prefix="symdyn-"))
    except OSError as error:
        raise CacheError(f"no folder can be made for generated code: {error.strerror or error}. Free some space, or set "
                         "SYMDYN_CACHE_DIR to a folder that can be written") from None
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder
