"""Changes by mutation sampling."""

from __future__ import annotations

import ast

from tests.mutation.changes import changes, functions

TEXT = '''"""A module - with 1 docstring."""
LIMIT = 3


class Box:
    """Of size > 0."""

    def grown(self, by: "int | None" = 1) -> "int | None":
        """self.size + by."""
        if self.size < 0 and by is not None:
            raise ValueError(f"{self.size + 1} is below 0" + "!")
        warn("grows by 2", 3)
        return self.size + by  # + 1

    def fits(self, other):
        return not other.size <= self.size
'''
CHANGED = [
    ("grown", 'def grown(self, by: "int | None" = 2) -> "int | None":'),
    ("grown", "if (not (self.size < 0 and by is not None)):"),
    ("grown", "if self.size <= 0 and by is not None:"),
    ("grown", "if self.size < 1 and by is not None:"),
    ("grown", "if self.size < 0 or by is not None:"),
    ("grown", "if self.size < 0 and by is None:"),
    ("grown", "return None  # + 1"),
    ("grown", "return self.size - by  # + 1"),
    ("fits", "return (not (not other.size <= self.size))"),
    ("fits", "return other.size <= self.size"),
    ("fits", "return not other.size < self.size"),
]


def test_operators_comparisons_conditions_constants_and_results_are_changed_messages_are_not() -> None:
    found = [(change.function, change.lines(TEXT)[1]) for change in changes(TEXT)]
    assert found == [(f"Box.{name}", line) for name, line in CHANGED]


def test_every_change_is_python_and_changes_what_is_done() -> None:
    before = ast.dump(ast.parse(TEXT))
    assert all(ast.dump(ast.parse(change.apply(TEXT))) != before for change in changes(TEXT))


def test_functions_have_qualified_names() -> None:
    assert [name for name, _ in functions(ast.parse(TEXT))] == ["Box.grown", "Box.fits"]
