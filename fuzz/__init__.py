"""Fuzzing of the decoders of network data; see docs/security.md."""
