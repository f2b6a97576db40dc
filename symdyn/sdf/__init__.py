"""Robots from files in SDFormat.

    values   numbers, names and poses that stand in elements
    frames   the frames of a model, implicit ones included, resolved into poses
    model    links and joints as a file has them, every fault with its line
    read     SDF to System
"""
