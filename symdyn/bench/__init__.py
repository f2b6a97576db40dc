"""Measurements, as commands: `python -m symdyn.bench`. They are not tests; times depend on the machine."""
