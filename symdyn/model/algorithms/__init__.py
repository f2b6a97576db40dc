"""Numeric algorithms of elements, in files of which generated Python modules hold the text; see symdyn.tape.algorithms."""
