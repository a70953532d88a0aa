"""Domains of DDS with their ranges of discovery, and workarounds for the Python package of Cyclone DDS."""

from __future__ import annotations

import os
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import Final

from cyclonedds.core import Entity
from cyclonedds.domain import Domain

from cxbridge.errors import Ros2Error

# Held around each call that returns a Qos. cyclonedds reads policies into buffers that all threads share, so
# that without the lock an endpoint gets the user data of an endpoint that another thread reads.
QOS_LOCK: Final = threading.Lock()

# Cyclone DDS' configuration of discovery for the ranges within this host. `localhost` tries the ports of the
# participant indices up to 32, as in rmw_cyclonedds. `off` finds only nodes of this process: no other process
# has the tag.
_DISCOVERY_CONFIGURATIONS: Final = {
    "localhost": "<ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
    '<Peers><Peer Address="localhost"/></Peers>',
    "off": f"<ParticipantIndex>none</ParticipantIndex><Tag>cxbridge_{os.getpid()}</Tag>",
}

# Values of ROS_AUTOMATIC_DISCOVERY_RANGE.
_REACHES: Final = (*_DISCOVERY_CONFIGURATIONS, "subnet", "system_default")


def find_security_problem() -> str:
    """Return a warning if the environment requests DDS security; otherwise an empty text.

    :raises Ros2Error: if the environment enforces DDS security.
    """
    if os.environ.get("ROS_SECURITY_ENABLE", "").lower() != "true":
        return ""
    problem = "ROS_SECURITY_ENABLE is true, but the wheel of Cyclone DDS is built without DDS security"
    if os.environ.get("ROS_SECURITY_STRATEGY") == "Enforce":
        raise Ros2Error(problem, hint="use the transport rclpy in a sourced ROS 2")
    return f"{problem}, so no data is encrypted; the transport rclpy supports security in a sourced ROS 2"


# The configured domains of this process and the counts of their nodes, by the number of the domain. A domain
# is configured by its first node with a range within this host, and closed with its last such node.
_domains: dict[int, Domain] = {}
_node_counts: Counter[int] = Counter()


def enter_domain(number: int, reach: str) -> Callable[[], None]:
    """Limit a domain to this host if the range is within this host; further nodes keep the range.

    The user's CYCLONEDDS_URI configures all domains; the range has no effect then.

    :param number: the number of the domain.
    :param reach: the range of discovery, a value of ``ROS_AUTOMATIC_DISCOVERY_RANGE`` in lower case.
    :returns: a function that leaves the domain; later calls of the function do nothing.
    :raises Ros2Error: if there is no such range.
    """
    if reach not in _REACHES:
        raise Ros2Error(f"'{reach}' is not a range of discovery", hint="write localhost or subnet")
    if os.environ.get("CYCLONEDDS_URI") or reach not in _DISCOVERY_CONFIGURATIONS:
        return lambda: None
    if number not in _domains:
        _domains[number] = Domain(number, _make_local_configuration(reach))
    _node_counts[number] += 1
    stack = ExitStack()  # runs its callback at the first close only
    stack.callback(_leave_domain, number)
    return stack.close


def _leave_domain(number: int) -> None:
    _node_counts[number] -= 1
    if not _node_counts[number]:
        delete_entity(_domains.pop(number))


def _make_local_configuration(reach: str) -> str:
    """Return the configuration of a domain within this host."""
    return (
        '<CycloneDDS><Domain Id="any"><General><AllowMulticast>false</AllowMulticast>'
        '<Interfaces><NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces></General>'
        f"<Discovery>{_DISCOVERY_CONFIGURATIONS[reach]}</Discovery></Domain></CycloneDDS>"
    )


def delete_entity(entity: Entity) -> None:
    """Delete an entity now.

    cyclonedds deletes an entity when Python drops the last reference, but not when the garbage collector
    deletes it: the collector first clears the weak references in cyclonedds' table of entities, and
    cyclonedds takes an entity that is missing in the table for deleted.
    """
    entity.__del__()


def delete_writers(writers: Sequence[Entity]) -> None:
    """Delete writers in parallel.

    Each writer waits for the acknowledgements of its readers: a tenth of a second, or a second if a reader
    was killed recently.
    """
    # threads rather than concurrent.futures, whose pools accept no work when the interpreter ends
    threads = [threading.Thread(target=delete_entity, args=(writer,)) for writer in writers]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
