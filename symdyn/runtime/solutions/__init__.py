"""A computed motion and what is made of it."""
