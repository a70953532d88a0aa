"""The feature `pddl-parser` of a run: PDDL domains as facts."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.run.context import RunContext


def make(context: RunContext) -> Feature:
    """Make the feature."""
    return context.pddl_parser
