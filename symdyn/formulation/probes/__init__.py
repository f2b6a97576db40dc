"""Probes in numbers that decide the structure of equations before code is made."""
