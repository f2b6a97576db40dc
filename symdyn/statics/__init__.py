"""Equilibria, linearization about them or along a motion, modes, and how these change with parameters and rotor speed."""
