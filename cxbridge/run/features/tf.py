"""The feature `tf` of a run: coordinate frames."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.run.context import RunContext


def make(context: RunContext) -> Feature:
    """Make the feature."""
    from cxbridge.executive.features.tf import TfFeature  # noqa: PLC0415

    return TfFeature(context.board)
