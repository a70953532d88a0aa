"""Compares the endpoints of other participants with those of our node: types, type hashes, QoS.

An endpoint is a reader or writer of DDS; a participant has the endpoints of one or more nodes. For a
publisher and a subscription of different types, DDS reports nothing: no message arrives, for no visible
reason. For different QoS, DDS only counts the mismatches of an endpoint.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
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
from cxbridge_ros2.transports.dds.domain import QOS_LOCK
from cxbridge_ros2.transports.dds.mismatches import describe_mismatch, describe_missing_server

if TYPE_CHECKING:
    from cyclonedds.builtin import DcpsEndpoint

# Policies by their numbers in the DDS specification.
_POLICIES: Final = {
    2: "DURABILITY", 3: "PRESENTATION", 4: "DEADLINE", 5: "LATENCY_BUDGET", 6: "OWNERSHIP", 8: "LIVELINESS",
    10: "PARTITION", 11: "RELIABILITY", 12: "DESTINATION_ORDER", 23: "DATA_REPRESENTATION",
}  # fmt: skip

# Endings of the topics of requests to an action's services, except send_goal, which stands for the action.
_OTHER_REQUEST_SUFFIXES: Final = ("/_action/get_resultRequest", "/_action/cancel_goalRequest")
_MAX_SAMPLES: Final = 1000  # limit of the samples of a read, which is repeated until no sample is left
# Limit of stored readers, and of stored writers, since other nodes decide how many exist; chosen freely.
_MAX_ENDPOINTS: Final = 20_000

_TYPE_HASH_PATTERN: Final = re.compile(rb"typehash=(RIHS01_[0-9a-f]{64});")
# rt/NAME of a topic, rq/NAMERequest and rr/NAMEReply of a service; the topics and services of an action are
# below NAME/_action/
_DDS_TOPIC_PATTERN: Final = re.compile(
    r"\Art(/.*?)(?:/_action/(?:feedback|status))?|\Ar[qr](/.*?)(?:/_action/\w+?)?(?:Request|Reply)"
)


class LocalEndpoint(Struct, frozen=True, eq=False):
    """A reader or writer of our node.

    :param topic: the name in DDS, such as ``rt/chatter``.
    :param type_name: the type on the wire: a message, a request or a response.
    :param type_hash: our hash of the type; empty if the distribution has no hashes.
    """

    entity: DataReader[Any] | DataWriter[Any]
    topic: str
    type_name: TypeName
    type_hash: str

    @property
    def is_reader(self) -> bool:
        return isinstance(self.entity, DataReader)

    @property
    def peer_term(self) -> str:
        """ROS' term for an endpoint that can match this endpoint."""
        # ROS begins the topics of messages with rt/, of requests with rq/, of responses with rr/
        if self.topic.startswith("rt/"):
            return "publisher" if self.is_reader else "subscription"
        return "client" if self.topic.startswith("rq/") == self.is_reader else "server"


class Discovery:
    """Stores the endpoints of other participants, and complains about mismatches.

    :param complain: called with the kind and the description of a problem.
    """

    def __init__(
        self,
        participant: DomainParticipant,
        complain: Callable[[str, str], None],
    ) -> None:
        self._complain = complain
        self._own_guid = participant.guid
        self._participant_reader = BuiltinDataReader(participant, BuiltinTopicDcpsParticipant)
        # the readers of endpoints, by whether the endpoints are writers
        self._endpoint_readers = {
            True: BuiltinDataReader(participant, BuiltinTopicDcpsPublication),
            False: BuiltinDataReader(participant, BuiltinTopicDcpsSubscription),
        }
        # the found endpoints by their keys, likewise by whether the endpoints are writers
        self._discovered_endpoints: dict[bool, dict[Any, DcpsEndpoint]] = {True: {}, False: {}}
        self._local_endpoints: list[LocalEndpoint] = []
        self._participant_keys: set[Any] = set()

    def add(self, local_endpoint: LocalEndpoint) -> None:
        self._local_endpoints.append(local_endpoint)
        for endpoint in self._discovered_endpoints[local_endpoint.is_reader].values():
            self._compare_types(local_endpoint, endpoint)

    def remove(self, entity: object) -> None:
        self._local_endpoints = [
            local_endpoint for local_endpoint in self._local_endpoints if local_endpoint.entity is not entity
        ]

    def update(self) -> None:
        """Read the changes since the last update, and complain about mismatches."""
        self._update_participants()
        for is_writer, reader in self._endpoint_readers.items():
            endpoints = self._discovered_endpoints[is_writer]
            for endpoint in self._take_samples(reader):
                if not _is_alive(endpoint):
                    endpoints.pop(endpoint.key, None)
                elif endpoint.participant_key != self._own_guid and len(endpoints) < _MAX_ENDPOINTS:
                    endpoints[endpoint.key] = endpoint
                    for local_endpoint in self._local_endpoints:
                        if local_endpoint.is_reader == is_writer:
                            self._compare_types(local_endpoint, endpoint)
        for local_endpoint in self._local_endpoints:
            self._check_qos(local_endpoint)

    def _update_participants(self) -> None:
        for sample in self._take_samples(self._participant_reader):
            if sample.key != self._own_guid:
                update = self._participant_keys.add if _is_alive(sample) else self._participant_keys.discard
                update(sample.key)

    @staticmethod
    def _take_samples(reader: DataReader[Any]) -> Iterator[Any]:
        while True:
            with QOS_LOCK:
                samples = reader.take(N=_MAX_SAMPLES)
            if not samples:
                return
            yield from samples

    def _compare_types(self, local_endpoint: LocalEndpoint, endpoint: DcpsEndpoint) -> None:
        if endpoint.topic_name != local_endpoint.topic:
            return
        policy = endpoint.qos[Policy.Userdata]
        match = None if policy is None else _TYPE_HASH_PATTERN.search(bytes(policy.data))
        their_hash = "" if match is None else match[1].decode()
        name = _find_ros_name(local_endpoint.topic)
        if text := describe_mismatch(
            name,
            local_endpoint.peer_term,
            endpoint.type_name,
            their_hash,
            local_endpoint.type_name,
            local_endpoint.type_hash,
        ):
            self._complain(f"type {name} {local_endpoint.peer_term}", text)

    def _check_qos(self, local_endpoint: LocalEndpoint) -> None:
        entity = local_endpoint.entity
        # ignored types: these two methods of cyclonedds have no annotations
        status = (
            entity.get_requested_incompatible_qos_status()  # type: ignore[no-untyped-call]
            if isinstance(entity, DataReader)
            else entity.get_offered_incompatible_qos_status()  # type: ignore[no-untyped-call]
        )
        if status.total_count_change:  # there are new mismatches since the last call
            policy = _POLICIES.get(status.last_policy_id, f"number {status.last_policy_id}")
            name, peer = _find_ros_name(local_endpoint.topic), local_endpoint.peer_term
            difference = (
                "offers less than ours requests"
                if local_endpoint.is_reader
                else "requests more than ours offers"
            )
            self._complain(
                f"qos {name} {peer}",
                f"{name}: another node's {peer} {difference}, so no messages arrive; "
                f"see its QoS policy {policy}",
            )

    def describe_missing_server(self, topic: str, request_type: TypeName, network: str) -> str:
        """Return why a service has no server, after an update; empty if unknown.

        :param topic: the topic of the service's requests.
        :param network: describes our part of the network.
        """
        self.update()
        served_types = {
            _find_ros_name(endpoint.topic_name): endpoint.type_name
            for endpoint in self._discovered_endpoints[False].values()
            if endpoint.topic_name.startswith("rq/")
            and not endpoint.topic_name.endswith(_OTHER_REQUEST_SUFFIXES)
        }
        return describe_missing_server(
            _find_ros_name(topic), request_type, served_types, "" if self._participant_keys else network
        )


def _is_alive(sample: Any) -> bool:
    return bool(sample.sample_info.instance_state == InstanceState.Alive)


def _find_ros_name(topic: str) -> str:
    """Return the name in ROS of the topic, service or action that has a topic in DDS.

    A topic that is not of ROS is returned unchanged.
    """
    match = _DDS_TOPIC_PATTERN.fullmatch(topic)
    return topic if match is None else match[1] or match[2]
