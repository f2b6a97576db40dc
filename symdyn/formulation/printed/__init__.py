"""Printed quantities of equations, and where their entries come from."""
