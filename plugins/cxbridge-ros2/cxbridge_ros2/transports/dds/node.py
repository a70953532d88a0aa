"""ROS 2 over DDS, by the wheel of Eclipse Cyclone DDS: no ROS installation is needed.

Topics go to nodes of every RMW. Services and actions go to those of rmw_cyclonedds (:mod:`.dds_services`);
rmw_fastrtps keeps the client's id in a field that this wheel cannot write.
:mod:`cxbridge_ros2.messages` writes and reads CDR; DDS gets bytes.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from cyclonedds.core import (
    DDSException,
    Entity,
    GuardCondition,
    InstanceState,
    Policy,
    Qos,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import make_idl_struct
from cyclonedds.idl.types import uint8
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import Ros2Error
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.messages import Codec
from cxbridge_ros2.names import TypeName, parse_type
from cxbridge_ros2.node import AnswerLater, Client, Domain, Node, Publisher, Receive, Report
from cxbridge_ros2.qos import PROFILES, QosProfile
from cxbridge_ros2.topics import check_topic
from cxbridge_ros2.transports.dds.discovery import Discovery, Ours
from cxbridge_ros2.transports.dds.domain import delete, delete_all, enter, lacks_security
from cxbridge_ros2.transports.dds.services import DdsClient, DdsServer, matched, named
from cxbridge_ros2.transports.environment import MOST_DDS_DOMAIN, default_reach, domain_id

_BATCH: Final = 256
_LOOK_S: Final = 1.0
"""Seconds between two looks at discovered endpoints."""

_DISCOVERY_S: Final = 0.01
"""Between two looks whether the reader of a response is found."""
_NANOSECONDS: Final = 1000
_GRAPH: Final = parse_type("rmw_dds_common/msg/ParticipantEntitiesInfo")
_REPORTS: Final = QosProfile(durability="transient_local", depth=1000)
_GID: Final = parse_type("rmw_dds_common/msg/Gid")
_ENCLAVE: Final = b"enclave=/;"
"""The user data of a node's participant; ROS ignores a participant without it."""

_RESOURCE_WAIT: Final = duration(milliseconds=100)


@dataclass(frozen=True, slots=True)
class _Reader:
    """A reader that has not ended."""

    entity: DataReader[Any]
    condition: ReadCondition
    take: Callable[[Any], None]


class DdsNode(Node):
    """A node of ROS 2 on DDS.

    :param name: the node's, e.g. ``cxbridge``.
    :param definitions: the types that are known.
    :param domain: the DDS domain; that of ``ROS_DOMAIN_ID`` by default.
    :param reach: ``localhost``: nodes on this host are found, and find us; ``subnet``: those of the network,
        too; that of ``ROS_AUTOMATIC_DISCOVERY_RANGE`` by default, and ``localhost`` when that is not set.
    :param report: gets complaints about other nodes; see the base class.
    :raises Ros2Error: when DDS cannot begin.
    """

    def __init__(
        self,
        name: str,
        definitions: Definitions,
        domain: int | None = None,
        reach: str | None = None,
        report: Report | None = None,
    ) -> None:
        super().__init__(report)
        self.name = name
        self._definitions = definitions
        self._codec = Codec(definitions)
        self._number = number = domain_id(MOST_DDS_DOMAIN) if domain is None else domain
        self._reach = reach or default_reach()
        if lack := lacks_security():
            self.complain("security", lack)
        self._leave_domain = enter(number, self._reach)
        try:
            self._participant = DomainParticipant(number, qos=Qos(Policy.Userdata(_ENCLAVE)))
        except DDSException as error:
            self._leave_domain()
            raise Ros2Error(
                f"DDS cannot begin in domain {number}: {error}",
                hint="check ROS_DOMAIN_ID, CYCLONEDDS_URI, and that UDP ports are free",
            ) from None
        self._waits = WaitSet(self._participant)
        self._never = GuardCondition(self._participant)
        self._waits.attach(self._never)  # a set of nothing does not wait
        self._types: dict[str, Any] = {}
        self._readers: dict[int, _Reader] = {}
        self._writers: list[DataWriter[Any]] = []
        self._servers: list[DdsServer] = []
        self._numbers = 0
        self._graph, graph = self._make_graph()
        self._discovery = Discovery(self._participant, graph, self._nodes_in, f"/{name}", self.complain)
        self._looked_s = 0.0
        self._announce()

    # --- the interface of a node --------------------------------------------------------------------------

    def publisher(self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]) -> Publisher:
        """Return a publisher; see the base class."""
        name = parse_type(message_type)
        writer = self._writer(f"rt{check_topic(topic)}", name, qos)
        return _DdsPublisher(writer, partial(self._codec.encode, name), partial(self._end_writer, writer))

    def _subscribe(
        self, topic: str, message_type: str, receive: Receive, qos: QosProfile
    ) -> Callable[[], None]:
        """Call ``receive`` for each message of a topic; see the base class."""
        name = parse_type(message_type)

        def take(sample: Any) -> None:
            message = self._intact(topic, partial(self._codec.decode, name, sample.cdr))
            if message is not None:
                receive(message)

        return self._reader(f"rt{check_topic(topic)}", name, qos, take)[1]

    def client(self, service: str, service_type: str) -> Client:
        """Return a client of a service; see the base class."""
        name, whose = parse_type(service_type, "srv"), named("clientid")
        request, response = name.derived("Request"), name.derived("Response")
        place, qos = check_topic(service), PROFILES["services_default"]
        writer = self._writer(f"rq{place}Request", request, qos, whose)
        made = DdsClient(
            writer,
            partial(_write, writer),
            partial(self._codec.encode, request),
            lambda data: self._intact(service, partial(self._codec.decode, response, data)),
            lambda: self._discovery.why_unserved(f"rq{place}Request", request, self._where),
        )
        reader, end = self._reader(f"rr{place}Reply", response, qos, made.take, whose)

        def end_both() -> None:
            end()
            self._end_writer(writer)

        made.receive_from(reader, end_both)
        return made

    def _serve_later(self, service: str, service_type: str, answer: AnswerLater) -> Callable[[], None]:
        """Answer the requests of a service when there is an answer; see the base class."""
        name, whose = parse_type(service_type, "srv"), named("serviceid")
        request, response = name.derived("Request"), name.derived("Response")
        place, qos = check_topic(service), PROFILES["services_default"]
        writer = self._writer(f"rr{place}Reply", response, qos, whose)
        made = DdsServer(
            writer,
            partial(_write, writer),
            partial(self._codec.encode, response),
            lambda data: self._intact(service, partial(self._codec.decode, request, data)),
            answer,
        )
        reader, end = self._reader(f"rq{place}Request", request, qos, made.take, whose)
        made.receive_from(reader)
        self._servers.append(made)

        def end_both() -> None:
            if made in self._servers:
                self._servers.remove(made)
                made.close()
                end()
                self._end_writer(writer)

        return end_both

    def poll(self, timeout_s: float = 0.0) -> bool:
        """Hand out all that has come; see the base class."""
        waiting = [server for server in self._servers if server.send()]
        if timeout_s > 0:
            wait_s = min(timeout_s, _DISCOVERY_S) if waiting else timeout_s
            self._waits.wait(int(wait_s * MICROSECONDS) * _NANOSECONDS)
        now_s = time.monotonic()
        if now_s - self._looked_s > _LOOK_S:
            self._looked_s = now_s
            self._discovery.look()
        any_came = False
        for number in list(self._readers):
            reader = self._readers.get(number)
            for sample in () if reader is None else reader.entity.take(N=_BATCH):
                if reader is not None and hasattr(sample, "cdr"):
                    any_came = True
                    reader.take(sample)
        return any_came

    def close(self) -> None:
        """Leave the network."""
        for server in self._servers:
            server.close()
        while self._readers:  # not announced one by one: DDS tells that all is gone
            _, reader = self._readers.popitem()
            self._waits.detach(reader.condition)
            delete(reader.condition)
            delete(reader.entity)
        delete_all((*self._writers, self._graph))
        for entity in (self._waits, self._never, self._participant):
            delete(entity)
        self._leave_domain()

    # --- DDS ----------------------------------------------------------------------------------------------

    def _topic(self, topic: str, name: TypeName) -> Topic[Any]:
        known = self._types.get(name.dds)
        if known is None:
            self._definitions.fields(name)
            known = self._types[name.dds] = _dds_type(name)
        try:  # without QoS: those of writers and readers count, and one topic has several of them
            return Topic(self._participant, topic, known)
        except DDSException as error:
            raise Ros2Error(f"DDS does not take {topic} as {name}: {error}") from None

    def _writer(self, topic: str, name: TypeName, profile: QosProfile, whose: str = "") -> DataWriter[Any]:
        qos = self._qos(name, profile, whose)
        made: DataWriter[Any] = DataWriter(self._participant, self._topic(topic, name), qos=qos)
        self._writers.append(made)
        self._discovery.add(Ours(made, topic, name, self._hash(name)))
        self._announce()
        return made

    def _reader(
        self,
        topic: str,
        name: TypeName,
        profile: QosProfile,
        take: Callable[[Any], None],
        whose: str = "",
    ) -> tuple[DataReader[Any], Callable[[], None]]:
        qos = self._qos(name, profile, whose)
        reader: DataReader[Any] = DataReader(self._participant, self._topic(topic, name), qos=qos)
        condition = ReadCondition(reader, SampleState.NotRead | ViewState.Any | InstanceState.Any)
        self._waits.attach(condition)
        self._numbers += 1
        number = self._numbers
        self._readers[number] = _Reader(reader, condition, take)
        self._discovery.add(Ours(reader, topic, name, self._hash(name)))
        self._announce()
        return reader, lambda: self._end(number)

    def _end(self, number: int) -> None:
        reader = self._readers.pop(number, None)
        if reader is not None:
            self._waits.detach(reader.condition)
            self._discovery.remove(reader.entity)
            delete(reader.condition)
            delete(reader.entity)
            self._announce()

    def _end_writer(self, writer: DataWriter[Any]) -> None:
        if writer in self._writers:
            self._writers.remove(writer)
            self._discovery.remove(writer)
            delete(writer)
            self._announce()

    @property
    def _where(self) -> str:
        """The part of the network we are in."""
        host = " on this host (reach: subnet goes beyond)" if self._reach == "localhost" else ""
        return f"the domain {self._number}{host}"

    def _hash(self, name: TypeName) -> str:
        return self._definitions.type_hash(name) if self._definitions.has_hashes else ""

    # --- the graph of ROS -----------------------------------------------------------------------------------

    def _make_graph(self) -> tuple[DataWriter[Any], DataReader[Any]]:
        """Return the writer that reports our node, and the reader of the reports of other participants."""
        topic = self._topic("ros_discovery_info", _GRAPH)
        writer = DataWriter(self._participant, topic, qos=self._qos(_GRAPH, PROFILES["latched"]))
        qos = Qos(Policy.IgnoreLocal.Participant, base=self._qos(_GRAPH, _REPORTS))
        return writer, DataReader(self._participant, topic, qos=qos)

    def _nodes_in(self, report: bytes) -> Iterable[str]:
        """Return the full names of the nodes that a participant reports."""
        message = self._intact("ros_discovery_info", partial(self._codec.decode, _GRAPH, report))
        nodes = () if message is None else message["node_entities_info_seq"]
        return [f"{each['node_namespace'].rstrip('/')}/{each['node_name']}" for each in nodes]

    def _announce(self) -> None:
        """Report which readers and writers belong to this node: so the node is in the graph of ROS."""
        ((_, (_, (_, size))),) = self._definitions.fields(_GID)  # 24 bytes until Humble, 16 now

        def gid(entity: Entity) -> Mapping[str, Any]:
            return {"data": entity.guid.bytes.ljust(size, b"\0")}

        node = {
            "node_namespace": "/",
            "node_name": self.name,
            "reader_gid_seq": [gid(reader.entity) for reader in self._readers.values()],
            "writer_gid_seq": [gid(each) for each in self._writers],
        }
        message = {"gid": gid(self._participant), "node_entities_info_seq": [node]}
        _write(self._graph, self._codec.encode(_GRAPH, message))

    def _qos(self, name: TypeName, profile: QosProfile, whose: str = "") -> Qos:
        type_hash = self._hash(name)
        said = f"typehash={type_hash};{whose}" if type_hash else whose
        reliable = Policy.Reliability.Reliable(_RESOURCE_WAIT)
        return Qos(
            reliable if profile.reliability == "reliable" else Policy.Reliability.BestEffort,
            Policy.Durability.TransientLocal
            if profile.durability == "transient_local"
            else Policy.Durability.Volatile,
            Policy.History.KeepLast(profile.depth),
            *([Policy.Userdata(said.encode())] if said else []),
        )


def join(name: str, definitions: Definitions, domain: Domain, report: Report | None) -> DdsNode:
    """Make a node that joins a domain."""
    return DdsNode(name, definitions, domain.number, domain.reach, report)


class _DdsPublisher(Publisher):
    def __init__(
        self,
        writer: DataWriter[Any],
        encode: Callable[[Mapping[str, Any]], bytes],
        end: Callable[[], None],
    ) -> None:
        self._writer, self._encode, self._end = writer, encode, end

    def publish(self, message: Mapping[str, Any]) -> None:
        _write(self._writer, self._encode(message))

    @property
    def subscriptions(self) -> int:
        return len(matched(self._writer.get_matched_subscriptions))

    def close(self) -> None:
        self._end()


def _write(writer: DataWriter[Any], data: bytes) -> None:
    sample = _deserialize(writer.data_type, data)
    try:
        writer.write(sample)
    except DDSException as error:
        raise Ros2Error(f"DDS does not take a message: {error}") from None


def _dds_type(name: TypeName) -> Any:
    """Make the class that the wheel needs for a type: samples are bytes in ``cdr``."""
    made: Any = make_idl_struct(name.name, name.dds, {"data": uint8})
    made.serialize, made.deserialize = _serialize, classmethod(_deserialize)
    return made


def _serialize(sample: Any, *_arguments: object, **_options: object) -> bytes:
    data: bytes = sample.cdr
    return data


def _deserialize(kind: Any, data: bytes, /, *_arguments: object, **_options: object) -> Any:
    made = object.__new__(kind)
    made.cdr = data
    return made
