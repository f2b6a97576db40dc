"""Small changes of Python source that its tests should notice: operators, comparisons, conditions, constants, results.

Code that no test of results sees is left out: texts, messages, annotations, decorators, assertions for type checkers.
"""

from __future__ import annotations

import ast
import bisect
from collections.abc import Iterator
from dataclasses import dataclass

OPERATORS: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.FloorDiv: ("//", "/"),
    ast.Mod: ("%", "*"), ast.Pow: ("**", "*"), ast.BitAnd: ("&", "|"), ast.BitOr: ("|", "&"), ast.LShift: ("<<", ">>"),
    ast.RShift: (">>", "<<")}
COMPARISONS: dict[type[ast.cmpop], tuple[str, str]] = {
    ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">"), ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="), ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"), ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in")}
# Arguments that only guard against mistakes of a programmer, or say how something is shown or cached.
PASSIVE = {"strict", "stacklevel", "maxsize", "repr", "slots", "frozen", "kw_only", "compare", "encoding"}
# Functions whose arguments are messages.
MESSAGES = {"warn", "warn_model", "print", "TypeVar", "cast"}


@dataclass(frozen=True)
class Change:
    """One change.

    line      where the changed expression begins, from 1
    begin     of the text that is replaced, in bytes of UTF-8 from the beginning of the file; `end` is behind it
    after     the text instead
    function  the qualified name of the function around it
    """

    line: int
    begin: int
    end: int
    after: str
    function: str

    def apply(self, text: str) -> str:
        """The text of a file with this change."""
        data = text.encode()
        return (data[:self.begin] + self.after.encode() + data[self.end:]).decode()

    def lines(self, text: str) -> tuple[str, str]:
        """The line as it is, and with this change."""
        return text.splitlines()[self.line - 1].strip(), self.apply(text).splitlines()[self.line - 1].strip()


def functions(tree: ast.AST, within: str = "") -> Iterator[tuple[str, ast.FunctionDef]]:
    """All functions and methods below a node with their qualified names, such as "System.check"."""
    for node in ast.iter_child_nodes(tree):
        name = within
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            name = f"{within}.{node.name}".lstrip(".")
            if isinstance(node, ast.FunctionDef):
                yield name, node
        yield from functions(node, name)


def changes(text: str) -> list[Change]:
    """All changes of a file, in its order; what is outside functions is left as it is."""
    tree = ast.parse(text)
    starts = [0]
    for line in text.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    data, found = text.encode(), []
    names = {id(node): name for name, node in functions(tree)}

    def add(begin: int, end: int, after: str, function: str) -> None:
        found.append(Change(bisect.bisect_right(starts, begin), begin, end, after, function))

    def span(node: ast.expr) -> tuple[int, int]:
        assert node.end_lineno is not None and node.end_col_offset is not None
        return starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset

    def between(left: ast.expr, right: ast.expr, sign: str) -> tuple[int, int] | None:
        """Where an operator stands between two operands, past parentheses and comments."""
        begin, end = span(left)[1], span(right)[0]
        at = data.find(sign.encode(), begin, end)
        return None if at < 0 or b"#" in data[begin:end] else (at, at + len(sign))

    def negate(node: ast.expr, function: str) -> None:
        begin, end = span(node)
        add(begin, end, f"(not ({data[begin:end].decode()}))", function)

    for node, function in _live(tree, names):
        if isinstance(node, (ast.BinOp, ast.AugAssign)) and type(node.op) in OPERATORS:
            sign, other = OPERATORS[type(node.op)]
            operands = (node.left, node.right) if isinstance(node, ast.BinOp) else (node.target, node.value)
            if not any(_is_text(operand) for operand in operands) and (where := between(*operands, sign)):
                add(*where, other, function)
        elif isinstance(node, ast.Compare):
            left = node.left
            for operator, right in zip(node.ops, node.comparators, strict=True):
                sign, other = COMPARISONS[type(operator)]
                if where := between(left, right, sign):
                    add(*where, other, function)
                left = right
        elif isinstance(node, ast.BoolOp):
            sign, other = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
            for left, right in zip(node.values, node.values[1:], strict=False):
                if where := between(left, right, sign):
                    add(*where, other, function)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.Not, ast.USub)):
            add(*span(node), data[slice(*span(node.operand))].decode(), function)
        elif isinstance(node, ast.Constant) and isinstance(node.value, (bool, int, float)):
            add(*span(node), _other(node.value), function)
        elif isinstance(node, (ast.If, ast.IfExp)):
            negate(node.test, function)
        elif isinstance(node, ast.comprehension):
            for condition in node.ifs:
                negate(condition, function)
        elif isinstance(node, ast.Return) and node.value is not None and not isinstance(node.value, ast.Constant):
            if isinstance(node.value, (ast.Compare, ast.BoolOp)) or (
                    isinstance(node.value, ast.UnaryOp) and isinstance(node.value.op, ast.Not)):
                negate(node.value, function)
            else:
                add(*span(node.value), "None", function)
    return sorted(set(found), key=lambda change: (change.begin, change.end, change.after))


def _live(node: ast.AST, names: dict[int, str], function: str = "") -> Iterator[tuple[ast.AST, str]]:
    """Nodes within functions that decide something, each with the name of the function around it."""
    function = names.get(id(node), function)
    if function:
        yield node, function
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "bases", "keywords") and not isinstance(node, ast.Call):
            continue
        if isinstance(node, ast.Raise) or _is_passive(node):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and not isinstance(child, (ast.JoinedStr, ast.Raise, ast.Assert)):
                yield from _live(child, names, function)


def _is_passive(node: ast.AST) -> bool:
    if isinstance(node, ast.keyword):
        return node.arg in PASSIVE
    if isinstance(node, ast.Call):
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        return name in MESSAGES or name.endswith(("Error", "Warning"))
    return isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)


def _other(value: float) -> str:
    """Another constant: the opposite, the next integer, twice the number."""
    if isinstance(value, bool):
        return str(not value)
    return str(value + 1) if isinstance(value, int) else repr(2 * value or 1.0)


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))
