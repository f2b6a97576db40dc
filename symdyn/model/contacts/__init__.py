"""Contacts: where bodies touch, by which law, and the loads, events and rows that this makes of them.

What users call as sd.contacts: shapes, and what a compliant contact yields by.
"""

from symdyn.model.contacts.compliance import Bristles, Compliance, hertz
from symdyn.model.contacts.shapes import Bore, Box, Curve, Cylinder, Disc, Plane, Point, Sphere, Surface, Torus

__all__ = ["Bore", "Box", "Bristles", "Compliance", "Curve", "Cylinder", "Disc", "Plane", "Point", "Sphere", "Surface", "Torus",
           "hertz"]
