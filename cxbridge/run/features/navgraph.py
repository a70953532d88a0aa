"""The feature `navgraph` of a run: the navigation graph that skills use, too."""

from __future__ import annotations

from functools import partial

from cxbridge.executive.feature import Feature
from cxbridge.run.context import RunContext


def make(context: RunContext) -> Feature:
    """Make the feature."""
    from cxbridge.executive.features.navgraph import NavGraphFeature  # noqa: PLC0415

    return NavGraphFeature(partial(context.navgraph.get, context.config, context.paths, context.bus))
