"""Description by a file of the user: a system, or cases of printed formulas. A Python file is a program, and is run; a TOML file
is data, and is read."""

from __future__ import annotations

import contextlib
import functools
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symdyn.cli.messages import Stop
from symdyn.cli.options import check_options

if TYPE_CHECKING:
    from symdyn.comparison.case import Case
    from symdyn.model.system import System


def from_file(path: Path, options: Mapping[str, Any]) -> System:
    """System that system() of a user's file returns."""
    return maker(path)(**options)


def maker(path: Path) -> Callable[..., System]:
    """system() of a user's file, which is run once; what it raises, now or when it is called, is reported as the user's fault.
    Maker of the system of a file; of a data file, of what it describes."""
    if path.suffix == ".toml":
        return functools.partial(_of_data, path)
    function = _run(path, lambda module: getattr(module, "system", None))
    if not callable(function):
        raise Stop(f"{path} defines no function system(); add one that returns a symdyn System")

    @functools.wraps(function)
    def make(**options: Any) -> System:
        from symdyn.model.system import System

        check_options(f"system() of {path}", function, options)
        with _fault_of_the_user(path):
            result = function(**options)
        if not isinstance(result, System):
            raise Stop(f"system() of {path} returned {result!r}; it must return a symdyn System")
        return result

    return make


def _of_data(path: Path, **options: Any) -> System:
    """The system of a data file, which nothing of is run."""
    from symdyn.datafile.read import read_system

    if options:
        raise Stop(f"{path} is a data file, which takes no --option; change its numbers, or pass --set")
    return read_system(path)


def cases_from_file(path: Path) -> list[Case]:
    """CASES of a user's file."""
    from symdyn.comparison.case import Case

    result = _run(path, lambda module: getattr(module, "CASES", None))
    if not isinstance(result, (list, tuple)) or not result or not all(isinstance(c, Case) for c in result):
        raise Stop(f"{path} must define CASES, a list of symdyn.Case; found {result!r:.80}")
    return list(result)


def _run(path: Path, take: Callable[[Any], Any]) -> Any:
    """Result of `take` for the module that the file is."""
    import importlib.util

    if not path.is_file():
        raise Stop(f"there is no file {path}")
    spec = importlib.util.spec_from_file_location(f"symdyn_user_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise Stop(f"{path} is not a Python file; its name must end in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    with _fault_of_the_user(path):
        spec.loader.exec_module(module)
        return take(module)


@contextlib.contextmanager
def _fault_of_the_user(path: Path) -> Iterator[None]:
    """An error that a user's program raises becomes a Stop, which reports it as its own."""
    try:
        yield
    except Stop:
        raise
    except (Exception, SystemExit) as error:
        raise Stop(_users_fault(error, path)) from None


def _users_fault(error: BaseException, path: Path) -> str:
    """The sentence, and the lines of the user's file that led there."""
    import traceback

    here = path.resolve()
    frames = [f for f in traceback.extract_tb(error.__traceback__) if Path(f.filename).resolve() == here]
    lines = "".join([*traceback.format_list(frames), *traceback.format_exception_only(error)]).rstrip()
    return f"{path} ended with {type(error).__name__}:\n{lines}"
