"""A program: functions of straight-line statements in one dialect, ready for a template to lay out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from symdyn.backend.columns import Columns, MotionColumns, seeds_of
from symdyn.backend.dialect import Dialect
from symdyn.backend.draft import Draft, Drafts
from symdyn.backend.function import ARGUMENTS, Along, Function, Motion
from symdyn.backend.rolled import Rolled
from symdyn.backend.user_functions import called
from symdyn.backend.writer import PROLOGUE, STOPPING, Writer, checks_of, cores_of
from symdyn.tape.external import UserFunction
from symdyn.tape.intrinsics import Intrinsic
from symdyn.tape.node import SEED, Node
from symdyn.tape.tape import Output, Tape, count_of, reachable, unsigned

if TYPE_CHECKING:
    from symdyn.given import Rolling

# Ends of the names of the two ways of a function that is tried in one way first.
REGULAR, SINGULAR_FALLBACK = "regular", "singular"
# Derivatives along a direction of so many operations at most are compiled into the function that calls them: measured, that
# takes 3 to 8 % less time in a pendulum of five links, and more in longer ones.
INLINE = 200

# Seconds that a statement takes to compile, measured with gcc 12, and the seconds that loops save at least where nobody asks for
# them: loops that save as much run as fast as the statements; below, their calls cost up to a tenth of the time.
STATEMENT_SECONDS, LEAST_SECONDS = 0.4 / 1500, 0.4
LEAST_SAVED = round(LEAST_SECONDS / STATEMENT_SECONDS)
Rolls = Callable[[str, int], int | None]


def no_loops(name: str, steps: int) -> None:
    """Loops for no function, see `_rolls`."""


@dataclass(frozen=True)
class Program:
    """All functions with their shared prologue.

    reasons   what the return codes 1, 2, ... mean
    intrinsics   numeric algorithms that are called: name -> largest size of each kind
    algorithms   of each of these one call
    one_size  those of them that are called with one size only
    user_functions   functions of the user that are called, by name
    n_c       number of constants that the prologue computes
    common    functions that several of the functions call first
    """

    functions: tuple[Function, ...]
    prologue: Function
    n_c: int
    reasons: tuple[str, ...]
    intrinsics: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    user_functions: tuple[UserFunction, ...] = ()
    one_size: frozenset[str] = frozenset()
    algorithms: tuple[Intrinsic, ...] = ()
    common: tuple[Function, ...] = ()

    @property
    def room_c(self) -> int:
        """Length of an array for the constants: C has none of length 0."""
        return max(self.n_c, 1)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the functions, in order."""
        return tuple(f.name for f in self.functions)

    def named(self, name: str) -> Function:
        """The function of a name."""
        return next(f for f in self.functions if f.name == name)

    @property
    def has_fallbacks(self) -> bool:
        """Whether a function is done in another way where the first one stops."""
        return any(f.singular_fallback is not None for f in self.functions)


def build(dialect: Dialect, tapes: Mapping[str, Tape], titles: Mapping[str, str], leaves: Mapping[str, tuple[str, int]],
          reasons: Sequence[str] = (), singular_fallback: Mapping[str, Tape] | None = None, like: Program | None = None,
          columns: Mapping[str, Columns] | None = None, vectors: Dialect | None = None, rolled: Rolling = "auto") -> Program:
    """Write every tape (function name -> tape with one output) in the dialect.

    leaves      name -> (group, index in it)
    singular_fallback   function name -> the tape for where the first one fails
    like        the same in another dialect, whose rounding this one is to have
    columns     Jacobians whose tapes are derivatives along directions; vectors: the dialect of these
    rolled      whether repeated statements become loops: "auto" where that saves LEAST_SECONDS of compilation, True wherever they
                can; where `like` is given, in those functions that it has loops in
    """
    singular_fallback, columns = singular_fallback or {}, columns or {}
    first = next(iter(tapes.values()))
    outputs = {name: next(iter(tape.outputs.values())) for name, tape in
               [*tapes.items(), *((f"{name}_{SINGULAR_FALLBACK}", tape) for name, tape in singular_fallback.items())]}
    whole = first if first.outputs == outputs else Tape(first.recorder, outputs)
    codes = {r: k + 1 for k, r in enumerate(dict.fromkeys(
        [*reasons, *checks_of(whole, whole.steps).values()]))}
    late = _late(whole, tapes, singular_fallback)
    arrays = whole.arrays
    used = arrays.read_by(arrays.running | arrays.marked(late)) > 0
    used |= arrays.marked(unsigned(e) for o in whole.outputs.values() for e in o.entries)
    constants = {node: k for k, node in enumerate(n for n in arrays.chosen(used & arrays.prologue) if n not in late)}
    hoisted = {node: ("c", k) for node, k in constants.items()}
    inlined = {w.name: w.inlined for f in (*like.functions, *like.common) for w in f.with_called} if like else {}
    drafts = Drafts(dialect, leaves, hoisted, codes, late, inlined)
    vectored = [name for name in tapes if name in columns] if vectors is not None else []
    ways = {f"{name}_{REGULAR}" if name in singular_fallback else name: (name, tape) for name, tape in tapes.items()
            if name not in vectored}
    ways |= {f"{name}_{SINGULAR_FALLBACK}": (name, tape) for name, tape in singular_fallback.items()}
    rolls = _rolls(dialect, rolled, late, like)
    written = _written(drafts, [drafts.draft(tape, called, titles[name]) for called, (name, tape) in ways.items()], rolls)
    for name in vectored:
        called = f"{name}_{REGULAR}" if name in singular_fallback else name
        written[called] = _columns(columns[name], called, titles[name], drafts, replace(
            drafts, dialect=vectors or dialect, late=set(), inlined=inlined))
    functions = tuple(
        _either(name, titles[name], written[f"{name}_{REGULAR}"], written[f"{name}_{SINGULAR_FALLBACK}"])
        if name in singular_fallback else written[name] for name in tapes)
    common = {f.name: f for function in written.values() for f in function.calls}
    prologue = _prologue(Writer(dialect, whole, leaves, {}, codes, late), constants, rolls, functions)
    return Program(functions, prologue, len(constants), tuple(codes), *_intrinsics(whole), tuple(common.values()))


def _written(drafts: Drafts, wanted: Sequence[Draft], rolls: Rolls) -> dict[str, Function]:
    """Functions by name, with loops where these save enough; what others have in common stands once."""
    made: dict[str, Function] = {}
    for draft in wanted:
        least = rolls(draft.name, len(draft.body))
        looped = None if least is None else drafts.looped(draft, least)
        if looped is not None:
            made[draft.name] = looped
    straight = [draft for draft in wanted if draft.name not in made]
    beginnings = drafts.beginnings(straight)
    return made | {draft.name: drafts.straight(draft, beginnings.get(draft.name)) for draft in straight}


def _rolls(dialect: Dialect, rolled: Rolling, late: set[Node], like: Program | None) -> Rolls:
    """The statements that loops of a function, by its name and number of steps, have to save; None: it gets none.

    Steps of the prologue that wait until a function runs are read from nowhere: with these everything is straight-line.
    """
    if dialect.loops is None or dialect.parts is None or rolled is False or late:
        return no_loops
    if like is not None:
        with_loops = {w.name for f in like.functions for w in (f, f.regular, f.singular_fallback) if w is not None and w.loops}
        return lambda name, steps: 1 if name in with_loops else None
    least = LEAST_SAVED if rolled == "auto" else 1
    return lambda name, steps: least if steps > least else None


def _prologue(writer: Writer, constants: Mapping[Node, int], rolls: Rolls, functions: Sequence[Function]) -> Function:
    """The function that computes the constants, with loops for what it repeats, at least where another one has loops."""
    tape = writer.tape
    rolled = any(w.loops for f in functions for w in (f, f.regular, f.singular_fallback) if w is not None)
    repeats = 1 if rolled else rolls("prologue", len(tape.prologue))
    if repeats is not None:
        one_by_one = replace(writer.dialect, sincos=None)
        made = Rolled(one_by_one, tape, writer.leaves, {}, writer.codes, checks_of(tape, tape.prologue), tape.prologue,
                      tuple(constants))
        if made.saved >= repeats:
            return made.function("prologue", PROLOGUE, (len(constants),), 0)
    return writer.prologue(constants)


def _late(whole: Tape, tapes: Mapping[str, Tape], singular_fallback: Mapping[str, Tape]) -> set[Node]:
    """Steps that depend on parameters only, and yet wait until a function runs: they divide by what may vanish, and then there
    is another way to compute the function."""
    if not singular_fallback:
        return set()
    either = [set(checks_of(tape, tape.prologue)) for name, tape in tapes.items() if name in singular_fallback]
    always = [set(checks_of(tape, tape.prologue)) for tape in
              [*[tape for name, tape in tapes.items() if name not in singular_fallback], *singular_fallback.values()]]
    demanded = set().union(*either).difference(*always)
    late: set[Node] = set()
    for node in whole.prologue:
        divides = node.op == "div" and unsigned(node.args[1]) in demanded
        if divides or (node.op in STOPPING and node in demanded) or not late.isdisjoint(cores_of(node.args)):
            late.add(node)
    return late


def _either(name: str, title: str, regular: Function, singular_fallback: Function) -> Function:
    """A function that is tried in one way first."""
    groups = {*regular.arguments, *singular_fallback.arguments}
    return Function(name, title, regular.shape, tuple(g for g in ARGUMENTS if g in groups), (), (), (), regular.operations,
                    regular.longest_chain, regular=regular, singular_fallback=singular_fallback)


def _intrinsics(tape: Tape) -> tuple[dict[str, tuple[int, ...]], tuple[UserFunction, ...], frozenset[str],
                                     tuple[Intrinsic, ...]]:
    """Numeric algorithms with their largest sizes, functions of the user, the algorithms that are called with one size, and of
    each algorithm one call."""
    sizes: dict[str, set[tuple[int, ...]]] = {}
    calls: dict[str, Intrinsic] = {}
    for node in tape.arrays.chosen(tape.arrays.does("call")):
        if not isinstance(node.args[0], UserFunction):
            sizes.setdefault(node.args[0].name, set()).add(tuple(node.args[0].sizes))
            calls.setdefault(node.args[0].name, node.args[0])
    largest = {name: tuple(map(max, zip(*result, strict=True))) for name, result in sorted(sizes.items())}
    one_size = frozenset(name for name, result in sizes.items() if len(result) == 1)
    return largest, called(tape), one_size, tuple(calls[name] for name in largest)


def _columns(columns: Columns, name: str, title: str, drafts: Drafts, vectors: Drafts) -> Function:
    """A Jacobian as a function of what all columns share, and functions of directions, on vectors."""
    tape, leaves, hoisted = columns.tape, drafts.leaves, drafts.hoisted
    moving = [node for node in tape.steps if node.mask & SEED]
    shared = dict.fromkeys(core for node in moving for core in cores_of(node.args)
                           if not core.mask & SEED and core.mask and core.op != "leaf" and core not in hoisted)
    kept = (*shared, *columns.values)
    values = drafts.function(Tape(tape.recorder, {"v": Output("v", (len(kept),), kept)}), f"{name}_values", title,
                             dividing=moving)
    stored = {**hoisted, **{node: ("v", k) for k, node in enumerate(shared)}}
    along = []
    for k, group in enumerate(columns.groups):
        entries = columns.entries(k)
        part = Tape(tape.recorder, {"along": Output("along", (len(entries),), entries)})
        function = replace(vectors, hoisted=stored, leaves={**leaves, **seeds_of(group)}).function(
            part, f"{name}_along_{group.name}", title, [n for n in reachable(entries) if n.mask & SEED])
        along.append(Along(group.first, len(group.seeds), function, not function.parts and function.count <= INLINE))
    groups = {g for f in (values, *[a.function for a in along]) for g in f.arguments}
    operations = count_of([n for n in tape.steps if n.op != "leaf" and n not in hoisted])
    motion = None
    if isinstance(columns, MotionColumns):
        n_z, n_p = (sum(group == wanted for group, _ in leaves.values()) for wanted in ("z", "p"))
        motion = Motion(columns.n_rows, columns.n, len(shared), n_z - columns.n * columns.n_rows, columns.held,
                        n_p - columns.n * columns.held, tuple(-1 if k is None else k for k in columns.by))
        groups |= {"z", *["p"] * bool(columns.held)}
    return Function(name, title, columns.result_shape, tuple(g for g in ARGUMENTS if g in groups - {"v", "change"}),
                    (), (), (), operations, tape.longest_chain(), values=values, along=tuple(along), motion=motion)
