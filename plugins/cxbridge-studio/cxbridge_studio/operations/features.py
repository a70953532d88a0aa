"""The operation that lists the features of CLIPS; see docs/evidence/ros2cx.md."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from cxbridge.daemon.operations.operation import NoParameters, OperationContext, Operations, Route
from cxbridge.executive.manager import FeatureInfo
from cxbridge.rights import Right

OPERATIONS: Final = Operations()


@OPERATIONS.add(
    "feature-list",
    Right.LOOK,
    NoParameters,
    Route("GET", "/cxbridge/features", "Return all features of CLIPS.", list[FeatureInfo], "Feature"),
)
def _list_features(context: OperationContext, _parameters: NoParameters) -> Sequence[FeatureInfo]:
    return context.executive.manager.catalogue
