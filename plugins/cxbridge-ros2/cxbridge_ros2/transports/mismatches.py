"""Texts about mismatches of nodes, for all transports."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.names import TypeName

_DDS_TYPE: Final = re.compile(r"(\w+)::(msg|srv|action)::dds_::(\w+)_")
_PART: Final = re.compile(
    r"(_(SendGoal|GetResult))?_(Request|Response)$|_(SendGoal|GetResult|FeedbackMessage)$"
)
_ACTION: Final = re.compile(r"/_action/\w+$")


def whole_type(name: TypeName) -> str:
    """Return the type that users know: the service or action instead of its parts."""
    return str(
        TypeName(name.package, name.kind, name.name if name.kind == "msg" else _PART.sub("", name.name))
    )


def ros_type(dds_type: str) -> str:
    """Return the ROS name of a DDS type; other names stay unchanged."""
    match = _DDS_TYPE.fullmatch(dds_type)
    return dds_type if match is None else whole_type(TypeName(match[1], match[2], match[3]))


def whole_name(name: str) -> str:
    """Return the name that users know: the action instead of its topics and services."""
    return _ACTION.sub("", name)


def misfit(name: str, peer: str, theirs: tuple[str, str], ours: tuple[TypeName, str]) -> str:
    """Return the mismatch between another node's type and ours; empty if there is none.

    :param name: the topic, service or action.
    :param peer: the kind of the other endpoint, such as ``publisher``.
    :param theirs: its DDS type and hash; an empty hash is unknown.
    :param ours: our type and hash.
    """
    (dds_type, their_hash), (kind, our_hash) = theirs, ours
    if dds_type != kind.dds:
        return f"{name}: a {peer} there has the type {ros_type(dds_type)}, here it is {whole_type(kind)}"
    if not their_hash or not our_hash or their_hash == our_hash:
        return ""
    return (
        f"{name}: a {peer} there has another {whole_type(kind)}, with the hash {their_hash}; here it is "
        f"{our_hash}: name the folder of its package in 'packages'"
    )


def why_unserved(name: str, kind: TypeName, served: Mapping[str, str], alone_in: str) -> str:
    """Return why a service or an action has no server; empty if unknown.

    :param kind: the type of our client.
    :param served: services and actions of other nodes with their DDS types.
    :param alone_in: the part of the network without other nodes; empty if it has more nodes.
    """
    if alone_in:
        return f"there is no other node in {alone_in}"
    served_type = served.get(name)
    if served_type is not None:
        return "" if ros_type(served_type) == whole_type(kind) else f"it is served as {ros_type(served_type)}"
    return did_you_mean(name, sorted(served))
