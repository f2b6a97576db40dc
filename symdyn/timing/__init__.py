"""Times of compiled code, measured in loops and taken in turns."""
