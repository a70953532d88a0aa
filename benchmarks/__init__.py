"""Benchmarks. They use helpers of the tests, those of the plug-ins too, as pytest does (pyproject.toml)."""

import sys
from pathlib import Path

sys.path += map(str, Path(__file__).parent.parent.glob("plugins/*/tests"))
