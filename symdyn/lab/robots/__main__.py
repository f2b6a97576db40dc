"""python -m symdyn.lab.robots FOLDER-OR-FILE ... [--folder FOLDER] [--states N]"""

from __future__ import annotations

import argparse
import sys

from symdyn.lab.robots.mujoco_sweep import STATES, run

parser = argparse.ArgumentParser(prog="python -m symdyn.lab.robots", description="Compare models in MJCF with MuJoCo.")
parser.add_argument("paths", nargs="+", metavar="FOLDER-OR-FILE")
parser.add_argument("--folder", help="that holds the files of all models; default: each model's own")
parser.add_argument("--states", type=int, default=STATES)
given = parser.parse_args()
sys.exit(bool(run(given.paths, given.folder, given.states)))
