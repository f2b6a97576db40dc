"""From equations to files: the named functions of a mechanism as source in a backend."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from symdyn import kinds
from symdyn.arguments import some
from symdyn.backend.methods import method_of
from symdyn.backend.right_side import METHOD, RightSide
from symdyn.backend.source import Source, render
from symdyn.collector import collector_paused
from symdyn.errors import ArgumentError, SymdynError
from symdyn.formulation.equations import Equations
from symdyn.functions import groups
from symdyn.functions.content import content_of
from symdyn.functions.tapes import columns_of
from symdyn.runtime.building.stored import write_whole
from symdyn.runtime.paths import as_path
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import Rolling

FIRMWARE = "firmware"


def emit(equations: Equations, backend: str, functions: Sequence[str] | None = None,
         templates: str | os.PathLike | None = None, standalone: bool = True, integrator: bool = True,
         specialize: Mapping[Any, float] | None = None, work: bool = False, baumgarte: bool = False,
         batch: bool = False, method: str = METHOD, states: int = 2, rolled: Rolling = "auto") -> Source:
    """The source of the named functions (default: the standard ones, those the formulation has) in a backend.

    integrator   C only: with an integrator of rhs
    work         rhs gets one more state at the end: the work of all loads but gravity and springs
    baumgarte    rhs is stabilized by Baumgarte's method, with one more parameter at the end: its gain, 1/s
    batch        C only: also rhs and integrator of many states at once, a state in each SIMD lane
    method       C only: the integrator's, one of symdyn.backend.methods.METHODS; what it needs besides rhs is emitted with it
    The others, and what is raised: see `emit_with`.
    """
    right_side = RightSide(work=work, baumgarte=baumgarte, method=method, lanes=batch, integrated=integrator)
    return emit_with(equations, backend, functions, right_side, templates, standalone, specialize, states, rolled)


def emit_with(equations: Equations, backend: str, functions: Sequence[str] | None, right_side: RightSide,
              templates: str | os.PathLike | None = None, standalone: bool = True,
              specialize: Mapping[Any, float] | None = None, states: int = 2, rolled: Rolling = "auto") -> Source:
    """The source of the named functions (None: the standard ones, those the formulation has) in a backend.

    right_side   what rhs, if it is among them, is more than the function, and which integrator it has
    specialize   parameters, by symbol or name, that become numbers in the code and are folded
    states       how many random states the reference vectors of a standalone source begin with
    rolled       C only: whether statements that a function repeats, as for like bodies, become loops: "auto" where these are many
                 and the templates are the shipped ones, True wherever some are, False nowhere

    Raises SymdynError for an unknown function, parameter, backend, method or a broken template, for another value of rolled, for
    loops that a backend has no words for, and for events and rigid contacts that steps of firmware would not look for.
    """
    if standalone and equations.again is not None:
        equations = equations.again()
    bound = some(specialize, [p.name for p in equations.symbols.parameters], "specialize", equations.name)
    kinds.text(backend, f"{equations.name}: the backend", "c")
    method_of(right_side.method)
    rolled = rolling(rolled)
    if templates is not None:
        rolled = rolled is True
        as_path(templates, "of the templates", "my_templates")
    compiled = right_side.integrated and backend == "c"
    names = groups.written(equations, functions, right_side.method if compiled else None, right_side.baumgarte)
    if backend == FIRMWARE and "rhs" in names:
        check_no_events(equations)
    with collector_paused():
        # The self-test of a file that stands alone exercises its statements one by one.
        # Devices have no SIMD lanes within a thread.
        columns = columns_of if backend == "c" and not standalone and not right_side.threads and templates is None else None
        content = content_of(equations, names, standalone, bound, right_side, columns)
        return render(content, backend, templates, standalone, right_side, states, rolled=rolled)


def check_no_events(equations: Equations) -> None:
    """Raises ArgumentError for rigid contacts and events, which steps of firmware do not look for."""
    if equations.contacts or equations.events:
        what = [*(f"the rigid contact {c.name}" for c in equations.contacts),
                *(f"the event {e.name}" for e in equations.events)][0]
        raise ArgumentError(f"{equations.name}: files for firmware were asked for, but their steps have a fixed length and do "
                            f"not look for {what}; leave it out, or take an FMU or the written C (module.write), whose "
                            "integrators do")


def rolling(rolled: object) -> Rolling:
    """The option as it is given. Raises SymdynError for another value."""
    if rolled is True or rolled is False:
        return rolled is True
    if isinstance(rolled, str) and rolled == "auto":
        return "auto"
    raise SymdynError(f"rolled is {shown(rolled)}; pass True, False or 'auto'")


def write_source(source: Source, folder: Path) -> list[Path]:
    """Write the files of a source into a folder (made if absent), each in one step, so that programs and threads that read or
    write them at the same time have whole ones; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, text in source.files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, partial(_put, text.encode()), sync=False)
        paths.append(path)
    return paths


def _put(content: bytes, file: IO[bytes]) -> None:
    file.write(content)
