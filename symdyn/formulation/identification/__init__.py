"""Quantities for identification: regressors, inertial and base parameters."""
