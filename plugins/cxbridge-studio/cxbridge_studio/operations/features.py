"""The operations on features of CLIPS: list, offer and withdraw them; docs/evidence/ros2cx.md."""

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
from cxbridge_studio.operations.environments import service_of

OPERATIONS: Final = Operations()
_PATH: Final = "/cxbridge/features"


class _Feature(Struct):
    feature: str


def _check(context: OperationContext, path: Mapping[str, str]) -> None:
    if all(info.name != path["feature"] for info in service_of(context).features()):
        raise NotFoundError(f"Feature '{path['feature']}' is unknown")


def _info(context: OperationContext, parameters: _Feature) -> FeatureInfo:
    return service_of(context).feature(parameters.feature)


def _feature_route(method: str, summary: str, refusal: str = "") -> Route[Any]:
    """Return a route for one feature.

    :param refusal: why the operation may be refused; empty if it never is.
    """
    errors = {404: "There is no such feature", **({400: refusal} if refusal else {})}
    path = f"{_PATH}/{{feature}}"
    return Route(method, path, summary, FeatureInfo, "Feature", answer=_info, check=_check, errors=errors)


@OPERATIONS.add(
    "feature-list",
    Right.LOOK,
    NoParameters,
    Route("GET", _PATH, "Return all features of CLIPS.", list[FeatureInfo], "Feature"),
)
def _list(context: OperationContext, _parameters: NoParameters) -> Sequence[FeatureInfo]:
    return service_of(context).features()


OPERATIONS.add(
    "feature-info",
    Right.LOOK,
    _Feature,
    _feature_route("GET", "Return a feature, which can be withdrawn while no environment has it."),
    is_verb=False,
)(_info)


@OPERATIONS.add(
    "feature-offer", Right.CONTROL, _Feature, _feature_route("PUT", "Offer a feature to environments again.")
)
def _offer(context: OperationContext, parameters: _Feature) -> None:
    service_of(context).offer_feature(parameters.feature)


@OPERATIONS.add(
    "feature-withdraw",
    Right.CONTROL,
    _Feature,
    _feature_route("DELETE", "Withdraw a feature from the offer.", refusal="An environment has the feature"),
)
def _withdraw(context: OperationContext, parameters: _Feature) -> None:
    service_of(context).withdraw_feature(parameters.feature)
