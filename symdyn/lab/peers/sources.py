"""The folder of the sources in C++ that peers are built from."""

from __future__ import annotations

from pathlib import Path

SOURCES = Path(__file__).parent
