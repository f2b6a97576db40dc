"""Measurements of symdyn itself."""
