"""Between sympy.physics.mechanics and symdyn: equations and systems that are taken over, and the way back."""
