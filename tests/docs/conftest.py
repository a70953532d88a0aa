"""The manual is that of all distributions."""

from __future__ import annotations

from tests.support import WHOLE

collect_ignore_glob = [] if WHOLE else ["test_*.py"]
