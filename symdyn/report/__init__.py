"""For people: simplified and typeset equations, and the report of what was generated."""
