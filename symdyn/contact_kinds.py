"""Kinds of what touches: bodies, and elements of joints that follow the same rules."""

BODIES, STOP, CLUTCH, FRICTION = "bodies", "stop", "clutch", "friction"
TOUCHES, RELEASES = "touches", "releases"  # events of compliant contacts, after their names: steps end there
