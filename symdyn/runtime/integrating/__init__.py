"""Integration: the compiled methods and SciPy's, events, projection, why runs stop."""
