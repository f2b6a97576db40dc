"""The description of a mechanism: symbols, bodies, joints, loads; no equations yet."""
