"""Contacts: where bodies touch, by which law, and the loads, events and rows that this makes of them.

Users reach these names as sd.contacts: shapes, and the laws of compliant contacts.
"""

from symdyn.model.contacts.compliance import Bristles, Compliance, hertz
from symdyn.model.contacts.shapes import Bore, Box, Cam, Curve, Cylinder, Disc, Plane, Point, Sphere, Surface, Torus

__all__ = ["Bore", "Box", "Bristles", "Cam", "Compliance", "Curve", "Cylinder", "Disc", "Plane", "Point", "Sphere", "Surface",
           "Torus", "hertz"]
