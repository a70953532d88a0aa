"""The feature `protobuf` of a run: messages to and from other programs."""

from __future__ import annotations

from cxbridge.executive.feature import Feature
from cxbridge.run.context import RunContext

SECTION = "/clips-protobuf"


def make(context: RunContext) -> Feature:
    """Make the feature."""
    from cxbridge.executive.features.protobuf import ProtobufFeature, ProtobufSettings  # noqa: PLC0415

    folder = context.paths.config_file.parent
    return ProtobufFeature(ProtobufSettings.from_config(context.config, context.paths.placeholders, folder))
