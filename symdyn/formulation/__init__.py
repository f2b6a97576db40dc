"""Formulations: from the checked model to equations of motion on the tape."""
