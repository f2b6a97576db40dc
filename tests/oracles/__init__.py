"""Independent derivations that the tests compare with."""
