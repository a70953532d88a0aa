"""Domains of DDS, the range of discovery, and workarounds for the wheel of Cyclone DDS."""

from __future__ import annotations

import os
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Final

from cyclonedds.core import Entity
from cyclonedds.domain import Domain

from cxbridge.errors import Ros2Error

# Held around each call that returns a Qos of cyclonedds, which reads policies into buffers of a class.
# Without the lock, an endpoint gets the user data of another endpoint that another thread reads.
READ_QOS: Final = threading.Lock()

# Configuration of Cyclone DDS' discovery for the ranges within this host: `localhost` tries the ports of 32
# participants, `off` finds nodes of this process only, by a tag that no other process has.
_DISCOVERY: Final = {
    "localhost": "<ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
    '<Peers><Peer Address="localhost"/></Peers>',
    "off": f"<ParticipantIndex>none</ParticipantIndex><Tag>cxbridge_{os.getpid()}</Tag>",
}

# Values of ROS_AUTOMATIC_DISCOVERY_RANGE.
_RANGES: Final = (*_DISCOVERY, "subnet", "system_default")


def security_problem() -> str:
    """Return the problem if the environment requires DDS security, else an empty text.

    :raises Ros2Error: if the environment enforces security.
    """
    if os.environ.get("ROS_SECURITY_ENABLE", "").lower() != "true":
        return ""
    text = "ROS_SECURITY_ENABLE is true, but the wheel of Cyclone DDS is built without DDS security"
    if os.environ.get("ROS_SECURITY_STRATEGY") == "Enforce":
        raise Ros2Error(text, hint="take the transport rclpy, in a sourced ROS 2")
    return f"{text}: all goes unencrypted; the transport rclpy has it, in a sourced ROS 2"


_domains: dict[int, Domain] = {}
# Number of this process's nodes by domain: a domain is configured once, and closed with its last node.
_node_counts: Counter[int] = Counter()


def enter(number: int, reach: str) -> Callable[[], None]:
    """Configure a domain once per process, unless the user's CYCLONEDDS_URI does.

    :returns: the function that leaves the domain; further calls do nothing.
    """
    if reach not in _RANGES:
        raise Ros2Error(f"'{reach}' is no range of discovery", hint="write localhost or subnet")
    if os.environ.get("CYCLONEDDS_URI") or reach not in _DISCOVERY:
        return lambda: None
    if number not in _domains:
        _domains[number] = Domain(number, _local_configuration(reach))
    _node_counts[number] += 1
    is_inside = [True]  # empty after leaving; a list, since leave() changes it

    def leave() -> None:
        if is_inside:
            is_inside.clear()
            _node_counts[number] -= 1
            if not _node_counts[number]:
                delete(_domains.pop(number))

    return leave


def _local_configuration(reach: str) -> str:
    """Return the configuration of a domain within this host."""
    return (
        '<CycloneDDS><Domain Id="any"><General><AllowMulticast>false</AllowMulticast>'
        '<Interfaces><NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces></General>'
        f"<Discovery>{_DISCOVERY[reach]}</Discovery></Domain></CycloneDDS>"
    )


def delete(entity: Entity) -> None:
    """Delete an entity now.

    The wheel deletes an entity when Python drops the last reference, but not when the garbage collector does:
    the collector clears the weak references in the wheel's table first, and the wheel takes an entity outside
    of its table for deleted.
    """
    entity.__del__()


def delete_all(writers: Sequence[Entity]) -> None:
    """Delete writers in parallel.

    Each writer waits for acknowledgements of its readers: a tenth of a second, or a whole second if a reader
    was killed just now.
    """
    # plain threads: a pool of concurrent.futures takes no work at the end of the interpreter
    threads = [threading.Thread(target=delete, args=(writer,)) for writer in writers]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
