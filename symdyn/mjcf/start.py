"""Initial values of a System from a keyframe."""

from __future__ import annotations

from typing import Any

from symdyn.mjcf.document import START
from symdyn.mjcf.tree import Tree
from symdyn.model.record import joint_speeds
from symdyn.shown import shown
from symdyn.urdf.values import nearest


def set_start(tree: Tree, keyframe: str | None) -> None:
    """Initial values from the keyframe of a name; None: from that which `to_mjcf` writes, where there is one.

    A fault is noted where there is none of this name. Joints that are held stay where the file has them.
    """
    m, kind = tree.m, int(tree.c.mujoco.mjtObj.mjOBJ_KEY)
    names = [str(tree.c.mujoco.mj_id2name(m, kind, k) or "") for k in range(m.nkey)]
    wanted = START if keyframe is None else keyframe
    if wanted not in names:
        if keyframe is not None:
            there = f"there are {', '.join(filter(None, names))}" if any(names) else "there are none with a name"
            tree.c.faults.append(f"{tree.c.path}: keyframe is {shown(keyframe)}, which the file does not have; {there}"
                                 f"{nearest(keyframe, names)}")
        return
    k = names.index(wanted)
    result: dict[Any, float] = {}
    for j, joint in tree.joints.items():
        _, q_at, u_at = tree.c.joint(j)
        result |= zip(joint.coordinates, map(float, m.key_qpos[k][q_at:]), strict=False)
        result |= zip(joint_speeds(joint), map(float, m.key_qvel[k][u_at:]), strict=False)
    for i in range(m.nu):
        symbol = tree.commands.get(i)
        if symbol is not None:
            result[symbol] = float(m.key_ctrl[k][i])
    for i, state in tree.activations.items():
        result[state] = float(m.key_act[k][int(m.actuator_actadr[i])])
    tree.system.initial.update(result)
