"""Tapes with more digits than floats have, and motions by them."""
