"""Vectors in three dimensions and spatial (six-component) vectors, for tape nodes and floats alike."""
