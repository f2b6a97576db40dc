"""One file a joint: its motion, and what it needs to know."""

from symdyn.model.joints.base import Joint, JointMotion
from symdyn.model.joints.custom import Custom
from symdyn.model.joints.cylindrical import Cylindrical
from symdyn.model.joints.fixed import Fixed
from symdyn.model.joints.free import Free
from symdyn.model.joints.helical import Helical
from symdyn.model.joints.modal import Modal
from symdyn.model.joints.planar import Planar
from symdyn.model.joints.prismatic import Prismatic
from symdyn.model.joints.revolute import Revolute
from symdyn.model.joints.spherical import Spherical
from symdyn.model.joints.universal import Universal

__all__ = ["Custom", "Cylindrical", "Fixed", "Free", "Helical", "Joint", "JointMotion", "Modal", "Planar", "Prismatic",
           "Revolute", "Spherical", "Universal"]

KINDS: tuple[type[Joint], ...] = tuple(kind for kind in map(globals().get, __all__)
                                       if isinstance(kind, type) and issubclass(kind, Joint) and kind is not Joint)
