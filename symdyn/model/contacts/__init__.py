"""Contacts: where bodies touch, by which law, and the loads, events and rows that this makes of them."""
