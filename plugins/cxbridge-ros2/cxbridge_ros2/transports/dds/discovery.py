"""Compares discovered endpoints with our own: types, type hashes, and quality of service.

DDS itself reports no mismatch of a publisher and a subscription; simply no message arrives.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any, Final

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsParticipant,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import InstanceState, Policy
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from msgspec import Struct

from cxbridge_ros2.names import TypeName
from cxbridge_ros2.transports.dds.domain import READ_QOS
from cxbridge_ros2.transports.misfits import misfit, why_unserved

if TYPE_CHECKING:
    from cyclonedds.builtin import DcpsEndpoint

# Policies by their numbers in the DDS specification.
_POLICIES: Final = {
    2: "DURABILITY", 3: "PRESENTATION", 4: "DEADLINE", 5: "LATENCY_BUDGET", 6: "OWNERSHIP", 8: "LIVELINESS",
    10: "PARTITION", 11: "RELIABILITY", 12: "DESTINATION_ORDER", 23: "DATA_REPRESENTATION",
}  # fmt: skip

_OTHER_PARTS: Final = ("/_action/get_resultRequest", "/_action/cancel_goalRequest")
_BATCH: Final = 1000  # samples per read
_MOST: Final = 20_000  # limit of stored endpoints, since other nodes decide how many exist

_HASH: Final = re.compile(rb"typehash=(RIHS01_[0-9a-f]{64});")
_PLACE: Final = re.compile(
    r"\Art(/.*?)(?:/_action/(?:feedback|status))?|\Ar[qr](/.*?)(?:/_action/\w+?)?(?:Request|Reply)"
)


class OwnEndpoint(Struct, frozen=True, eq=False):
    """One of our readers or writers.

    :param topic: the name in DDS, such as ``rt/chatter``.
    :param sent: the type on the wire.
    :param type_hash: our hash of the type; empty if the distribution has none.
    """

    entity: DataReader[Any] | DataWriter[Any]
    topic: str
    sent: TypeName
    type_hash: str

    @property
    def is_read(self) -> bool:
        return isinstance(self.entity, DataReader)

    @property
    def peer(self) -> str:
        """ROS' name for the remote end of the endpoint."""
        if self.topic.startswith("rt/"):
            return "publisher" if self.is_read else "subscription"
        return "client" if self.topic.startswith("rq/") == self.is_read else "server"


class Discovery:
    """Knows the endpoints of other participants, and complains about mismatches.

    :param graph: reads the reports of other participants about their nodes.
    :param nodes: returns the full names in such a report.
    :param name: the full name of our node.
    :param complain: called with the kind and the description of a problem.
    """

    def __init__(
        self,
        participant: DomainParticipant,
        graph: DataReader[Any],
        nodes: Callable[[bytes], Iterable[str]],
        name: str,
        complain: Callable[[str, str], None],
    ) -> None:
        self._complain = complain
        self._graph, self._nodes, self._name = graph, nodes, name
        self._us = participant.guid
        self._participants = BuiltinDataReader(participant, BuiltinTopicDcpsParticipant)
        # Built-in readers: True for discovered writers, False for discovered readers.
        self._readers = {
            True: BuiltinDataReader(participant, BuiltinTopicDcpsPublication),
            False: BuiltinDataReader(participant, BuiltinTopicDcpsSubscription),
        }
        self._theirs: dict[bool, dict[Any, DcpsEndpoint]] = {True: {}, False: {}}
        self._ours: list[OwnEndpoint] = []
        self._incompatible: dict[int, int] = {}
        self._others: set[Any] = set()
        self._has_namesake = False

    def add(self, ours: OwnEndpoint) -> None:
        self._ours.append(ours)
        for endpoint in self._theirs[ours.is_read].values():
            self._compare(ours, endpoint)

    def remove(self, entity: object) -> None:
        self._ours = [each for each in self._ours if each.entity is not entity]
        self._incompatible.pop(id(entity), None)

    def look(self) -> None:
        """Take new discoveries and complain about mismatches."""
        self._look_at_nodes()
        for writes, reader in self._readers.items():
            known = self._theirs[writes]
            for endpoint in self._take(reader):
                if not _is_alive(endpoint):
                    known.pop(endpoint.key, None)
                elif endpoint.participant_key != self._us and len(known) < _MOST:
                    known[endpoint.key] = endpoint
                    for ours in self._ours:
                        if ours.is_read == writes:
                            self._compare(ours, endpoint)
        for ours in self._ours:
            self._look_at_qos(ours)

    def _look_at_nodes(self) -> None:
        for sample in self._take(self._participants):
            if sample.key != self._us:
                (self._others.add if _is_alive(sample) else self._others.discard)(sample.key)
        for sample in self._take(self._graph):
            if hasattr(sample, "cdr") and self._name in self._nodes(sample.cdr):
                self._has_namesake = True
        # Only services below the name are affected: those of parameters and of the lifecycle.
        if self._has_namesake and any(each.topic.startswith(f"rq{self._name}/") for each in self._ours):
            self._complain(
                "name", f"another node is called {self._name}, too: their parameters and lives mix"
            )

    @staticmethod
    def _take(reader: DataReader[Any]) -> Iterator[Any]:
        while True:
            with READ_QOS:
                samples = reader.take(N=_BATCH)
            if not samples:
                return
            yield from samples

    def _compare(self, ours: OwnEndpoint, endpoint: DcpsEndpoint) -> None:
        if endpoint.topic_name != ours.topic:
            return
        policy = endpoint.qos[Policy.Userdata]
        match = None if policy is None else _HASH.search(bytes(policy.data))
        theirs = endpoint.type_name, "" if match is None else match[1].decode()
        name = _name(ours.topic)
        if text := misfit(name, ours.peer, theirs, (ours.sent, ours.type_hash)):
            self._complain(f"type {name} {ours.peer}", text)

    def _look_at_qos(self, ours: OwnEndpoint) -> None:
        entity = ours.entity
        status = (
            entity.get_requested_incompatible_qos_status()  # type: ignore[no-untyped-call]
            if isinstance(entity, DataReader)
            else entity.get_offered_incompatible_qos_status()  # type: ignore[no-untyped-call]
        )
        count = status.total_count
        if count > self._incompatible.get(id(entity), 0):
            self._incompatible[id(entity)] = count
            policy = _POLICIES.get(status.last_policy_id, f"number {status.last_policy_id}")
            differs = "offers less than is wanted here" if ours.is_read else "wants more than is offered here"
            name = _name(ours.topic)
            self._complain(
                f"qos {name} {ours.peer}",
                f"{name}: a {ours.peer} there {differs}, so no message goes: see its QoS policy {policy}",
            )

    def why_unserved(self, topic: str, sent: TypeName, where: str) -> str:
        """Return why a service has no server; see :func:`.misfits.why_unserved`.

        :param topic: the topic of requests.
        :param where: our part of the network.
        """
        self.look()
        served = {
            _name(each.topic_name): each.type_name
            for each in self._theirs[False].values()
            if each.topic_name.startswith("rq/") and not each.topic_name.endswith(_OTHER_PARTS)
        }
        return why_unserved(_name(topic), sent, served, "" if self._others else where)


def _is_alive(sample: Any) -> bool:
    return bool(sample.sample_info.instance_state == InstanceState.Alive)


def _name(topic: str) -> str:
    """Return ROS' name of a topic, a service or an action in DDS."""
    match = _PLACE.fullmatch(topic)
    return topic if match is None else match[1] or match[2]
