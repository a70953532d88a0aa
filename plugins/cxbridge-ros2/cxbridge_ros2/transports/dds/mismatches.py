"""Texts about endpoints of ROS nodes that do not fit together.

An endpoint is a publisher, a subscription, a server or a client. In discovery, the topics and services of an
action have separate names and types; the texts name the action and its type.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.names import TypeName

_DDS_TYPE: Final = re.compile(r"(\w+)::(msg|srv|action)::dds_::(\w+)_")


def format_dds_type(dds_type: str) -> str:
    """Return the ROS name of the message, service or action that defines a DDS type.

    A name that does not have the form of ROS types, ``PACKAGE::KIND::dds_::NAME_``, stays unchanged.
    """
    match = _DDS_TYPE.fullmatch(dds_type)
    return dds_type if match is None else str(TypeName(match[1], match[2], match[3]).definition)


def describe_mismatch(
    name: str, peer: str, their_type: str, their_hash: str, our_type: TypeName, our_hash: str
) -> str:
    """Return how the types of two endpoints of a topic or service differ; empty without a known difference.

    :param name: the topic, service or action.
    :param peer: the kind of the other node's endpoint, such as ``publisher``.
    :param their_type: the DDS type of the other node's endpoint.
    :param their_hash: the type hash of that endpoint; empty if unknown, since Humble has no hashes.
    :param our_hash: the type hash of our endpoint; may be empty.
    """
    our_name = our_type.definition
    if their_type != our_type.dds_name:
        return (
            f"{name}: another node's {peer} has the type {format_dds_type(their_type)}, ours has {our_name}"
        )
    if not their_hash or not our_hash or their_hash == our_hash:
        return ""
    return (
        f"{name}: the definition of {our_name} at another node's {peer} differs from ours: it has the hash "
        f"{their_hash}, ours has {our_hash}; name the folder of its package in 'packages'"
    )


def describe_missing_server(
    name: str, client_type: TypeName, served_types: Mapping[str, str], network_if_empty: str
) -> str:
    """Return why a service or an action has no server; empty if unknown.

    :param client_type: the type of our client.
    :param served_types: the DDS types of the services and actions of other nodes, by name.
    :param network_if_empty: describes our part of the network if there is no other node; otherwise empty.
    """
    if network_if_empty:
        return f"there is no other node in {network_if_empty}"
    if name not in served_types:
        return did_you_mean(name, sorted(served_types))
    served_type = format_dds_type(served_types[name])
    return "" if served_type == str(client_type.definition) else f"it is served as {served_type}"
