"""A library: loaded generated code with some of the functions of a module, called through one narrow interface.

There are two: a C library through ctypes, and a generated Python module. No SymPy here.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol

import numpy as np

from symdyn.backend.c_records import fields_of
from symdyn.backend.metadata import Metadata
from symdyn.errors import EvaluationError
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import Compiler
from symdyn.runtime.building.stored import PRIVATE, import_text, write_whole
from symdyn.runtime.raised import in_prologue, raise_by_text
from symdyn.translation_units import translation_units

NOT_FINITE = -1


class Evaluator(Protocol):
    """One function of a library with its own buffers and parameters; for one thread."""

    def set_params(self, p: np.ndarray) -> None:
        """Take parameters over and run the prologue."""

    def one(self, t: float, x: Any, inputs: Any = None, ud: Any = None) -> np.ndarray:
        """The result at one state."""

    def many(self, t: np.ndarray, x: np.ndarray, inputs: np.ndarray, ud: np.ndarray) -> np.ndarray:
        """Results at rows of states; arguments with one row hold for all."""

    def each(self, t: float, x: np.ndarray, inputs: Any) -> np.ndarray:
        """The result at one state, NaN or infinite where it cannot be evaluated."""


class Library(Protocol):
    """Generated code that is loaded."""

    backend: str

    @property
    def metadata(self) -> Metadata:
        """Metadata of the code."""

    def evaluator(self, name: str) -> Evaluator:
        """A new evaluator of one function."""


class Frame(ctypes.Structure):
    """The record that one call of the C library takes; see c/frame.jinja."""

    _fields_ = fields_of("frame.jinja")
    failed: int


def reason_of(metadata: Metadata, code: int) -> str:
    """Meaning of a return code of a function in C."""
    if code == NOT_FINITE:
        return "the result is not finite"
    return metadata.reasons[code - 1] if 0 < code <= len(metadata.reasons) else f"code {code}"


class CLibrary:
    """A compiled C library."""

    backend = "c"

    def __init__(self, source: str, metadata: Metadata, compiler: Compiler) -> None:
        self.metadata = metadata
        self.source = source
        # The integrator in a library of its own has the same names for all mechanisms.
        self._of_runtime = "symdyn" if len(translation_units(source)) > 1 else metadata.name
        self.handle = cache.load(source, metadata.name, compiler)
        # Evaluations are too short to be worth releasing the interpreter lock for; integrations are not.
        self.quick = ctypes.PyDLL(self.handle._name)

    def function(self, name: str, quick: bool = False) -> Any:
        """An exported function of the library, without the module's prefix."""
        prefix = self._of_runtime if name.startswith("simulation_") else self.metadata.name
        return getattr(self.quick if quick else self.handle, f"{prefix}_{name}")

    def reason(self, code: int) -> str:
        """Meaning of a return code."""
        return reason_of(self.metadata, code)

    def evaluator(self, name: str) -> CEvaluator:
        return CEvaluator(self, name)

    def prologue(self, p: np.ndarray, c: np.ndarray) -> None:
        """Compute the constants. Raises EvaluationError if they cannot be."""
        code = self.function("prologue")(ctypes.c_void_p(p.ctypes.data), ctypes.c_void_p(c.ctypes.data))
        if code:
            raise EvaluationError(f"{self.metadata.name}: {self.reason(code)}; {check_parameters(self.metadata, p)}")
        if not np.isfinite(c).all():
            raise EvaluationError(f"{self.metadata.name}: {np.count_nonzero(~np.isfinite(c))} of the constants that "
                                  "depend on parameters only are not finite; check for a division by a zero parameter")


class DeviceText:
    """Text of a kernel that integrates many motions, which devices compile; it evaluates nothing by itself."""

    backend = "c"

    def __init__(self, source: str, metadata: Metadata) -> None:
        self.source, self.metadata = source, metadata

    def reason(self, code: int) -> str:
        """Meaning of a return code."""
        return reason_of(self.metadata, code)

    def evaluator(self, name: str) -> Evaluator:
        """Raises EvaluationError."""
        raise EvaluationError(f"{self.metadata.name}: {name} cannot be evaluated by a kernel, which integrates motions only; "
                              "evaluate it by module.evaluate")


class CEvaluator:
    """One function of a C library, with buffers whose addresses are bound once."""

    def __init__(self, library: CLibrary, name: str) -> None:
        sizes = library.metadata.sizes
        self.library = library
        self.name = name
        self.shape = tuple(library.metadata.shapes[name])
        self.size = int(np.prod(self.shape))
        self.p, self.c = np.zeros(max(1, sizes.p)), np.zeros(max(1, library.metadata.n_c))
        self.t, self.x = np.zeros(1), np.zeros(sizes.x)
        self.ud, self.inputs = np.zeros(sizes.ud), np.zeros(sizes.inputs)
        self.out = np.zeros(self.size)
        self.result = self.out.reshape(self.shape)
        self.frame = Frame(1, *[a.ctypes.data for a in (self.t, self.x, self.ud, self.inputs, self.p, self.c, self.out)],
                           1, 1, 1, 1, 0)
        self.call = library.function(f"{name}_rows", quick=True)
        self.address = ctypes.c_void_p(ctypes.addressof(self.frame))

    def set_params(self, p: np.ndarray) -> None:
        taken, constants = np.zeros_like(self.p), np.zeros_like(self.c)
        taken[:len(p)] = p
        self.library.prologue(taken, constants)
        self.p[:], self.c[:] = taken, constants  # not before the prologue has succeeded

    def one(self, t: float, x: Any, inputs: Any = None, ud: Any = None) -> np.ndarray:
        self.t[0] = t
        self.x[:] = x
        if inputs is not None:
            self.inputs[:] = inputs
        if ud is not None:
            self.ud[:] = ud
        code = self.call(self.address)
        if code:
            raise EvaluationError(failure(self.library.metadata, self.name, self.library.reason(code), t, self.x))
        return self.result.copy()

    def many(self, t: np.ndarray, x: np.ndarray, inputs: np.ndarray, ud: np.ndarray) -> np.ndarray:
        arrays = [np.ascontiguousarray(a, dtype=float) for a in (t, x, ud, inputs)]
        n = _rows(arrays)
        out = np.empty((n, self.size))
        frame = Frame(n, *[a.ctypes.data for a in (*arrays, self.p, self.c, out)], *[int(len(a) > 1) for a in arrays], 0)
        code = self.library.function(f"{self.name}_rows")(ctypes.byref(frame))
        if code:
            raise EvaluationError(failure_of_row(self.library.metadata, self.name, self.library.reason(code), arrays[0],
                                                 arrays[1], frame.failed, n))
        return out.reshape(n, *self.shape)

    def each(self, t: float, x: np.ndarray, inputs: Any) -> np.ndarray:
        self.t[0], self.x[:], self.inputs[:] = t, x, inputs
        return self.result.copy() if self.call(self.address) in (0, NOT_FINITE) else np.full(self.shape, np.nan)


class PythonLibrary:
    """A generated Python module: plain floats for one state, NumPy for many."""

    backend = "numpy"

    def __init__(self, module: ModuleType, source: str) -> None:
        self.module = module
        self.source = source

    @functools.cached_property
    def metadata(self) -> Metadata:
        """Metadata of the code. Raises SymdynError where it was written by another version."""
        return Metadata.of_plain(self.module.METADATA)

    @classmethod
    def from_source(cls, source: str, name: str) -> PythonLibrary:
        """Put the source into the cache and import it, whatever lies there under its name.

        Raises CacheError where the cache folder does not take it.
        """
        text = source.encode()
        key = hashlib.sha256(text).hexdigest()[:16]
        path = cache.cache_dir() / f"{name[:cache.LONGEST]}-{key}.py"
        with cache.writing(path):
            if not (path.is_file() and path.read_bytes() == text):
                write_whole(path, lambda file: file.write(text), PRIVATE, sync=False)
        return cls(import_text(source, path), source)

    @classmethod
    def from_file(cls, path: Path) -> PythonLibrary:
        """Import a generated module from its file."""
        source = path.read_text(encoding="utf-8")
        return cls(import_text(source, path), source)

    def evaluator(self, name: str) -> PythonEvaluator:
        return PythonEvaluator(self, name)

    def evaluate(self, name: str, *arguments: Any) -> np.ndarray:
        """A function at one state or at rows of states; arguments as those of the module's own `evaluate`.

        Raises EvaluationError from what the text of a user's function raises; ArithmeticError or ValueError where the function
        cannot be evaluated.
        """
        try:
            result: np.ndarray = self.module.evaluate(name, *arguments)
            return result
        except Exception as error:
            raise_by_text(error)
            raise

    def broadcast(self, name: str, t: np.ndarray, x: np.ndarray, p: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """A function that gives rows, at t (n,), x (n, n_x), parameters (n, n_p) and inputs (n, n_in): (n, n_out).

        Raises the module's SingularError, which says the rows, where single ones cannot be evaluated; ArithmeticError or
        ValueError where it is not known which.
        """
        sizes = self.metadata.sizes
        x, p, inputs = (a.T for a in (x, p, inputs))
        q, u, z = np.split(x, np.cumsum([sizes.q, sizes.u]))
        many = self.module._MANY
        with np.errstate(all="ignore"):
            try:
                result = many[name](t, q, u, z, np.zeros((sizes.ud, 1)), inputs, p, many["prologue"](p))
            except Exception as error:
                raise_by_text(error)
                raise
            return np.stack([np.broadcast_to(r, t.shape) for r in result], axis=-1)


def loaded(text: str, metadata: Metadata, compiler: Compiler | None) -> Library:
    """Generated text as loaded code: C by a compiler, a Python module without one.

    Raises CompileError where the compiler rejects the text, CacheError where the cache folder does not take it.
    """
    return PythonLibrary.from_source(text, metadata.name) if compiler is None else CLibrary(text, metadata, compiler)


class RowsError(Exception):
    """Why some of many rows cannot be evaluated; first: of these rows the first."""

    def __init__(self, why: str, failed: np.ndarray) -> None:
        super().__init__(why)
        self.first = int(np.argmax(failed))


class PythonEvaluator:
    """One function of a generated Python module."""

    def __init__(self, library: PythonLibrary, name: str) -> None:
        self.library = library
        self.name = name
        self.p: tuple[float, ...] = ()

    def set_params(self, p: np.ndarray) -> None:
        self.p = tuple(p.tolist())

    def one(self, t: float, x: Any, inputs: Any = None, ud: Any = None) -> np.ndarray:
        sizes = self.library.metadata.sizes
        inputs = [0.0] * sizes.inputs if inputs is None else inputs
        ud = [0.0] * sizes.ud if ud is None else ud
        state = np.asarray(x, dtype=float)
        if state.ndim != 1:
            raise ValueError(f"one state has one dimension, found the shape {state.shape}")
        return self._evaluate(float(t), state, inputs, ud)

    def many(self, t: np.ndarray, x: np.ndarray, inputs: np.ndarray, ud: np.ndarray) -> np.ndarray:
        n = _rows((t, x, inputs, ud))
        rows = [np.broadcast_to(a, (n, *np.shape(a)[1:])) for a in (t, x, inputs, ud)]
        with np.errstate(all="ignore"):
            try:
                return self._evaluate(*rows)
            except RowsError as error:
                why, first = str(error), error.first
            while first:  # as with C the first row that fails is reported; one before it may fail later on
                try:
                    self._evaluate(*[a[:first] for a in rows])
                    break
                except RowsError as error:
                    why, first = str(error), error.first
        raise EvaluationError(failure_of_row(self.library.metadata, self.name, why, rows[0], rows[1], first, n))

    def each(self, t: float, x: np.ndarray, inputs: Any) -> np.ndarray:
        sizes = self.library.metadata.sizes
        rows = [np.atleast_2d(np.asarray(a, dtype=float)) for a in (x, inputs, np.zeros(sizes.ud))]
        with np.errstate(all="ignore"):
            try:
                result: np.ndarray = self.library.evaluate(self.name, np.array([t]), rows[0], self.p, *rows[1:])[0]
            except (ArithmeticError, ValueError):
                result = np.full(self.library.metadata.shapes[self.name], np.nan)
        return result

    def _evaluate(self, t: Any, x: Any, inputs: Any, ud: Any) -> np.ndarray:
        try:
            result = self.library.evaluate(self.name, t, x, self.p, inputs, ud)
        except (ArithmeticError, ValueError) as error:
            if np.ndim(x) > 1 and len(x) and isinstance(error, self.library.module.SingularError):
                raise RowsError(str(error), np.broadcast_to(error.states, len(x))) from None
            why = f"; {check_parameters(self.library.metadata, self.p)}" if in_prologue(error) else ""
            raise EvaluationError(failure(self.library.metadata, self.name, f"{error}{why}", t, x)) from error.__cause__
        if np.isfinite(result).all():
            return result
        if np.ndim(x) > 1:
            raise RowsError("the result is not finite", ~np.isfinite(result).reshape(len(x), -1).all(axis=1))
        raise EvaluationError(failure(self.library.metadata, self.name, "the result is not finite", t, x))


def check_parameters(metadata: Metadata, p: Sequence[float] | np.ndarray) -> str:
    """Advice where expressions of parameters alone cannot be computed: check first the parameters that are 0."""
    zero = [name for name, value in zip(metadata.parameters, p, strict=False) if value == 0]
    return "check the parameters" + (f", of which {', '.join(zero)} {'are' if len(zero) > 1 else 'is'} 0" if zero else "")


def _rows(arrays: Sequence[np.ndarray]) -> int:
    """Number of states: one row holds for all, and no row is no state."""
    lengths = [len(a) for a in arrays]
    return 0 if 0 in lengths else max(lengths)


def failure_of_row(metadata: Metadata, name: str, reason: str, t: np.ndarray, x: np.ndarray, k: int, n: int) -> str:
    """The sentence for row k of n, where t and x have n rows or one for all."""
    text = failure(metadata, name, reason, t[min(k, len(t) - 1)], x[min(k, len(x) - 1)])
    return text + (f" (row {k} of {n})" if n > 1 else "")


def failure(metadata: Metadata, name: str, reason: str, t: Any, x: Any) -> str:
    """The sentence for an evaluation that failed."""
    text = f"{metadata.name}: {name} cannot be evaluated: {reason}"
    if np.ndim(x) > 1:
        return text
    state = ", ".join(f"{n} = {v:.6g}" for n, v in zip(metadata.x, np.asarray(x, dtype=float), strict=True))
    bad = [n for n, v in zip(metadata.x, np.asarray(x, dtype=float), strict=True) if not np.isfinite(v)]
    return f"{text}; at t = {float(t):.6g}, {state}" + (f" ({', '.join(bad)} given not finite)" if bad else "")
