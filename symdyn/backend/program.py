"""A program: functions of straight-line statements in one dialect, ready for a template to lay out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

from symdyn.backend.dialect import Dialect
from symdyn.backend.divide import divide
from symdyn.backend.function import ARGUMENTS, Function, Part
from symdyn.backend.user_functions import called
from symdyn.backend.writer import STOPPING, Writer, checks_of, cores_of
from symdyn.tape.external import UserFunction
from symdyn.tape.node import Node
from symdyn.tape.tape import Tape, count_of, unsigned

# Ends of the names of the two ways of a function that is tried in one way first.
REGULAR, OTHERWISE = "regular", "singular"


@dataclass(frozen=True)
class Program:
    """All functions with their shared prologue.

    reasons   what the return codes 1, 2, ... mean
    kernels   numeric algorithms that are called: name -> largest size of each kind
    one_size  those of them that are called with one size only
    user_functions   functions of the user that are called, by name
    n_c       number of constants that the prologue computes
    """

    functions: tuple[Function, ...]
    prologue: Function
    n_c: int
    reasons: tuple[str, ...]
    kernels: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    user_functions: tuple[UserFunction, ...] = ()
    one_size: frozenset[str] = frozenset()


def build(dialect: Dialect, tapes: Mapping[str, Tape], titles: Mapping[str, str], places: Mapping[str, tuple[str, int]],
          reasons: Sequence[str] = (), otherwise: Mapping[str, Tape] | None = None, like: Program | None = None) -> Program:
    """Write every tape (function name -> tape with one output) in the dialect.

    places      leaf name -> (group, place in it)
    otherwise   function name -> the tape for where the first one fails
    like        the same in another dialect, whose rounding this one is to have
    """
    otherwise = otherwise or {}
    whole = Tape(next(iter(tapes.values())).recorder,
                 {name: next(iter(tape.outputs.values())) for name, tape in
                  [*tapes.items(), *((f"{name}_{OTHERWISE}", tape) for name, tape in otherwise.items())]})
    codes = {r: k + 1 for k, r in enumerate(dict.fromkeys(
        [*reasons, *checks_of(whole, whole.steps).values()]))}
    late = _late(whole, tapes, otherwise)
    used = set(cores_of([a for n in (*whole.running, *late) for a in n.args]
                      + [e for o in whole.outputs.values() for e in o.entries]))
    constants = {node: k for k, node in enumerate(n for n in whole.prologue if n in used and n not in late)}
    hoisted = {node: ("c", k) for node, k in constants.items()}
    inlined = {w.name: w.inlined for f in like.functions for w in (f, f.regular, f.otherwise) if w} if like else {}
    write = partial(_function, dialect, places=places, hoisted=hoisted, codes=codes, late=late, inlined=inlined)
    functions = tuple(
        _either(name, titles[name], write(tape, name=f"{name}_{REGULAR}", title=titles[name]),
                write(otherwise[name], name=f"{name}_{OTHERWISE}", title=titles[name])) if name in otherwise
        else write(tape, name=name, title=titles[name]) for name, tape in tapes.items())
    prologue = Writer(dialect, whole, places, {}, codes, late).prologue(constants)
    return Program(functions, prologue, len(constants), tuple(codes), *_kernels(whole))


def _late(whole: Tape, tapes: Mapping[str, Tape], otherwise: Mapping[str, Tape]) -> set[Node]:
    """Steps that depend on parameters only, and yet wait until a function runs: they divide by what may vanish, and then there
    is another way to compute the function."""
    either = [set(checks_of(tape, tape.prologue)) for name, tape in tapes.items() if name in otherwise]
    always = [set(checks_of(tape, tape.prologue)) for tape in
              [*[tape for name, tape in tapes.items() if name not in otherwise], *otherwise.values()]]
    demanded = set().union(*either).difference(*always)
    late: set[Node] = set()
    for node in whole.prologue:
        divides = node.op == "div" and unsigned(node.args[1]) in demanded
        if divides or (node.op in STOPPING and node in demanded) or not late.isdisjoint(cores_of(node.args)):
            late.add(node)
    return late


def _either(name: str, title: str, regular: Function, otherwise: Function) -> Function:
    """A function that is tried in one way first."""
    groups = {*regular.arguments, *otherwise.arguments}
    return Function(name, title, regular.shape, tuple(g for g in ARGUMENTS if g in groups), (), (), (), regular.operations,
                    regular.longest_chain, regular=regular, otherwise=otherwise)


def _kernels(tape: Tape) -> tuple[dict[str, tuple[int, ...]], tuple[UserFunction, ...], frozenset[str]]:
    """Numeric algorithms with their largest sizes, functions of the user, and the algorithms that are called with one size."""
    sizes: dict[str, set[tuple[int, ...]]] = {}
    for node in tape.steps:
        if node.op == "call" and not isinstance(node.args[0], UserFunction):
            sizes.setdefault(node.args[0].name, set()).add(tuple(node.args[0].sizes))
    largest = {name: tuple(map(max, zip(*found, strict=True))) for name, found in sorted(sizes.items())}
    return largest, called(tape), frozenset(name for name, found in sizes.items() if len(found) == 1)


def _function(dialect: Dialect, tape: Tape, places: Mapping[str, tuple[str, int]], hoisted: Mapping[Node, tuple[str, int]],
              codes: Mapping[str, int], late: set[Node], name: str, title: str,
              inlined: Mapping[str, frozenset[Node]]) -> Function:
    """One function, in parts if it is long and the dialect divides long ones."""
    wanted = inlined.get(name)
    output = next(iter(tape.outputs.values()))
    running = {*tape.running, *late}
    body = [n for n in tape.steps if n in running and n not in hoisted and n.op != "leaf"]
    operations = count_of(body)
    checks = checks_of(tape, [*tape.running, *(n for n in tape.prologue if n in late)])
    if dialect.parts is None or len(body) <= dialect.parts.whole:
        writer = Writer(dialect, tape, places, hoisted, codes, late, wanted)
        part = writer.part(body, output.entries, writer.results_of(output.entries), checks)
        return Function(name, title, output.shape, part.arguments, part.loads, part.sections, part.results, operations,
                        tape.longest_chain(), inlined=frozenset(writer.printer.inline))
    parts: list[Part] = []
    earlier: dict[Node, tuple[str, int]] = {}
    found: set[Node] = set()
    stretches, slots, n_w = divide(body, output.entries, dialect.parts.longest)
    for k, (stretch, kept) in enumerate(stretches):
        writer = Writer(dialect, tape, places, {**hoisted, **earlier}, codes, late, wanted)
        if k == len(stretches) - 1:
            parts.append(writer.part(stretch, output.entries, writer.results_of(output.entries), checks))
        else:
            parts.append(writer.part(stretch, kept, partial(writer.keep, kept, slots), checks))
        earlier |= {node: ("w", slots[node]) for node in kept}
        found |= writer.printer.inline
    groups = {g for part in parts for g in part.arguments}
    return Function(name, title, output.shape, tuple(g for g in ARGUMENTS if g in groups), (), (), (), operations,
                    tape.longest_chain(), tuple(parts), n_w, inlined=frozenset(found))
