"""`symdyn bench robots`: robots from files compared with Pinocchio.

    collection        the robots of the package example-robot-data
    pinocchio_robot   one of them in Pinocchio, its quantities in symdyn's order
    agreement         how far they are apart at random states
    pinocchio_aba     Pinocchio's articulated bodies in C++: time and operations
    command           the table
"""
