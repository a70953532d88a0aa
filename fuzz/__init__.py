"""Fuzzing of what decodes bytes from the network; see docs/security.md."""
