"""The plug-in's tables, described in docs/plugins.md."""

from __future__ import annotations

from cxbridge.plugins import Row, configured

API = 1

FEATURES = (Row("protobuf", "cxbridge_protobuf.feature:make_feature", early=configured("/clips-protobuf")),)
