"""Names for symbols and bodies, and which numbers of a file become parameters."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase
from typing import Any

import sympy as sp

from symdyn.model.symbols import parameters
from symdyn.shown import shown
from symdyn.urdf.values import nearest

_ODD = re.compile(r"[^\w .,:+*/^'(){}\[\]%#-]")


class Names:
    """Gives each name once."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self.taken = set(taken)

    def symbol(self, name: str) -> str:
        """An identifier like the name, which no symbol and no rate of one has."""
        return self._free(re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_") or "_", "_", ("", "_dot", "_ddot"))

    def text(self, name: str) -> str:
        """The name itself, without characters that comments of generated code cannot hold."""
        return self._free(_ODD.sub("_", name), " ", ("",))

    def _free(self, name: str, gap: str, ends: tuple[str, ...]) -> str:
        result, k = name, 1
        while any(result + end in self.taken for end in ends):
            k += 1
            result = f"{name}{gap}{k}"
        self.taken.update(result + end for end in ends)
        return result


class Parameters:
    """Takes numbers over, as they are or as symbols with these for defaults.

    patterns   of the parameters that become symbols: of their own names, or those of their link or joint, with * and ? as in
               the names of files
    """

    def __init__(self, patterns: Sequence[str], names: Names) -> None:
        self.patterns = patterns
        self.names = names
        self.defaults: dict[sp.Symbol, float] = {}
        self.seen: dict[str, None] = {}
        self.used: set[str] = set()

    def take(self, letters: str, owner: str, value: float) -> Any:
        """A parameter of a link or joint, such as "m": the number, or the symbol m_OWNER."""
        return self._take(f"{letters}_{re.sub(r'[^a-zA-Z0-9_]+', '_', owner)}", value, owner)

    def gravity(self, value: float) -> Any:
        """The acceleration of gravity, g."""
        return self._take("g", value)

    def _take(self, name: str, value: float, owner: str | None = None) -> Any:
        known = [name] if owner is None else [name, owner]
        self.seen.update(dict.fromkeys(known))
        fitting = [p for p in self.patterns if any(fnmatchcase(n, p) for n in known)]
        if not fitting:
            return plain(value)
        self.used.update(fitting)
        symbol = parameters(self.names.symbol(name))
        self.defaults[symbol] = value
        return symbol

    def faults(self) -> list[str]:
        """Patterns that fit nothing."""
        return [f"symbolic has {shown(p)}, which fits no parameter, link or joint{nearest(p, self.seen)} (parameters: m_LINK, "
                "c_x_LINK, I_xx_LINK, p_x_JOINT and so on, and g)" for p in self.patterns if p not in self.used]


def plain(value: float) -> int | float:
    """A number; a whole one exactly, so that zeros and ones vanish from sums and products."""
    return int(value) if value == int(value) and abs(value) < 1e15 else value
