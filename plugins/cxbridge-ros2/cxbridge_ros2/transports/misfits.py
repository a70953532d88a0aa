"""The words for nodes that do not fit together, whatever the transport."""

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
    """Return the type that users know: that of the service or action for its parts."""
    return str(
        TypeName(name.package, name.kind, name.name if name.kind == "msg" else _PART.sub("", name.name))
    )


def ros_type(dds_type: str) -> str:
    """Return what users call a type by its name in DDS; other names stay."""
    found = _DDS_TYPE.fullmatch(dds_type)
    return dds_type if found is None else whole_type(TypeName(found[1], found[2], found[3]))


def whole_name(name: str) -> str:
    """Return the name that users know: that of the action for its topics and services."""
    return _ACTION.sub("", name)


def misfit(name: str, peer: str, theirs: tuple[str, str], ours: tuple[TypeName, str]) -> str:
    """Return how another node's type differs from ours; empty when it does not.

    :param name: of the topic, service or action.
    :param peer: the kind of the other endpoint, e.g. ``publisher``.
    :param theirs: its type as in DDS, and the hash of it; empty: unknown.
    :param ours: our type, and its hash.
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
    """Return why a service or an action has no server, as far as known; empty when unknown.

    :param kind: the type of our client.
    :param served: the services and actions of other nodes, each with its type as in DDS.
    :param alone_in: the part of the network we are alone in; empty: we are not.
    """
    if alone_in:
        return f"there is no other node in {alone_in}"
    found = served.get(name)
    if found is not None:
        return "" if ros_type(found) == whole_type(kind) else f"it is served as {ros_type(found)}"
    return did_you_mean(name, sorted(served))
