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
from cxbridge_ros2.transports.mismatches import mismatch, missing_server_reason

if TYPE_CHECKING:
    from cyclonedds.builtin import DcpsEndpoint

# Policies by their numbers in the DDS specification.
_POLICIES: Final = {
    2: "DURABILITY", 3: "PRESENTATION", 4: "DEADLINE", 5: "LATENCY_BUDGET", 6: "OWNERSHIP", 8: "LIVELINESS",
    10: "PARTITION", 11: "RELIABILITY", 12: "DESTINATION_ORDER", 23: "DATA_REPRESENTATION",
}  # fmt: skip

# An action has three services; send_goal stands for all of them.
_FURTHER_SERVICES: Final = ("/_action/get_resultRequest", "/_action/cancel_goalRequest")
_BATCH: Final = 1000  # samples per read
_MAX_ENDPOINTS: Final = 20_000  # limit of stored endpoints, since other nodes decide how many exist

_HASH: Final = re.compile(rb"typehash=(RIHS01_[0-9a-f]{64});")
_DDS_TOPIC: Final = re.compile(
    r"\Art(/.*?)(?:/_action/(?:feedback|status))?|\Ar[qr](/.*?)(?:/_action/\w+?)?(?:Request|Reply)"
)


class OwnEndpoint(Struct, frozen=True, eq=False):
    """A reader or writer of our node.

    :param topic: the name in DDS, such as ``rt/chatter``.
    :param type: the type on the wire: a message, a request or a response.
    :param type_hash: our hash of the type; empty if the distribution has none.
    """

    entity: DataReader[Any] | DataWriter[Any]
    topic: str
    type: TypeName
    type_hash: str

    @property
    def is_reader(self) -> bool:
        return isinstance(self.entity, DataReader)

    @property
    def peer(self) -> str:
        """ROS' name for the remote end of the endpoint."""
        if self.topic.startswith("rt/"):
            return "publisher" if self.is_reader else "subscription"
        return "client" if self.topic.startswith("rq/") == self.is_reader else "server"


class Discovery:
    """Knows the endpoints of other participants, and complains about mismatches.

    :param graph: reads the reports of other participants about their nodes.
    :param nodes_in: returns the full names in such a report.
    :param name: the full name of our node.
    :param complain: called with the kind and the description of a problem.
    """

    def __init__(
        self,
        participant: DomainParticipant,
        graph: DataReader[Any],
        nodes_in: Callable[[bytes], Iterable[str]],
        name: str,
        complain: Callable[[str, str], None],
    ) -> None:
        self._complain = complain
        self._graph, self._nodes_in, self._name = graph, nodes_in, name
        self._own_guid = participant.guid
        self._participant_reader = BuiltinDataReader(participant, BuiltinTopicDcpsParticipant)
        # True: discovered writers, the peers of our readers; False: discovered readers
        self._endpoint_readers = {
            True: BuiltinDataReader(participant, BuiltinTopicDcpsPublication),
            False: BuiltinDataReader(participant, BuiltinTopicDcpsSubscription),
        }
        self._discovered: dict[bool, dict[Any, DcpsEndpoint]] = {True: {}, False: {}}
        self._own_endpoints: list[OwnEndpoint] = []
        self._incompatible_counts: dict[int, int] = {}
        self._participants: set[Any] = set()
        self._has_namesake = False

    def add(self, endpoint: OwnEndpoint) -> None:
        self._own_endpoints.append(endpoint)
        for discovered in self._discovered[endpoint.is_reader].values():
            self._compare(endpoint, discovered)

    def remove(self, entity: object) -> None:
        self._own_endpoints = [own for own in self._own_endpoints if own.entity is not entity]
        self._incompatible_counts.pop(id(entity), None)

    def update(self) -> None:
        """Take new discoveries and complain about mismatches."""
        self._update_participants()
        for is_writer, reader in self._endpoint_readers.items():
            endpoints = self._discovered[is_writer]
            for endpoint in self._take_samples(reader):
                if not _is_alive(endpoint):
                    endpoints.pop(endpoint.key, None)
                elif endpoint.participant_key != self._own_guid and len(endpoints) < _MAX_ENDPOINTS:
                    endpoints[endpoint.key] = endpoint
                    for own in self._own_endpoints:
                        if own.is_reader == is_writer:
                            self._compare(own, endpoint)
        for own in self._own_endpoints:
            self._check_qos(own)

    def _update_participants(self) -> None:
        for sample in self._take_samples(self._participant_reader):
            if sample.key != self._own_guid:
                (self._participants.add if _is_alive(sample) else self._participants.discard)(sample.key)
        for sample in self._take_samples(self._graph):
            # a sample without data reports the end of a participant
            if hasattr(sample, "cdr") and self._name in self._nodes_in(sample.cdr):
                self._has_namesake = True
        # only services below the name are affected: those of parameters and of the lifecycle
        if self._has_namesake and any(
            own.topic.startswith(f"rq{self._name}/") for own in self._own_endpoints
        ):
            self._complain(
                "name", f"another node is called {self._name}, too: their parameters and lives mix"
            )

    @staticmethod
    def _take_samples(reader: DataReader[Any]) -> Iterator[Any]:
        while True:
            with READ_QOS:
                samples = reader.take(N=_BATCH)
            if not samples:
                return
            yield from samples

    def _compare(self, own: OwnEndpoint, endpoint: DcpsEndpoint) -> None:
        if endpoint.topic_name != own.topic:
            return
        policy = endpoint.qos[Policy.Userdata]
        match = None if policy is None else _HASH.search(bytes(policy.data))
        their_hash = "" if match is None else match[1].decode()
        name = _ros_name(own.topic)
        if text := mismatch(name, own.peer, endpoint.type_name, their_hash, own.type, own.type_hash):
            self._complain(f"type {name} {own.peer}", text)

    def _check_qos(self, own: OwnEndpoint) -> None:
        entity = own.entity
        status = (
            entity.get_requested_incompatible_qos_status()  # type: ignore[no-untyped-call]
            if isinstance(entity, DataReader)
            else entity.get_offered_incompatible_qos_status()  # type: ignore[no-untyped-call]
        )
        # the count of all mismatches so far: only a new one is a complaint
        if status.total_count > self._incompatible_counts.get(id(entity), 0):
            self._incompatible_counts[id(entity)] = status.total_count
            policy = _POLICIES.get(status.last_policy_id, f"number {status.last_policy_id}")
            differs = (
                "offers less than is wanted here" if own.is_reader else "wants more than is offered here"
            )
            name = _ros_name(own.topic)
            self._complain(
                f"qos {name} {own.peer}",
                f"{name}: a {own.peer} there {differs}, so no message goes: see its QoS policy {policy}",
            )

    def missing_server_reason(self, topic: str, request_type: TypeName, network: str) -> str:
        """Return why a service has no server; see :func:`.mismatches.missing_server_reason`.

        :param topic: the topic of requests.
        :param network: our part of the network.
        """
        self.update()
        served = {
            _ros_name(endpoint.topic_name): endpoint.type_name
            for endpoint in self._discovered[False].values()
            if endpoint.topic_name.startswith("rq/") and not endpoint.topic_name.endswith(_FURTHER_SERVICES)
        }
        return missing_server_reason(
            _ros_name(topic), request_type, served, "" if self._participants else network
        )


def _is_alive(sample: Any) -> bool:
    return bool(sample.sample_info.instance_state == InstanceState.Alive)


def _ros_name(topic: str) -> str:
    """Return ROS' name of a topic, a service or an action in DDS."""
    match = _DDS_TOPIC.fullmatch(topic)
    return topic if match is None else match[1] or match[2]
