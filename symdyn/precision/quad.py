"""A tape as compiled C with numbers of 113 binary digits (gcc's __float128 and libquadmath), in place of symdyn.precision.program
where so many suffice: a hundred times as fast."""

from __future__ import annotations

import ctypes
import functools
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any, TypeVar

from mpmath import libmp

from symdyn.errors import CompileError, EvaluationError, SymdynError
from symdyn.folders import templates_folder
from symdyn.precision.extrapolation import NotFinite
from symdyn.precision.program import Lost
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import Compiler, find_compiler
from symdyn.tape.external import UserFunction
from symdyn.tape.node import Node
from symdyn.tape.tape import Tape
from symdyn.tape.walk import Arithmetic, walk

# Binary digits of a number, decimal ones that they surely hold, and decimal ones of the local errors that this is enough for.
BITS, DIGITS, MOST = 113, 33, 28
_BIAS = 16383
_INTRINSICS = ("symdyn_cube", "symdyn_catenary")
# Literals of their templates that hold for doubles only: (1 +- 1/sqrt(3))/2, four times the rounding error, and its root.
_FINER = {"0.7886751345948129": "0.788675134594812882254574390250978728", "9e-16": "8e-34",
          "0.21132486540518713": "0.211324865405187117745425609749021272", "1e-8": "1e-17"}
_INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/", "lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!=",
          "and": "&&", "or": "||"}
_WRITTEN = {"neg": "-{0}", "not": "!{0}", "select": "{0} ? {1} : {2}", "sign": "({0} > 0) - ({0} < 0)", "pi": "M_PIq",
            "abs": "fabsq({0})", "min": "fminq({0}, {1})", "max": "fmaxq({0}, {1})"}
_TRUTHS = ("lt", "le", "gt", "ge", "eq", "ne", "and", "or", "not")
_HEAD = "#include <quadmath.h>\ntypedef __float128 quad;\n"
_LOST = 1
T = TypeVar("T")


class NotInQuad(SymdynError):
    """A tape calls what there is no text of in this arithmetic."""


class TooRough(SymdynError):
    """Numbers have too few digits for what is asked of them."""


def compiler() -> Compiler | None:
    """The compiler of this machine as it is called here; None if it has no such numbers."""
    result = find_compiler()
    return _tried(result) if result is not None and result.kind == "gcc" else None


@functools.cache
def _tried(result: Compiler) -> Compiler | None:
    # Every operation is a call: optimization gains a tenth, and takes several times as long to compile.
    made = replace(result, command=(*result.command, "-std=gnu99", "-O0", "-Wl,--no-as-needed", "-lquadmath"))
    try:
        cache.load(f"{_HEAD}void symdyn_quad(quad *x) {{ *x = sqrtq(*x); }}\n", "quad", made)
    except CompileError:
        return None
    return made


def suits(digits: int) -> bool:
    """Whether these numbers are there and enough for local errors of 10^-digits."""
    return digits <= MOST and compiler() is not None


def twice(run: Callable[[int, bool], T], digits: int, more: int) -> tuple[T, T, bool]:
    """run(digits, compiled) with so many digits and with more, and whether it was compiled, with these numbers: if they suit, and
    unless what is computed needs more of them, as positions next to singular ones do."""
    if suits(digits + more):
        try:
            return run(digits, True), run(digits + more, True), True
        except (ArithmeticError, EvaluationError, TooRough):
            pass
    return run(digits, False), run(digits + more, False), False


def program(tape: Tape, context: Any, fixed: Mapping[str, Any], free: Sequence[str]) -> Compiled:
    """As that of symdyn.precision.program, but compiled; the context has BITS binary digits.

    Raises KeyError naming leaves without a value, NotInQuad, CompileError; f raises Lost where the tape does not hold.
    """
    missing = [leaf.args[1] for leaf in tape.inputs if leaf.args[1] not in {*fixed, *free}]
    if missing:
        raise KeyError(f"no value for {', '.join(missing)}")
    made = compiler()
    if made is None:
        raise NotInQuad("there is no gcc with libquadmath here")
    n = sum(len(output.entries) for output in tape.outputs.values())
    return Compiled(cache.load(source(tape, context, fixed, free), f"quad-{'-'.join(tape.outputs)}", made), n, context)


class Compiled:
    """A tape: f(values of its free leaves) -> all entries of its outputs, n of them."""

    def __init__(self, library: ctypes.CDLL, n: int, context: Any) -> None:
        self._library, self._context = library, context
        self._results = ctypes.create_string_buffer(16 * n)

    def __call__(self, x: Sequence[Any]) -> list[Any]:
        return self._done(self._library.symdyn_quad(self._bytes(x), self._results))

    def midpoint(self, t: Any, x: Sequence[Any], begin: Sequence[Any], h: Any, n: int) -> list[Any]:
        """The midpoint rule of symdyn.precision.extrapolation for a tape of x_dot whose free leaves are t and x."""
        return self._done(self._library.symdyn_midpoint(self._bytes([t, h, *x, *begin]), n, self._results))

    @staticmethod
    def _bytes(values: Sequence[Any]) -> bytes:
        return to_bytes([v._mpf_ for v in values])

    def _done(self, code: int) -> list[Any]:
        if code == _LOST:
            raise Lost("what the equations divide by vanishes here, or a numeric algorithm of theirs fails")
        return [self._context.make_mpf(v) for v in from_bytes(self._results.raw)]


def source(tape: Tape, context: Any, fixed: Mapping[str, Any], free: Sequence[str]) -> str:
    """The C text: int symdyn_quad(const quad *x, quad *out), which returns 1 where the tape does not hold, and the midpoint rule
    if there is an entry for every free leaf but the first."""
    writer = _Writer(context, fixed, free)
    texts = walk(tape.steps, writer)
    lines, intrinsics = writer.lines, writer.intrinsics
    entries = [texts.of(e) for output in tape.outputs.values() for e in output.entries]
    lines += [f"out[{k}] = {entry};" for k, entry in enumerate(entries)]
    body = "\n".join(f"    {line}" for line in [*lines, "return 0;"])
    rule = f"\n#define SYMDYN_SIZE {len(entries)}\n{_part('quad_midpoint')}" if len(entries) == len(free) - 1 else ""
    called = "".join(map(_intrinsic, sorted(intrinsics)))
    return f"{_HEAD}{called}int symdyn_quad(const quad *x, quad *out) {{\n{body}\n}}\n{rule}"


def _intrinsic(name: str) -> str:
    """The text of a numeric algorithm, its doubles made these numbers."""
    text = re.sub(r"//.*|#.*", "", _part(name))
    text = text.replace("SYMDYN_LINKED ", "static ")
    text = re.sub(r"(?<![\w.])(\d+\.\d*(?:e[+-]?\d+)?|\d+e[+-]?\d+)", lambda m: _FINER.get(m[1], m[1]) + "Q", text)
    return re.sub(r"\b(fabs|sqrt|tanh|log1p)(?=\()", r"\1q", re.sub(r"\bdouble\b", "quad", text))


def _part(name: str) -> str:
    """A part of the runtime in C."""
    return (templates_folder() / "c" / "runtime" / f"{name}.h").read_text(encoding="utf-8")


class _Writer(Arithmetic):
    """Lines of C; values are names and literals."""

    def __init__(self, context: Any, fixed: Mapping[str, Any], free: Sequence[str]) -> None:
        self.context, self.fixed, self.places = context, fixed, {name: k for k, name in enumerate(free)}
        self.lines: list[str] = []
        self.intrinsics: set[str] = set()

    def leaf(self, node: Node) -> str:
        name = node.args[1]
        return self._assigned(node, f"x[{self.places[name]}]" if name in self.places else self.number(self.fixed[name]))

    def number(self, value: Any) -> str:
        if isinstance(value, bool):
            return str(int(value))
        exact = self.context.mpf(value.numerator) / value.denominator if isinstance(value, Fraction) else self.context.mpf(value)
        return literal(exact._mpf_)

    def step(self, node: Node, args: list[str]) -> str:
        op = node.op
        if op == "guard":
            self.lines.append(f"if (!({args[1]} > 0)) return {_LOST};")
            return self._assigned(node, args[0])
        if op in _INFIX:
            return self._assigned(node, f"{args[0]} {_INFIX[op]} {args[1]}")
        return self._assigned(node, _WRITTEN[op].format(*args) if op in _WRITTEN else f"{op}q({', '.join(args)})")

    def call(self, node: Node, args: list[str]) -> str:
        intrinsic = node.args[0]
        if isinstance(intrinsic, UserFunction) or intrinsic.name not in _INTRINSICS:
            raise NotInQuad(f"{intrinsic.name} has no text with {BITS} binary digits")
        self.intrinsics.add(intrinsic.name)
        sizes = "".join(f"{n}, " for n in intrinsic.sizes)
        self.lines += [f"const quad a{node.index}[] = {{ {', '.join(args)} }};", f"quad v{node.index}[{intrinsic.n_out}];",
                       f"if ({intrinsic.name}({sizes}a{node.index}, v{node.index})) return {_LOST};"]
        return f"v{node.index}"

    def item(self, node: Node, results: str) -> str:
        return self._assigned(node, f"{results}[{node.args[1]}]")

    def _assigned(self, node: Node, value: str) -> str:
        self.lines.append(f"const {'int' if node.op in _TRUTHS else 'quad'} v{node.index} = {value};")
        return f"v{node.index}"


def literal(value: tuple[int, int, int, int]) -> str:
    """A number of mpmath, as a tuple, as it is written in C, to the last digit."""
    sign, mantissa, exponent, _ = value
    if not mantissa and exponent:
        raise EvaluationError(f"{libmp.to_str(value, 5)} is no finite number")
    return f"{'-' if sign else ''}0x{mantissa:x}p{exponent}Q"


def to_bytes(values: Sequence[tuple[int, int, int, int]]) -> bytes:
    """Numbers of mpmath, as tuples, as the machine keeps them (IEEE 754 binary128, little end first); what is too small is zero.

    Raises EvaluationError for what is no finite number or too large.
    """
    words = []
    for value in values:
        sign, mantissa, exponent, bits = value
        if bits > BITS:
            sign, mantissa, exponent, bits = libmp.mpf_pos(value, BITS, "n")
        index = exponent + bits - 1 + _BIAS
        if (not mantissa and exponent) or index > 2 * _BIAS:
            raise EvaluationError(f"{libmp.to_str(value, 5)} is no finite number of 128 bits")
        word = sign << 127
        if mantissa and index > 0:
            word |= index << (BITS - 1) | (mantissa << (BITS - bits)) & _FRACTION
        words.append(word.to_bytes(16, "little"))
    return b"".join(words)


_FRACTION = (1 << (BITS - 1)) - 1


def from_bytes(raw: bytes) -> list[tuple[int, int, int, int]]:
    """The inverse of `to_bytes`."""
    values = []
    for k in range(0, len(raw), 16):
        word = int.from_bytes(raw[k:k + 16], "little")
        place, fraction = (word >> (BITS - 1)) & 0x7fff, word & _FRACTION
        if place == 2 * _BIAS + 1:
            raise NotFinite("the equations give what is no finite number")
        mantissa = fraction | (1 << (BITS - 1)) if place else 0
        value = libmp.from_man_exp(mantissa, place - _BIAS - BITS + 1)
        values.append(libmp.mpf_neg(value) if word >> 127 else value)
    return values
