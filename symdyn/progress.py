"""Progress bars, where tqdm is installed."""

from __future__ import annotations

from typing import Any

from symdyn.errors import MissingExtra


def bar(**options: Any) -> Any:
    """tqdm's bar with these options. Raises MissingExtra without tqdm."""
    try:
        from tqdm.auto import tqdm
    except ImportError:
        raise MissingExtra("a progress bar needs tqdm: pip install 'symdyn[progress]', or leave out progress=True") from None
    return tqdm(**options)
