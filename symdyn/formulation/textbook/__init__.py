"""The recursions of the lecture as it writes them, in spatial vectors, on nodes of a tape and on numbers alike.

They read like the page and keep every intermediate; generated code is made from the lean versions of newton_euler,
composite and articulated, which these are an independent check of: they take each link's own inertia, and their velocity
products come from differentiating S.
"""
