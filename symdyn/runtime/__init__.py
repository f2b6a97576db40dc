"""Build, load and integrate the generated code; no symbolic mathematics here."""
