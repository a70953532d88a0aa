"""A node on DDS with the Python package of Eclipse Cyclone DDS, without a ROS installation.

Topics reach nodes of each RMW (ROS middleware) on DDS. Services and actions reach only nodes of
rmw_cyclonedds (:mod:`.services`), since rmw_fastrtps has the client's id in a field that the Python package
cannot write. :mod:`cxbridge_ros2.messages` encodes messages to CDR, and DDS transports the bytes.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
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
from cxbridge_ros2.names import TypeName, check_ros_name, parse_type
from cxbridge_ros2.node import (
    Client,
    MessageCallback,
    Node,
    ProblemCallback,
    Publisher,
    RequestHandler,
)
from cxbridge_ros2.qos import PROFILES, QosProfile
from cxbridge_ros2.stamps import NS_PER_US
from cxbridge_ros2.transports.dds.discovery import Discovery, LocalEndpoint
from cxbridge_ros2.transports.dds.domain import (
    delete_entity,
    delete_writers,
    enter_domain,
    find_security_problem,
)
from cxbridge_ros2.transports.dds.services import (
    DdsClient,
    DdsServer,
    list_matched_handles,
    make_owner_data,
    make_sample,
    write_data,
)
from cxbridge_ros2.transports.environment import read_discovery_range, read_domain_id

_MAX_SAMPLES: Final = 256  # samples per reader and poll, so that a fast topic does not starve other topics
# Time between two updates of the discovered endpoints: a warning about a mismatch may come a second late.
_DISCOVERY_PERIOD_S: Final = 1.0
# Time between two checks for the reader of a response, which DDS finds without waking a waiting node.
_RETRY_PERIOD_S: Final = 0.01
# The topic on which participants announce their nodes, readers and writers to the graph of ROS.
_GRAPH_TOPIC: Final = "ros_discovery_info"
_GRAPH_TYPE: Final = parse_type("rmw_dds_common/msg/ParticipantEntitiesInfo")
_GID_TYPE: Final = parse_type("rmw_dds_common/msg/Gid")
_PARTICIPANT_USER_DATA: Final = b"enclave=/;"  # ROS ignores participants without an enclave

# The time limit of a write that waits for space in the queue of a slow reader, as in rmw_cyclonedds.
_MAX_BLOCKING_TIME: Final = duration(milliseconds=100)


class _Reader(Struct, frozen=True, eq=False):
    entity: DataReader[Any]
    condition: ReadCondition
    handle_sample: Callable[[Any], None]


class DdsNode(Node):
    """A node on DDS.

    :param domain: the DDS domain; by default ``ROS_DOMAIN_ID``.
    :param reach: the range of discovery: ``off`` for this process, ``localhost`` for this host, ``subnet`` or
        ``system_default`` for the network; by default the range of the environment, or ``localhost``.
    :param report: see the base class.
    :raises Ros2Error: if DDS cannot start, the domain or the range is invalid, or the environment enforces
        security.
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
        self._domain_number = number = read_domain_id() if domain is None else domain
        self._reach = reach or read_discovery_range()
        if problem := find_security_problem():
            self.complain("security", problem)
        self._leave_domain: Callable[[], None] = lambda: None  # until the domain is entered
        try:
            self._leave_domain = enter_domain(number, self._reach)
            self._participant = DomainParticipant(number, qos=Qos(Policy.Userdata(_PARTICIPANT_USER_DATA)))
        except DDSException as error:
            self._leave_domain()
            raise Ros2Error(
                f"DDS cannot start in domain {number}: {error}",
                hint="check ROS_DOMAIN_ID, CYCLONEDDS_URI, and that UDP ports are free",
            ) from None
        self._wait_set = WaitSet(self._participant)
        self._guard_condition = GuardCondition(self._participant)
        self._wait_set.attach(self._guard_condition)  # never triggered: an empty wait set would not wait
        self._types: dict[str, Any] = {}
        self._readers: list[_Reader] = []
        self._writers: list[DataWriter[Any]] = []
        self._servers: list[DdsServer] = []
        self._graph_writer: DataWriter[Any] = DataWriter(
            self._participant,
            self._make_topic(_GRAPH_TOPIC, _GRAPH_TYPE),
            qos=self._make_qos(_GRAPH_TYPE, PROFILES["latched"]),
        )
        self._discovery = Discovery(self._participant, self.complain)
        self._last_discovery_s = 0.0
        self._announce_endpoints()

    # --- the interface of a node --------------------------------------------------------------------------

    def create_publisher(
        self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]
    ) -> Publisher:
        type_name = parse_type(message_type)
        writer = self._open_writer(f"rt{check_ros_name(topic)}", type_name, qos)
        return Publisher(
            lambda message: write_data(writer, self._codec.encode(type_name, message)),
            lambda: len(list_matched_handles(writer.get_matched_subscriptions)),
            partial(self._close_writer, writer),
        )

    def _subscribe(
        self, topic: str, message_type: str, callback: MessageCallback, qos: QosProfile
    ) -> Callable[[], None]:
        type_name = parse_type(message_type)

        def handle_sample(sample: Any) -> None:
            message = self._try_decode(topic, partial(self._codec.decode, type_name, sample.cdr))
            if message is not None:
                callback(message)

        return partial(
            self._close_reader, self._open_reader(f"rt{check_ros_name(topic)}", type_name, qos, handle_sample)
        )

    def create_client(self, service: str, service_type: str) -> Client:
        type_name, user_data = parse_type(service_type, "srv"), make_owner_data("clientid")
        request, response = type_name.derive("Request"), type_name.derive("Response")
        request_topic, qos = f"rq{check_ros_name(service)}Request", PROFILES["services_default"]
        writer = self._open_writer(request_topic, request, qos, user_data)
        reader = self._open_reader(
            f"rr{service}Reply",
            response,
            qos,
            lambda sample: client.handle_sample(sample),  # noqa: PLW0108 - the client is made below
            user_data,
        )

        def close_endpoints() -> None:
            self._close_reader(reader)
            self._close_writer(writer)

        client = DdsClient(
            writer,
            reader.entity,
            partial(self._codec.encode, request),
            lambda encoded_response: self._try_decode(
                service, partial(self._codec.decode, response, encoded_response)
            ),
            lambda: self._discovery.describe_missing_server(
                request_topic, request, self._network_description
            ),
            close_endpoints,
        )
        return client

    def _serve_later(self, service: str, service_type: str, handler: RequestHandler) -> Callable[[], None]:
        type_name, user_data = parse_type(service_type, "srv"), make_owner_data("serviceid")
        request, response = type_name.derive("Request"), type_name.derive("Response")
        qos = PROFILES["services_default"]
        writer = self._open_writer(f"rr{check_ros_name(service)}Reply", response, qos, user_data)
        reader = self._open_reader(
            f"rq{service}Request",
            request,
            qos,
            lambda sample: server.handle_sample(sample),  # noqa: PLW0108 - the server is made below
            user_data,
        )
        server = DdsServer(
            writer,
            reader.entity,
            partial(self._codec.encode, response),
            lambda encoded_request: self._try_decode(
                service, partial(self._codec.decode, request, encoded_request)
            ),
            handler,
        )
        self._servers.append(server)

        def end_service() -> None:
            if server in self._servers:
                self._servers.remove(server)
                server.close()
                self._close_reader(reader)
                self._close_writer(writer)

        return end_service

    def poll(self, timeout_s: float = 0.0) -> bool:
        busy_servers = [server for server in self._servers if server.send_responses()]
        if timeout_s > 0:
            wait_s = min(timeout_s, _RETRY_PERIOD_S) if busy_servers else timeout_s
            self._wait_set.wait(int(wait_s * MICROSECONDS) * NS_PER_US)  # takes nanoseconds
        now_s = time.monotonic()
        if now_s - self._last_discovery_s > _DISCOVERY_PERIOD_S:
            self._last_discovery_s = now_s
            self._discovery.update()
        has_received = False
        for reader in list(self._readers):
            if reader not in self._readers:
                continue  # a callback has closed the reader
            for sample in reader.entity.take(N=_MAX_SAMPLES):
                # a sample without data reports the end of a writer; a callback may have closed the reader
                if hasattr(sample, "cdr") and reader in self._readers:
                    has_received = True
                    reader.handle_sample(sample)
        return has_received

    def close(self) -> None:
        for server in self._servers:
            server.close()
        # without announcements, since DDS reports the end of the participant
        while self._readers:
            self._delete_reader(self._readers.pop())
        delete_writers((*self._writers, self._graph_writer))
        # the participant last, since an entity must be deleted before its participant
        for entity in (self._wait_set, self._guard_condition, self._participant):
            delete_entity(entity)
        self._leave_domain()

    # --- DDS ----------------------------------------------------------------------------------------------

    def _make_topic(self, topic: str, type_name: TypeName) -> Topic[Any]:
        if type_name.dds_name not in self._types:
            self._definitions.find_fields(type_name)  # raises the error about an unknown type
            self._types[type_name.dds_name] = _make_dds_type(type_name)
        try:  # without QoS, since the readers and writers of a topic may have different QoS
            return Topic(self._participant, topic, self._types[type_name.dds_name])
        except DDSException as error:
            raise Ros2Error(f"DDS rejects the topic {topic} with the type {type_name}: {error}") from None

    def _open_writer(
        self, topic: str, type_name: TypeName, profile: QosProfile, user_data: str = ""
    ) -> DataWriter[Any]:
        qos = self._make_qos(type_name, profile, user_data)
        writer: DataWriter[Any] = DataWriter(self._participant, self._make_topic(topic, type_name), qos=qos)
        self._writers.append(writer)
        self._discovery.add(LocalEndpoint(writer, topic, type_name, self._find_type_hash(type_name)))
        self._announce_endpoints()
        return writer

    def _open_reader(
        self,
        topic: str,
        type_name: TypeName,
        profile: QosProfile,
        handle_sample: Callable[[Any], None],
        user_data: str = "",
    ) -> _Reader:
        qos = self._make_qos(type_name, profile, user_data)
        entity: DataReader[Any] = DataReader(self._participant, self._make_topic(topic, type_name), qos=qos)
        condition = ReadCondition(entity, SampleState.NotRead | ViewState.Any | InstanceState.Any)
        self._wait_set.attach(condition)
        reader = _Reader(entity, condition, handle_sample)
        self._readers.append(reader)
        self._discovery.add(LocalEndpoint(entity, topic, type_name, self._find_type_hash(type_name)))
        self._announce_endpoints()
        return reader

    def _close_reader(self, reader: _Reader) -> None:
        if reader in self._readers:
            self._readers.remove(reader)
            self._discovery.remove(reader.entity)
            self._delete_reader(reader)
            self._announce_endpoints()

    def _delete_reader(self, reader: _Reader) -> None:
        self._wait_set.detach(reader.condition)
        delete_entity(reader.condition)
        delete_entity(reader.entity)

    def _close_writer(self, writer: DataWriter[Any]) -> None:
        if writer in self._writers:
            self._writers.remove(writer)
            self._discovery.remove(writer)
            delete_entity(writer)
            self._announce_endpoints()

    @property
    def _network_description(self) -> str:
        """A description of the part of the network that this node reaches, for errors."""
        host = " on this host (reach: subnet includes further hosts)" if self._reach == "localhost" else ""
        return f"the domain {self._domain_number}{host}"

    def _find_type_hash(self, type_name: TypeName) -> str:
        return self._definitions.compute_type_hash(type_name) if self._definitions.has_type_hashes else ""

    # --- the graph of ROS -----------------------------------------------------------------------------------

    def _announce_endpoints(self) -> None:
        """Announce the readers and writers of this node, so that tools such as `ros2 node info` show them."""
        # the only field of a Gid is an array of bytes: 24 bytes until Humble, then 16
        ((_field, (_kind, (_byte_type, size))),) = self._definitions.find_fields(_GID_TYPE)

        def make_gid(entity: Entity) -> Mapping[str, Any]:
            return {"data": entity.guid.bytes.ljust(size, b"\0")}

        node = {
            "node_namespace": "/",
            "node_name": self.name,
            "reader_gid_seq": [make_gid(reader.entity) for reader in self._readers],
            "writer_gid_seq": [make_gid(writer) for writer in self._writers],
        }
        write_data(
            self._graph_writer,
            self._codec.encode(
                _GRAPH_TYPE, {"gid": make_gid(self._participant), "node_entities_info_seq": [node]}
            ),
        )

    def _make_qos(self, type_name: TypeName, profile: QosProfile, user_data: str = "") -> Qos:
        type_hash = self._find_type_hash(type_name)
        if type_hash:
            user_data = f"typehash={type_hash};{user_data}"
        return Qos(
            Policy.Reliability.Reliable(_MAX_BLOCKING_TIME)
            if profile.reliability == "reliable"
            else Policy.Reliability.BestEffort,
            Policy.Durability.TransientLocal
            if profile.durability == "transient_local"
            else Policy.Durability.Volatile,
            Policy.History.KeepLast(profile.depth),
            *([Policy.Userdata(user_data.encode())] if user_data else []),
        )


def _make_dds_type(type_name: TypeName) -> Any:
    """Make the class that cyclonedds requires for a type. A sample has its CDR bytes as ``cdr``."""
    # the class tells DDS the type's name only: the field stands for the real fields, and is never serialised,
    # since both functions pass the bytes through
    idl_struct: Any = make_idl_struct(type_name.name, type_name.dds_name, {"data": uint8})
    idl_struct.serialize, idl_struct.deserialize = _serialize, classmethod(make_sample)
    return idl_struct


def _serialize(sample: Any, *_arguments: object, **_options: object) -> Any:
    return sample.cdr
