"""A node on DDS with the wheel of Eclipse Cyclone DDS, without a ROS installation.

Topics reach nodes of every RMW. Services and actions reach only nodes of rmw_cyclonedds (:mod:`.services`),
since rmw_fastrtps keeps the client's id in a field that this wheel cannot write.
:mod:`cxbridge_ros2.messages` encodes CDR; DDS transports the bytes.
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
from cxbridge_ros2.transports.dds.discovery import Discovery, OwnEndpoint
from cxbridge_ros2.transports.dds.domain import delete, delete_all, enter, lacks_security
from cxbridge_ros2.transports.dds.services import DdsClient, DdsServer, matched, named
from cxbridge_ros2.transports.environment import MOST_DDS_DOMAIN, default_reach, domain_id

_BATCH: Final = 256  # samples per reader and poll, so that a fast topic does not starve the rest
_LOOK_S: Final = 1.0  # seconds between two looks at discovered endpoints
_DISCOVERY_S: Final = 0.01  # seconds between two checks for the reader of a response
_NANOSECONDS: Final = 1000
_GRAPH: Final = parse_type("rmw_dds_common/msg/ParticipantEntitiesInfo")
_REPORTS: Final = QosProfile(durability="transient_local", depth=1000)
_GID: Final = parse_type("rmw_dds_common/msg/Gid")
_ENCLAVE: Final = b"enclave=/;"  # user data of a node's participant; ROS ignores a participant without it

_RESOURCE_WAIT: Final = duration(milliseconds=100)


@dataclass(frozen=True, slots=True)
class _Reader:
    entity: DataReader[Any]
    condition: ReadCondition
    take: Callable[[Any], None]


class DdsNode(Node):
    """A node on DDS.

    :param domain: the DDS domain; by default ``ROS_DOMAIN_ID``.
    :param reach: ``localhost`` to find nodes on this host only, ``subnet`` for the network; by default
        ``ROS_AUTOMATIC_DISCOVERY_RANGE``, or ``localhost``.
    :param report: see the base class.
    :raises Ros2Error: if DDS cannot start.
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
        self._waits.attach(self._never)  # an empty wait set does not wait
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
        name = parse_type(message_type)
        writer = self._writer(f"rt{check_topic(topic)}", name, qos)
        return _DdsPublisher(writer, partial(self._codec.encode, name), partial(self._end_writer, writer))

    def _subscribe(
        self, topic: str, message_type: str, receive: Receive, qos: QosProfile
    ) -> Callable[[], None]:
        name = parse_type(message_type)

        def take(sample: Any) -> None:
            message = self._intact(topic, partial(self._codec.decode, name, sample.cdr))
            if message is not None:
                receive(message)

        return self._reader(f"rt{check_topic(topic)}", name, qos, take)[1]

    def client(self, service: str, service_type: str) -> Client:
        name, whose = parse_type(service_type, "srv"), named("clientid")
        request, response = name.derived("Request"), name.derived("Response")
        service_topic, qos = check_topic(service), PROFILES["services_default"]
        writer = self._writer(f"rq{service_topic}Request", request, qos, whose)
        dds_client = DdsClient(
            writer,
            partial(_write, writer),
            partial(self._codec.encode, request),
            lambda data: self._intact(service, partial(self._codec.decode, response, data)),
            lambda: self._discovery.why_unserved(f"rq{service_topic}Request", request, self._where),
        )
        reader, end = self._reader(f"rr{service_topic}Reply", response, qos, dds_client.take, whose)

        def end_both() -> None:
            end()
            self._end_writer(writer)

        dds_client.receive_from(reader, end_both)
        return dds_client

    def _serve_later(self, service: str, service_type: str, answer: AnswerLater) -> Callable[[], None]:
        name, whose = parse_type(service_type, "srv"), named("serviceid")
        request, response = name.derived("Request"), name.derived("Response")
        service_topic, qos = check_topic(service), PROFILES["services_default"]
        writer = self._writer(f"rr{service_topic}Reply", response, qos, whose)
        dds_server = DdsServer(
            writer,
            partial(_write, writer),
            partial(self._codec.encode, response),
            lambda data: self._intact(service, partial(self._codec.decode, request, data)),
            answer,
        )
        reader, end = self._reader(f"rq{service_topic}Request", request, qos, dds_server.take, whose)
        dds_server.receive_from(reader)
        self._servers.append(dds_server)

        def end_both() -> None:
            if dds_server in self._servers:
                self._servers.remove(dds_server)
                dds_server.close()
                end()
                self._end_writer(writer)

        return end_both

    def poll(self, timeout_s: float = 0.0) -> bool:
        unsent_servers = [server for server in self._servers if server.send()]
        if timeout_s > 0:
            wait_s = min(timeout_s, _DISCOVERY_S) if unsent_servers else timeout_s
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
        for server in self._servers:
            server.close()
        # Readers are not announced one by one: DDS reports the end of the whole participant.
        while self._readers:
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
        try:  # without QoS, since readers and writers of one topic may differ in theirs
            return Topic(self._participant, topic, known)
        except DDSException as error:
            raise Ros2Error(f"DDS does not take {topic} as {name}: {error}") from None

    def _writer(self, topic: str, name: TypeName, profile: QosProfile, whose: str = "") -> DataWriter[Any]:
        qos = self._qos(name, profile, whose)
        writer: DataWriter[Any] = DataWriter(self._participant, self._topic(topic, name), qos=qos)
        self._writers.append(writer)
        self._discovery.add(OwnEndpoint(writer, topic, name, self._hash(name)))
        self._announce()
        return writer

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
        self._discovery.add(OwnEndpoint(reader, topic, name, self._hash(name)))
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
        """Our part of the network."""
        host = " on this host (reach: subnet goes beyond)" if self._reach == "localhost" else ""
        return f"the domain {self._number}{host}"

    def _hash(self, name: TypeName) -> str:
        return self._definitions.type_hash(name) if self._definitions.has_hashes else ""

    # --- the graph of ROS -----------------------------------------------------------------------------------

    def _make_graph(self) -> tuple[DataWriter[Any], DataReader[Any]]:
        """Return the writer for our node's report, and the reader of other participants' reports."""
        topic = self._topic("ros_discovery_info", _GRAPH)
        writer = DataWriter(self._participant, topic, qos=self._qos(_GRAPH, PROFILES["latched"]))
        qos = Qos(Policy.IgnoreLocal.Participant, base=self._qos(_GRAPH, _REPORTS))
        return writer, DataReader(self._participant, topic, qos=qos)

    def _nodes_in(self, report: bytes) -> Iterable[str]:
        """Return the full names of the nodes in a participant's report."""
        message = self._intact("ros_discovery_info", partial(self._codec.decode, _GRAPH, report))
        nodes = () if message is None else message["node_entities_info_seq"]
        return [f"{each['node_namespace'].rstrip('/')}/{each['node_name']}" for each in nodes]

    def _announce(self) -> None:
        """Report the readers and writers of this node, so that it appears in the graph of ROS."""
        ((_, (_, (_, size))),) = self._definitions.fields(_GID)  # 24 bytes until Humble, then 16

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
        user_data = f"typehash={type_hash};{whose}" if type_hash else whose
        reliable = Policy.Reliability.Reliable(_RESOURCE_WAIT)
        return Qos(
            reliable if profile.reliability == "reliable" else Policy.Reliability.BestEffort,
            Policy.Durability.TransientLocal
            if profile.durability == "transient_local"
            else Policy.Durability.Volatile,
            Policy.History.KeepLast(profile.depth),
            *([Policy.Userdata(user_data.encode())] if user_data else []),
        )


def join(name: str, definitions: Definitions, domain: Domain, report: Report | None) -> DdsNode:
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
    """Make the class for a type that the wheel needs; samples have their bytes in ``cdr``."""
    idl_struct: Any = make_idl_struct(name.name, name.dds, {"data": uint8})
    idl_struct.serialize, idl_struct.deserialize = _serialize, classmethod(_deserialize)
    return idl_struct


def _serialize(sample: Any, *_arguments: object, **_options: object) -> bytes:
    data: bytes = sample.cdr
    return data


def _deserialize(kind: Any, data: bytes, /, *_arguments: object, **_options: object) -> Any:
    instance = object.__new__(kind)
    instance.cdr = data
    return instance
