"""A node on DDS with the wheel of Eclipse Cyclone DDS, without a ROS installation.

Topics reach nodes of every RMW. Services and actions reach only nodes of rmw_cyclonedds (:mod:`.services`),
since rmw_fastrtps keeps the client's id in a field that this wheel cannot write.
:mod:`cxbridge_ros2.messages` encodes CDR; DDS transports the bytes.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
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
from msgspec import Struct

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import Ros2Error
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.messages import Codec
from cxbridge_ros2.names import TypeName, check_topic, parse_type
from cxbridge_ros2.node import (
    Client,
    Domain,
    MessageCallback,
    Node,
    ProblemCallback,
    Publisher,
    RequestHandler,
)
from cxbridge_ros2.qos import PROFILES, QosProfile
from cxbridge_ros2.stamps import NS_PER_US
from cxbridge_ros2.transports.dds.discovery import Discovery, OwnEndpoint
from cxbridge_ros2.transports.dds.domain import delete, delete_all, enter, security_problem
from cxbridge_ros2.transports.dds.services import (
    DdsClient,
    DdsServer,
    matched_handles,
    owner_data,
    sample_of,
    write,
)
from cxbridge_ros2.transports.environment import MAX_DDS_DOMAIN, default_reach, domain_id

_BATCH: Final = 256  # samples per reader and poll, so that a fast topic does not starve the rest
_DISCOVERY_PERIOD_S: Final = 1.0  # seconds between two updates of the discovered endpoints
_RETRY_S: Final = 0.01  # seconds between two checks for the reader of a response
_GRAPH: Final = parse_type("rmw_dds_common/msg/ParticipantEntitiesInfo")
_REPORTS: Final = QosProfile(durability="transient_local", depth=1000)
_GID: Final = parse_type("rmw_dds_common/msg/Gid")
_ENCLAVE: Final = b"enclave=/;"  # user data of a node's participant; ROS ignores a participant without it

# how long a write waits while the queue of a slow reader is full, as in rmw_cyclonedds
_MAX_BLOCKING: Final = duration(milliseconds=100)


class _Reader(Struct, frozen=True, eq=False):
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
        report: ProblemCallback | None = None,
    ) -> None:
        super().__init__(report)
        self.name = name
        self._definitions = definitions
        self._codec = Codec(definitions)
        self._number = number = domain_id(MAX_DDS_DOMAIN) if domain is None else domain
        self._reach = reach or default_reach()
        if problem := security_problem():
            self.complain("security", problem)
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
        self._readers: list[_Reader] = []
        self._writers: list[DataWriter[Any]] = []
        self._servers: list[DdsServer] = []
        self._graph, graph = self._make_graph()
        self._discovery = Discovery(self._participant, graph, self._nodes_in, f"/{name}", self.complain)
        self._discovery_s = 0.0
        self._announce()

    # --- the interface of a node --------------------------------------------------------------------------

    def create_publisher(
        self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]
    ) -> Publisher:
        name = parse_type(message_type)
        writer = self._writer(f"rt{check_topic(topic)}", name, qos)
        return Publisher(
            lambda message: write(writer, self._codec.encode(name, message)),
            lambda: len(matched_handles(writer.get_matched_subscriptions)),
            partial(self._close_writer, writer),
        )

    def _subscribe(
        self, topic: str, message_type: str, callback: MessageCallback, qos: QosProfile
    ) -> Callable[[], None]:
        name = parse_type(message_type)

        def take(sample: Any) -> None:
            message = self._try_decode(topic, partial(self._codec.decode, name, sample.cdr))
            if message is not None:
                callback(message)

        return partial(self._close_reader, self._reader(f"rt{check_topic(topic)}", name, qos, take))

    def create_client(self, service: str, service_type: str) -> Client:
        name, user_data = parse_type(service_type, "srv"), owner_data("clientid")
        request, response = name.derive("Request"), name.derive("Response")
        request_topic, qos = f"rq{check_topic(service)}Request", PROFILES["services_default"]
        writer = self._writer(request_topic, request, qos, user_data)
        client = DdsClient(
            writer,
            partial(self._codec.encode, request),
            lambda data: self._try_decode(service, partial(self._codec.decode, response, data)),
            lambda: self._discovery.missing_server_reason(request_topic, request, self._network),
        )
        reader = self._reader(f"rr{service}Reply", response, qos, client.take, user_data)

        def end() -> None:
            self._close_reader(reader)
            self._close_writer(writer)

        client.receive_from(reader.entity, end)
        return client

    def _serve_later(self, service: str, service_type: str, handler: RequestHandler) -> Callable[[], None]:
        name, user_data = parse_type(service_type, "srv"), owner_data("serviceid")
        request, response = name.derive("Request"), name.derive("Response")
        qos = PROFILES["services_default"]
        writer = self._writer(f"rr{check_topic(service)}Reply", response, qos, user_data)
        server = DdsServer(
            writer,
            partial(self._codec.encode, response),
            lambda data: self._try_decode(service, partial(self._codec.decode, request, data)),
            handler,
        )
        reader = self._reader(f"rq{service}Request", request, qos, server.take, user_data)
        server.receive_from(reader.entity)
        self._servers.append(server)

        def end() -> None:
            if server in self._servers:
                self._servers.remove(server)
                server.close()
                self._close_reader(reader)
                self._close_writer(writer)

        return end

    def poll(self, timeout_s: float = 0.0) -> bool:
        unsent_servers = [server for server in self._servers if server.send()]
        if timeout_s > 0:
            wait_s = min(timeout_s, _RETRY_S) if unsent_servers else timeout_s
            self._waits.wait(int(wait_s * MICROSECONDS) * NS_PER_US)
        now_s = time.monotonic()
        if now_s - self._discovery_s > _DISCOVERY_PERIOD_S:
            self._discovery_s = now_s
            self._discovery.update()
        any_received = False
        for reader in list(self._readers):
            if reader not in self._readers:
                continue  # a callback has closed it
            for sample in reader.entity.take(N=_BATCH):
                if hasattr(sample, "cdr"):  # a sample without data reports the end of a writer
                    any_received = True
                    reader.take(sample)
        return any_received

    def close(self) -> None:
        for server in self._servers:
            server.close()
        # readers are not announced one by one: DDS reports the end of the whole participant
        while self._readers:
            self._delete_reader(self._readers.pop())
        delete_all((*self._writers, self._graph))
        # in this order: an entity must be deleted before its participant
        for entity in (self._waits, self._never, self._participant):
            delete(entity)
        self._leave_domain()

    # --- DDS ----------------------------------------------------------------------------------------------

    def _topic(self, topic: str, name: TypeName) -> Topic[Any]:
        if name.dds_name not in self._types:
            self._definitions.fields(name)  # raises the error about an unknown type
            self._types[name.dds_name] = _dds_type(name)
        try:  # without QoS, since readers and writers of one topic may differ in theirs
            return Topic(self._participant, topic, self._types[name.dds_name])
        except DDSException as error:
            raise Ros2Error(f"DDS does not take {topic} as {name}: {error}") from None

    def _writer(
        self, topic: str, name: TypeName, profile: QosProfile, user_data: str = ""
    ) -> DataWriter[Any]:
        qos = self._qos(name, profile, user_data)
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
        user_data: str = "",
    ) -> _Reader:
        qos = self._qos(name, profile, user_data)
        entity: DataReader[Any] = DataReader(self._participant, self._topic(topic, name), qos=qos)
        condition = ReadCondition(entity, SampleState.NotRead | ViewState.Any | InstanceState.Any)
        self._waits.attach(condition)
        reader = _Reader(entity, condition, take)
        self._readers.append(reader)
        self._discovery.add(OwnEndpoint(entity, topic, name, self._hash(name)))
        self._announce()
        return reader

    def _close_reader(self, reader: _Reader) -> None:
        if reader in self._readers:
            self._readers.remove(reader)
            self._discovery.remove(reader.entity)
            self._delete_reader(reader)
            self._announce()

    def _delete_reader(self, reader: _Reader) -> None:
        self._waits.detach(reader.condition)
        delete(reader.condition)
        delete(reader.entity)

    def _close_writer(self, writer: DataWriter[Any]) -> None:
        if writer in self._writers:
            self._writers.remove(writer)
            self._discovery.remove(writer)
            delete(writer)
            self._announce()

    @property
    def _network(self) -> str:
        """Our part of the network."""
        host = " on this host (reach: subnet goes beyond)" if self._reach == "localhost" else ""
        return f"the domain {self._number}{host}"

    def _hash(self, name: TypeName) -> str:
        return self._definitions.type_hash(name) if self._definitions.has_type_hashes else ""

    # --- the graph of ROS -----------------------------------------------------------------------------------

    def _make_graph(self) -> tuple[DataWriter[Any], DataReader[Any]]:
        """Return the writer for our node's report, and the reader of other participants' reports."""
        topic = self._topic("ros_discovery_info", _GRAPH)
        writer = DataWriter(self._participant, topic, qos=self._qos(_GRAPH, PROFILES["latched"]))
        return writer, DataReader(
            self._participant,
            topic,
            qos=Qos(Policy.IgnoreLocal.Participant, base=self._qos(_GRAPH, _REPORTS)),
        )

    def _nodes_in(self, report: bytes) -> Iterable[str]:
        """Return the full names of the nodes in a participant's report."""
        message = self._try_decode("ros_discovery_info", partial(self._codec.decode, _GRAPH, report))
        nodes = () if message is None else message["node_entities_info_seq"]
        return [f"{node['node_namespace'].rstrip('/')}/{node['node_name']}" for node in nodes]

    def _announce(self) -> None:
        """Report the readers and writers of this node, so that it appears in the graph of ROS."""
        ((_, (_, (_, size))),) = self._definitions.fields(_GID)  # 24 bytes until Humble, then 16

        def gid(entity: Entity) -> Mapping[str, Any]:
            return {"data": entity.guid.bytes.ljust(size, b"\0")}

        node = {
            "node_namespace": "/",
            "node_name": self.name,
            "reader_gid_seq": [gid(reader.entity) for reader in self._readers],
            "writer_gid_seq": [gid(writer) for writer in self._writers],
        }
        write(
            self._graph,
            self._codec.encode(_GRAPH, {"gid": gid(self._participant), "node_entities_info_seq": [node]}),
        )

    def _qos(self, name: TypeName, profile: QosProfile, user_data: str = "") -> Qos:
        type_hash = self._hash(name)
        if type_hash:
            user_data = f"typehash={type_hash};{user_data}"
        return Qos(
            Policy.Reliability.Reliable(_MAX_BLOCKING)
            if profile.reliability == "reliable"
            else Policy.Reliability.BestEffort,
            Policy.Durability.TransientLocal
            if profile.durability == "transient_local"
            else Policy.Durability.Volatile,
            Policy.History.KeepLast(profile.depth),
            *([Policy.Userdata(user_data.encode())] if user_data else []),
        )


def join(name: str, definitions: Definitions, domain: Domain, report: ProblemCallback | None) -> DdsNode:
    return DdsNode(name, definitions, domain.number, domain.reach, report)


def _dds_type(name: TypeName) -> Any:
    """Make the class for a type that the wheel needs; samples have their bytes in ``cdr``."""
    idl_struct: Any = make_idl_struct(name.name, name.dds_name, {"data": uint8})
    idl_struct.serialize, idl_struct.deserialize = _serialize, classmethod(sample_of)
    return idl_struct


def _serialize(sample: Any, *_arguments: object, **_options: object) -> bytes:
    data: bytes = sample.cdr
    return data
