"""Texts about endpoints that do not fit together, for all transports.

The topics and services of an action have separate types and names in the graph. The texts name the
action, as users know it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.names import TypeName

_DDS_TYPE: Final = re.compile(r"(\w+)::(msg|srv|action)::dds_::(\w+)_")
# ends of the names of types that ROS derives from a service or an action
_DERIVED: Final = re.compile(
    r"(_(SendGoal|GetResult))?_(Request|Response)$|_(SendGoal|GetResult|FeedbackMessage)$"
)
_ACTION: Final = re.compile(r"/_action/\w+$")


def public_type(name: TypeName) -> str:
    """Return a message, or the service or action from which a type is derived."""
    return str(name if name.kind == "msg" else TypeName(name.package, name.kind, _DERIVED.sub("", name.name)))


def ros_type(dds_type: str) -> str:
    """Return the ROS name of a DDS type; other names stay unchanged."""
    match = _DDS_TYPE.fullmatch(dds_type)
    return dds_type if match is None else public_type(TypeName(match[1], match[2], match[3]))


def public_name(name: str) -> str:
    """Return a topic or service, or the action to which it belongs."""
    return _ACTION.sub("", name)


def mismatch(
    name: str, peer: str, their_type: str, their_hash: str, our_type: TypeName, our_hash: str
) -> str:
    """Return how the type of another node's endpoint differs from ours; empty if the types are equal.

    :param name: the topic, service or action.
    :param peer: the kind of the other endpoint, such as ``publisher``.
    :param their_type: the DDS type of the other endpoint.
    :param their_hash: the other endpoint's hash of the type; an empty hash is unknown, as in Humble.
    """
    if their_type != our_type.dds_name:
        return (
            f"{name}: a {peer} there has the type {ros_type(their_type)}, here it is {public_type(our_type)}"
        )
    if not their_hash or not our_hash or their_hash == our_hash:
        return ""
    return (
        f"{name}: a {peer} there has another {public_type(our_type)}, with the hash {their_hash}; here it is "
        f"{our_hash}: name the folder of its package in 'packages'"
    )


def missing_server_reason(name: str, kind: TypeName, served: Mapping[str, str], alone_in: str) -> str:
    """Return why a service or an action has no server; empty if unknown.

    :param kind: the type of our client.
    :param served: services and actions of other nodes with their DDS types.
    :param alone_in: the part of the network without other nodes; empty if it has more nodes.
    """
    if alone_in:
        return f"there is no other node in {alone_in}"
    if name not in served:
        return did_you_mean(name, sorted(served))
    served_type = ros_type(served[name])
    return "" if served_type == public_type(kind) else f"it is served as {served_type}"
