"""The feature `redefine-warning` of a run: warnings of constructs that replace others."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.executive.features.redefine_warning import RedefineWarningFeature
from cxbridge.run.context import RunContext


def make(context: RunContext) -> Feature:  # noqa: ARG001  it needs nothing of a run
    """Make the feature."""
    return RedefineWarningFeature()
