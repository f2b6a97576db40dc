"""Descriptions of mechanisms as data files: TOML, with expressions that are read by a parser of their own and never run."""
