"""`cxbridge why`: why a rule has not fired, how a goal came to its outcome."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cxbridge.cli.connect import DEFAULT_URL, AsJson

if TYPE_CHECKING:
    from cxbridge.explain.evidence import Evidence

_END = "end"
