"""The feature `tf` of a run: coordinate frames."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.executive.features.tf import TfFeature
from cxbridge.run.context import RunContext


def make(context: RunContext) -> Feature:
    """Make the feature."""
    return TfFeature(context.board)
