"""Inputs over time: numbers, tables, functions, sampled controllers, motions."""
