"""Equations by hand: from position maps or constraints that are given, as the lecture derives its first examples."""
