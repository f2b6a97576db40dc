"""What equations print, and where their entries come from."""
