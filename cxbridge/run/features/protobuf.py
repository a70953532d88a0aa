"""The feature `protobuf` of a run: messages to and from other programs."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.run.context import RunContext

SECTION = "/clips-protobuf"


def make(context: RunContext) -> Feature:
    """Make the feature."""
    from cxbridge.executive.features.protobuf import ProtobufFeature  # noqa: PLC0415
    from cxbridge.executive.protobuf.settings import ProtobufSettings  # noqa: PLC0415

    settings = ProtobufSettings.from_config(context.config, context.paths.expand)
    return ProtobufFeature(settings, context.additions.connections)
