"""Analytical mechanics of derived equations in symbols: energies, momenta, conserved quantities, linear equations, equilibria."""
