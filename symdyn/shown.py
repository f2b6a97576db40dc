"""Values of a user in messages: short, whatever they are, and never a reason for another error."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

LENGTH = 120


def shown(value: Any, length: int = LENGTH) -> str:
    """The value's repr, cut to so many characters, and its type where there is no repr.

    A whole number of thousands of digits has none: Python does not write it out. A repr of a user's class that raises counts as
    none.
    """
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > 400:
        return f"a whole number of about {int(value.bit_length() * 0.30103) + 1} digits"
    try:
        text = repr(value[:length]) if isinstance(value, (str, bytes)) else repr(value)
    except Exception:
        return f"a value of the type {type(value).__name__}"
    return text if len(text) <= length + 2 else f"{text[:length]} ..."


def name_of(value: Any) -> str:
    """The name of a symbol or of anything else that has one, text as it is, that of a rate or acceleration for a derivative by
    time of SymPy's q(t); of the rest what `shown` makes of it."""
    try:
        name = _of_derivative(value) or getattr(value, "name", value)
    except Exception:  # of a user's own class
        name = value
    return str(name) if isinstance(name, str) else shown(name)


def by_name(given: Mapping[Any, Any] | None) -> dict[str, Any]:
    """A mapping with names in place of its keys, symbols or names; an empty one for None."""
    return {} if given is None else {name_of(key): value for key, value in given.items()}


def _of_derivative(value: Any) -> str:
    """q_dot for Derivative(q(t), t), "" for anything that is none."""
    if type(value).__name__ != "Derivative":
        return ""
    base, order = value.args[0], value.derivative_count
    return f"{base.name}_{'d' * int(order)}ot" if order in (1, 2) and isinstance(getattr(base, "name", None), str) else ""
