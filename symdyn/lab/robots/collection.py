"""The robots of the package example-robot-data that are read and compared."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from symdyn.errors import MissingExtra

_SHARED = Path("share/example-robot-data/robots")


class Listed(NamedTuple):
    """A robot: its file in the package, whether its root moves freely, and the joints that are held."""

    file: str
    floating: bool = False
    fixed: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The file's name without ending, with its folder where that says more."""
        stem = Path(self.file).stem
        return Path(self.file).parts[0].removesuffix("_description") if stem == "anymal" else stem


ARMS = (
    "panda_description/urdf/panda.urdf", "ur_description/urdf/ur3_robot.urdf", "ur_description/urdf/ur3_gripper.urdf",
    "ur_description/urdf/ur5_robot.urdf", "ur_description/urdf/ur5_gripper.urdf", "ur_description/urdf/ur10_robot.urdf",
    "kinova_description/robots/kinova.urdf", "xarm_description/urdf/xarm7.urdf", "z1_description/urdf/z1.urdf",
    "so_arm_description/urdf/so100.urdf", "so_arm_description/urdf/so101.urdf", "talos_data/robots/talos_left_arm.urdf",
    "baxter_description/urdf/baxter.urdf", "pr2_description/urdf/pr2.urdf", "tiago_pro_description/robots/tiago_pro.urdf",
)
PENDULUMS = (
    "double_pendulum_description/urdf/double_pendulum.urdf",
    "double_pendulum_description/urdf/double_pendulum_continuous.urdf",
    "double_pendulum_description/urdf/double_pendulum_simple.urdf", "asr_twodof_description/urdf/TwoDofs.urdf",
    "finger_edu_description/robots/finger_edu.urdf",
)
HANDS = ("allegro_hand_description/urdf/allegro_left_hand.urdf", "allegro_hand_description/urdf/allegro_right_hand.urdf")
FLYING = (
    "borinot_description/urdf/borinot_flying_arm_2.urdf", "hextilt_description/urdf/hextilt_flying_arm_5.urdf",
    "hector_description/robots/quadrotor_base.urdf", "iris_description/robots/iris.urdf",
)
QUADRUPEDS = (
    "a1_description/urdf/a1.urdf", "anymal_b_simple_description/robots/anymal.urdf",
    "anymal_b_simple_description/robots/anymal-kinova.urdf", "anymal_c_simple_description/urdf/anymal.urdf",
    "b1_description/urdf/b1.urdf", "b1_description/urdf/b1-z1.urdf", "go1_description/urdf/go1.urdf",
    "go2_description/urdf/go2.urdf", "hyq_description/robots/hyq_no_sensors.urdf", "laikago_description/urdf/laikago.urdf",
    "quadruped_description/urdf/quadruped.urdf", "solo_description/robots/solo.urdf", "solo_description/robots/solo12.urdf",
)
HUMANOIDS = (
    "alex_description/urdf/alex_nub_hands.urdf", "alex_description/urdf/alex_sake_hands.urdf",
    "alexander_description/urdf/alexander_v1.lowerBodyOnly.urdf", "bolt_description/robots/bolt.urdf",
    "centauro_description/urdf/centauro.urdf", "g1_description/urdf/g1_29dof_rev_1_0.urdf",
    "g1_description/urdf/g1_29dof_with_hand_rev_1_0.urdf", "human_description/robots/human.urdf",
    "icub_description/robots/icub.urdf", "icub_description/robots/icub_reduced.urdf",
    "romeo_description/urdf/romeo_small.urdf", "simple_humanoid_description/urdf/simple_humanoid.urdf",
    "simple_humanoid_description/urdf/simple_humanoid_classical.urdf",
    "talos_data/robots/talos_reduced.urdf",
)
ROBOTS: tuple[Listed, ...] = (
    *(Listed(file) for file in (*PENDULUMS, *ARMS, *HANDS)),
    *(Listed(file, True) for file in (*FLYING, *QUADRUPEDS, *HUMANOIDS)),
)


def folder() -> Path:
    """Where the package has the robots. Raises MissingExtra."""
    result = next(_folders(), None)
    if result is None:
        raise MissingExtra("the robots are not installed; run: pip install example-robot-data")
    return result


def _folders() -> Iterator[Path]:
    """The package has no module of its own: its files are in a prefix next to the modules, or in that of the system."""
    for root in (*map(Path, sys.path), Path(sys.prefix)):
        for prefix in (root / "cmeel.prefix", root):
            if (prefix / _SHARED).is_dir():
                yield prefix / _SHARED
