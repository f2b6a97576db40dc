"""Geoms of a compiled model as shapes of bodies."""

from __future__ import annotations

import numpy as np

from symdyn.mjcf.compiled import rotation
from symdyn.mjcf.tree import Tree
from symdyn.model.shapes import Mesh
from symdyn.urdf.meshes import Triangles, box, capsule, cylinder, decimated, ellipsoid

# Groups of geoms that MuJoCo's viewer shows.
_SHOWN = 3


def draw(tree: Tree) -> None:
    """Boxes, spheres, ellipsoids, cylinders, capsules and meshes of the groups that MuJoCo's viewer shows; planes are left
    out."""
    m = tree.m
    for g in range(m.ngeom):
        result = _triangles(tree, g)
        if result is None or m.geom_group[g] >= _SHOWN:
            continue
        rgba = m.mat_rgba[m.geom_matid[g]] if m.geom_matid[g] >= 0 else m.geom_rgba[g]
        if rgba[3] == 0:
            continue
        vertices = result[0] @ rotation(m.geom_quat[g]).T + m.geom_pos[g]
        tree.system.draw(tree.bodies[int(m.geom_bodyid[g])], Mesh(vertices, result[1]), color=[float(np.clip(v, 0, 1)) for v in
                                                                                               rgba[:3]])


def _triangles(tree: Tree, g: int) -> Triangles | None:
    m, size = tree.m, np.array(tree.m.geom_size[g])
    kind = tree.c.mujoco.mjtGeom(int(m.geom_type[g])).name.removeprefix("mjGEOM_")
    if kind == "MESH":
        k = int(m.geom_dataid[g])
        vertices = np.array(m.mesh_vert[m.mesh_vertadr[k]:m.mesh_vertadr[k] + m.mesh_vertnum[k]], dtype=float)
        return decimated(vertices, np.array(m.mesh_face[m.mesh_faceadr[k]:m.mesh_faceadr[k] + m.mesh_facenum[k]], dtype=int))
    simple = {"BOX": lambda: box(size), "SPHERE": lambda: ellipsoid(np.full(3, size[0])), "ELLIPSOID": lambda: ellipsoid(size),
              "CYLINDER": lambda: cylinder(size[0], size[1]), "CAPSULE": lambda: capsule(size[0], size[1])}
    return simple[kind]() if kind in simple else None
