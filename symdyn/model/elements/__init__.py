"""Loads that follow from the pose and motion of one body; one file a kind."""

from symdyn.model.elements.added_mass import AddedMass
from symdyn.model.elements.base import Element
from symdyn.model.elements.buoyancy import Box, Buoyancy
from symdyn.model.elements.linear import LinearDamping, LinearStiffness
from symdyn.model.elements.mooring import MooringLine
from symdyn.model.elements.site import Action, Site, Validity
from symdyn.model.elements.waves import WaveExcitation
from symdyn.model.elements.wind import Drag, Thrust

__all__ = ["Action", "AddedMass", "Box", "Buoyancy", "Drag", "Element", "LinearDamping", "LinearStiffness",
           "MooringLine", "Site", "Thrust", "Validity", "WaveExcitation"]

KINDS: tuple[type[Element | AddedMass], ...] = tuple(
    kind for kind in map(globals().get, __all__)
    if isinstance(kind, type) and issubclass(kind, (Element, AddedMass)) and kind is not Element)
