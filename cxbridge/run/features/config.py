"""The feature `config` of a run: configuration values as facts."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.executive.features.config import ConfigFeature
from cxbridge.run.context import RunContext


def make(context: RunContext) -> Feature:
    """Make the feature."""
    return ConfigFeature(context.config)
