"""Domains of DDS: which one the environment names, and how far discovery goes in it."""

from __future__ import annotations

import os
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Final

from cyclonedds.core import Entity
from cyclonedds.domain import Domain

from cxbridge.errors import Ros2Error

READ_QOS: Final = threading.Lock()
"""Hold it around each call that returns a Qos of cyclonedds, which reads policies into buffers of a class.

Without the lock, an endpoint gets the user data of another endpoint that another thread reads.
"""

_DISCOVERY: Final = {
    "localhost": "<ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
    '<Peers><Peer Address="localhost"/></Peers>',
    "off": f"<ParticipantIndex>none</ParticipantIndex><Tag>cxbridge_{os.getpid()}</Tag>",
}
"""The configuration of Cyclone DDS' discovery, by the ranges that stay on this host."""

_RANGES: Final = (*_DISCOVERY, "subnet", "system_default")
"""The values of ROS_AUTOMATIC_DISCOVERY_RANGE."""


def lacks_security() -> str:
    """Return the problem when the environment demands DDS security; empty when it does not.

    :raises Ros2Error: when it must not go without.
    """
    if os.environ.get("ROS_SECURITY_ENABLE", "").lower() != "true":
        return ""
    text = "ROS_SECURITY_ENABLE is true, but the wheel of Cyclone DDS is built without DDS security"
    if os.environ.get("ROS_SECURITY_STRATEGY") == "Enforce":
        raise Ros2Error(text, hint="take the transport rclpy, in a sourced ROS 2")
    return f"{text}: all goes unencrypted; the transport rclpy has it, in a sourced ROS 2"


_domains: dict[int, Domain] = {}
_nodes: Counter[int] = Counter()
"""How many nodes of this process are in each: a domain is configured once, and ends with its last node."""


def enter(number: int, reach: str) -> Callable[[], None]:
    """Configure a domain, once in a process; not when the user's CYCLONEDDS_URI does it.

    :returns: leaves it; only the first call does.
    """
    if reach not in _RANGES:
        raise Ros2Error(f"'{reach}' is no range of discovery", hint="write localhost or subnet")
    if os.environ.get("CYCLONEDDS_URI") or reach not in _DISCOVERY:
        return lambda: None
    if number not in _domains:
        _domains[number] = Domain(number, _on_this_host(reach))
    _nodes[number] += 1
    is_inside = [True]

    def leave() -> None:
        if is_inside:
            is_inside.clear()
            _nodes[number] -= 1
            if not _nodes[number]:
                delete(_domains.pop(number))

    return leave


def _on_this_host(reach: str) -> str:
    """Return the configuration of a domain that stays on this host."""
    return (
        '<CycloneDDS><Domain Id="any"><General><AllowMulticast>false</AllowMulticast>'
        '<Interfaces><NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces></General>'
        f"<Discovery>{_DISCOVERY[reach]}</Discovery></Domain></CycloneDDS>"
    )


def delete(entity: Entity) -> None:
    """End an entity now.

    The wheel ends it when Python drops the last reference, but not when the garbage collector does: its table
    of entities refers to them weakly, and the collector clears such references first; the wheel takes an
    entity that is not in its table for ended.
    """
    entity.__del__()


def delete_all(writers: Sequence[Entity]) -> None:
    """End writers at the same time.

    Each writer waits until its readers have acknowledged its messages: for a tenth of a second, and for a
    whole second when a reader was killed a moment ago.
    """
    threads = [threading.Thread(target=delete, args=(writer,)) for writer in writers[1:]]
    for thread in threads:
        thread.start()
    for writer in writers[:1]:
        delete(writer)
    for thread in threads:
        thread.join()
