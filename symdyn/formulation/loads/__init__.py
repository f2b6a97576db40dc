"""Loads on the tape, and what their expressions take from a mechanism's motion."""
