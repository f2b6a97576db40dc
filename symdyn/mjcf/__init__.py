"""Robots from and to files in MuJoCo's format, MJCF.

    document   includes put in, files that are referred to found inside one folder, the line of every element kept
    compiled   MuJoCo's compiler: defaults, frames and inertias resolved; its messages with the file's line
    tree       bodies and joints
    forces     armature, springs, damping, gravity compensation, tendons, actuators
    closures   equality constraints as loops and constraints
    left_out   what is not taken: rejected, or reported in a warning
    pictures   geoms as shapes
    read       MJCF to System
    write      System to MJCF
"""
