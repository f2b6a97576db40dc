"""Many states and many motions at once."""
