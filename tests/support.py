"""Where the tests find what is not in the repository, and how they skip without it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
"""The checkout."""

SHARED = ROOT.parent / "shared"
"""Facts and recordings of the real Fawkes; may be absent."""

_FAWKES = os.environ.get("FAWKES_DIR", "")
FAWKES_DIR = Path(_FAWKES) if _FAWKES else None
"""A Fawkes checkout, named by the environment variable FAWKES_DIR; may be absent."""

needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="the recordings (../shared) are absent")
needs_fawkes = pytest.mark.skipif(FAWKES_DIR is None, reason="FAWKES_DIR names no Fawkes checkout")
