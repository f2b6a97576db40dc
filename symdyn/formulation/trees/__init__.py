"""Trees of links: their motion, mass matrix, forces and reactions, by recursions on the tape."""
