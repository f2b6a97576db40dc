"""Kinds of what touches: bodies, and elements of joints that follow the same rules."""

BODIES, STOP, CLUTCH, FRICTION = "bodies", "stop", "clutch", "friction"
