"""Robots from files in SDFormat."""
