"""The operations on features of CLIPS: list, offer and withdraw them; see docs/evidence/ros2cx.md."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from msgspec import Struct

from cxbridge.daemon.operations.operation import (
    NoParameters,
    NotFoundError,
    OperationContext,
    Operations,
    Route,
)
from cxbridge.executive.manager import FeatureInfo
from cxbridge.rights import Right

OPERATIONS: Final = Operations()
_PATH: Final = "/cxbridge/features"


class _Feature(Struct):
    feature: str


def _check_feature_exists(context: OperationContext, path: Mapping[str, str]) -> None:
    """Check the name of the feature in a path.

    :raises NotFoundError: if there is no such feature.
    """
    if all(info.name != path["feature"] for info in context.executive.manager.catalogue):
        raise NotFoundError(f"Feature '{path['feature']}' is unknown")


def _describe_feature(context: OperationContext, parameters: _Feature) -> FeatureInfo:
    return next(info for info in context.executive.manager.catalogue if info.name == parameters.feature)


def _make_feature_route(method: str, summary: str, refusal: str = "") -> Route[Any]:
    """Return a route for one feature.

    :param refusal: the meaning of status 400; empty if the operation never has that status.
    """
    errors = {404: "There is no such feature", **({400: refusal} if refusal else {})}
    path = f"{_PATH}/{{feature}}"
    return Route(
        method,
        path,
        summary,
        FeatureInfo,
        "Feature",
        answer=_describe_feature,
        check=_check_feature_exists,
        errors=errors,
    )


@OPERATIONS.add(
    "feature-list",
    Right.LOOK,
    NoParameters,
    Route("GET", _PATH, "Return all features of CLIPS.", list[FeatureInfo], "Feature"),
)
def _list_features(context: OperationContext, _parameters: NoParameters) -> Sequence[FeatureInfo]:
    return context.executive.manager.catalogue


OPERATIONS.add(
    "feature-info",
    Right.LOOK,
    _Feature,
    _make_feature_route("GET", "Return a feature, which can be withdrawn while no environment has it."),
    is_verb=False,
)(_describe_feature)


@OPERATIONS.add(
    "feature-offer",
    Right.CONTROL,
    _Feature,
    _make_feature_route("PUT", "Offer a feature to environments again."),
)
def _offer_feature(context: OperationContext, parameters: _Feature) -> None:
    context.executive.manager.offer(parameters.feature)


@OPERATIONS.add(
    "feature-withdraw",
    Right.CONTROL,
    _Feature,
    _make_feature_route(
        "DELETE", "Withdraw a feature from the offer.", refusal="An environment has the feature"
    ),
)
def _withdraw_feature(context: OperationContext, parameters: _Feature) -> None:
    context.executive.manager.withdraw(parameters.feature)
