"""Backends: from a tape to source text. Each is a dialect and a folder of templates."""
