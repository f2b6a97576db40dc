"""Robots from and to files in the Unified Robot Description Format.

    document   XML text to elements that know their lines; entities and external references are rejected
    values     the numbers and names that stand in attributes
    robot      links and joints as the file has them: records, no symbols
    parse      elements to a Robot, every fault of the file reported
    checks     what makes a Robot a tree; inertias: what makes it move
    angles     rotation matrices of roll, pitch and yaw, and back
    parameters symbols for what is not to be a number
    read       Robot to System
    write      System to text
"""
