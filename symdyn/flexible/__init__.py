"""Flexible beams by assumed modes: distributed tables and shape functions give the integrals of a modal body.

    tables, shapes -> Beam -> ModalBody

Numbers only, no symbols; what the equations of motion need is in the frozen ModalBody.
"""
