"""Elements of a model that are not supported: some are rejected, the rest reported in one warning."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np

from symdyn.mjcf.compiled import Compiled
from symdyn.urdf.values import nearest

# Kinds that are reported, whose names stand for all of a kind in leave_out.
KINDS = ("contacts", "limits", "friction", "ranges", "inactive", "mocap")
_SHOWN = 4


class LeftOut:
    """Elements and kinds that the call leaves out, and the report of those that it does not name.

    patterns   names of elements, or KINDS, with * and ?
    """

    def __init__(self, model: Compiled, patterns: Sequence[str]) -> None:
        self.c, self.patterns = model, patterns
        self.used: set[str] = set()
        self.seen: dict[str, None] = dict.fromkeys(KINDS)
        self.found: dict[str, list[str]] = {}

    def rejected(self, kind: str, number: int, text: str) -> None:
        """Something that is not built, a fault unless the call leaves out the element."""
        if not self.named(self.c.name(kind, number)):
            self.c.fault(kind, number, f"{text}, which is not built; pass leave_out={self.c.name(kind, number)!r} to do "
                                       "without it")

    def named(self, name: str) -> bool:
        """Whether the call leaves out an element or a kind."""
        self.seen[name] = None
        fitting = [p for p in self.patterns if fnmatchcase(name, p)]
        self.used.update(fitting)
        return bool(fitting)

    def reported(self, kind: str, what: str, element: str, number: int) -> None:
        """Something of a kind that is not looked at; what: for the report."""
        if not self.named(kind) and not self.named(self.c.name(element, number)):
            self.found.setdefault(what, []).append(f"{self.c.name(element, number)!r} ({self.c.where(element, number)})")

    def report(self) -> str:
        """All that is left out without the call's word, "" for nothing."""
        parts = []
        for what, listed in self.found.items():
            more = f" and {len(listed) - _SHOWN} more" if len(listed) > _SHOWN else ""
            parts.append(f"{what} of {', '.join(listed[:_SHOWN])}{more}")
        return "; ".join(parts)

    def faults(self) -> list[str]:
        """Patterns that fit nothing."""
        return [f"{self.c.path}: leave_out has {p!r}, which fits no element that could be left out{nearest(p, self.seen)} "
                "(kinds: "
                f"{', '.join(KINDS)})" for p in self.patterns if p not in self.used]


def examine(c: Compiled, out: LeftOut) -> None:
    """Note what has no place in a System, and reject what would make its motion another one."""
    m = c.m
    if (m.opt.density or m.opt.viscosity) and not out.named("fluid"):
        c.faults.append(f"{c.path}: the model moves in a fluid (density {m.opt.density:g} kg/m^3, viscosity "
                        f"{m.opt.viscosity:g} Pa s), "
                        "which is not built; pass leave_out='fluid' to do without it, and add sd.LinearDamping, sd.Buoyancy or "
                        "sd.AddedMass")
    if m.nflex:
        c.faults.append(f"{c.path}: the model has {m.nflex} deformable bodies (flex), which are not built; leave them out of "
                        "the file, and describe beams with system.add_flexible_body")
    if m.nplugin:
        c.faults.append(f"{c.path}: the model has plugins, whose forces are not known; leave them out of the file")
    touching = [g for g in range(m.ngeom) if m.geom_contype[g] or m.geom_conaffinity[g]]
    if len(touching) > 1 and len({int(m.body_weldid[int(m.geom_bodyid[g])]) for g in touching}) > 1:
        for g in touching:
            out.reported("contacts", "contacts", "geom", g)
    for pair in range(m.npair):
        for g in (int(m.pair_geom1[pair]), int(m.pair_geom2[pair])):
            if g not in touching:
                out.reported("contacts", "contacts", "geom", g)
    for j in range(m.njnt):
        _, _, dof = c.joint(j)
        if m.jnt_limited[j]:
            out.reported("limits", "limits", "joint", j)
        if m.dof_frictionloss[dof]:
            out.reported("friction", "frictionloss", "joint", j)
        if m.jnt_actfrclimited[j]:
            out.reported("ranges", "actuatorfrcrange", "joint", j)
        if m.jnt_springyield[j]:
            out.rejected("joint", j, "has a plastic spring (springyield)")
    for k in range(m.ntendon):
        if m.tendon_limited[k]:
            out.reported("limits", "limits", "tendon", k)
        if m.tendon_frictionloss[k]:
            out.reported("friction", "frictionloss", "tendon", k)
        if m.tendon_springyield[k]:
            out.rejected("tendon", k, "has a plastic spring (springyield)")
    for i in range(m.nu):
        if np.any(m.actuator_forcelimited[i]) or m.actuator_actlimited[i]:
            out.reported("ranges", "forcerange and actrange", "actuator", i)
        adr = int(m.actuator_ctrladr[i])
        if m.actuator_ctrlnum[i] and m.actuator_ctrllimited[adr]:
            out.reported("ranges", "ctrlrange", "actuator", i)
    for b in range(1, m.nbody):
        if m.body_mocapid[b] >= 0:
            out.reported("mocap", "motion capture (it stands where the file has it)", "body", b)
