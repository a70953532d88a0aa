"""The names of the profile and of the metadata records of our mcap files; see docs/formats.md."""

from __future__ import annotations

PROFILE = "cxbridge"
"""The profile in the header of our files."""

METADATA = "cxbridge"
"""The name of our metadata records; later ones add to earlier ones."""

SOURCE = "cxbridge.source"
"""The name of the metadata records of what a run was made of."""
