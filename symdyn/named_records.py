"""Records that templates get, each by its name."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any


@dataclass(frozen=True)
class NamedRecords:
    """Records that templates get, each by its name."""

    def names(self) -> dict[str, Any]:
        """Each record by its name, as Jinja2 takes them."""
        return {f.name: getattr(self, f.name) for f in fields(self)}
