"""A node on Zenoh with the wheel of Eclipse Zenoh, for robots with rmw_zenoh_cpp.

Messages go to keys that contain their type; a service is a queryable; liveliness tokens announce endpoints.
Zenoh calls back in its own threads, so received messages wait until the node is polled.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from itertools import count
from typing import Any, Final

import zenoh
from zenoh import ext
from zenoh.handlers import Callback

from cxbridge.errors import Ros2Error
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.messages import Codec
from cxbridge_ros2.names import TypeName, parse_type
from cxbridge_ros2.node import AnswerLater, Client, Domain, Failed, Node, Publisher, Receive, Report
from cxbridge_ros2.qos import PROFILES, QosProfile
from cxbridge_ros2.topics import check_topic
from cxbridge_ros2.transports.environment import domain_id
from cxbridge_ros2.transports.inbox import InboxSource, MessageInbox
from cxbridge_ros2.transports.misfits import misfit, whole_name
from cxbridge_ros2.transports.zenoh.graph import RosGraph
from cxbridge_ros2.transports.zenoh.names import (
    NO_HASH,
    GraphEndpoint,
    Kind,
    MessageAttachment,
    NodeName,
    TypedName,
    attachment_of,
    place_of,
    tokens_of,
)
from cxbridge_ros2.transports.zenoh.session import open_session

_SERVICES: Final = PROFILES["services_default"]
_HEARTBEAT_S: Final = 0.5
_REQUEST_S: Final = 600.0  # seconds until a request counts as failed
_RESULT_S: Final = 1e9  # a goal may take any time
# Kind of the remote end of an endpoint, and ROS' term for it.
_PEERS: Final[Mapping[Kind, tuple[Kind, str]]] = {
    "MP": ("MS", "subscription"),
    "MS": ("MP", "publisher"),
    "SS": ("SC", "client"),
    "SC": ("SS", "server"),
}

_GET_RESULT: Final = "/_action/get_result"


class ZenohNode(Node):
    """A node on Zenoh.

    :param url: the router, such as ``tcp/robot:7447``; empty for the environment's or this host's.
    :param domain: by default ``ROS_DOMAIN_ID``.
    :param report: see the base class.
    :raises Ros2Error: if there is no router.
    """

    def __init__(
        self,
        name: str,
        definitions: Definitions,
        url: str = "",
        domain: int | None = None,
        report: Report | None = None,
    ) -> None:
        super().__init__(report)
        self._definitions = definitions
        self._codec = Codec(definitions)
        self._domain = domain_id() if domain is None else domain
        self._session = open_session(url)
        self._name = NodeName(self._domain, str(self._session.zid()), 0, name)
        self._numbers = count(1)
        self._inbox = MessageInbox()
        self._ends: dict[int, Callable[[], None]] = {}
        self._ours: dict[int, tuple[GraphEndpoint, TypeName]] = {}
        self._compared = -1
        self._graph = RosGraph()
        liveliness = self._session.liveliness()
        self._tokens = liveliness.declare_subscriber(
            tokens_of(self._domain), _called(self._changed), history=True
        )
        self._token = liveliness.declare_token(self._name.token)

    # --- the interface of a node --------------------------------------------------------------------------

    def publisher(self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]) -> Publisher:
        name = parse_type(message_type)
        endpoint = self._endpoint("MP", place_of(check_topic(topic), name, self._definitions), qos)
        zenoh_publisher = _declared_publisher(self._session, endpoint.place.key(self._domain), qos)
        end = self._announced(endpoint, name, zenoh_publisher)
        subscriptions = partial(self._graph.at, "MS", endpoint.place)
        return _Publisher(
            zenoh_publisher, endpoint.gid, partial(self._codec.encode, name), subscriptions, end
        )

    def _subscribe(
        self, topic: str, message_type: str, receive: Receive, qos: QosProfile
    ) -> Callable[[], None]:
        name = parse_type(message_type)
        endpoint = self._endpoint("MS", place_of(check_topic(topic), name, self._definitions), qos)

        def take(sample: zenoh.Sample) -> None:
            if sample.kind == zenoh.SampleKind.PUT:
                message = self._intact(topic, lambda: self._codec.decode(name, sample.payload.to_bytes()))
                if message is not None:
                    receive(message)

        source = InboxSource(take, max(1, qos.depth))
        put = _called(partial(self._inbox.put, source))
        zenoh_subscriber = _declared_subscriber(self._session, endpoint.place.key(self._domain), put, qos)
        return self._announced(endpoint, name, zenoh_subscriber, source)

    def client(self, service: str, service_type: str) -> Client:
        name = parse_type(service_type, "srv")
        endpoint = self._endpoint("SC", self._service(service, name), _SERVICES)
        querier = self._session.declare_querier(
            endpoint.place.key(self._domain),
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=_RESULT_S if service.endswith(_GET_RESULT) else _REQUEST_S,
        )
        zenoh_client = _Client(
            querier,
            endpoint.gid,
            partial(self._codec.encode, name.derived("Request")),
            partial(self._codec.decode, name.derived("Response")),
            partial(self._graph.at, "SS", endpoint.place),
            lambda: self._graph.why_unserved(endpoint.place, name, f"the domain {self._domain}"),
        )
        source = InboxSource(zenoh_client.take, 0)
        zenoh_client.put = partial(self._inbox.put, source)
        zenoh_client.end = self._announced(endpoint, name, querier, source)
        return zenoh_client

    def _serve_later(self, service: str, service_type: str, answer: AnswerLater) -> Callable[[], None]:
        name = parse_type(service_type, "srv")
        endpoint = self._endpoint("SS", self._service(service, name), _SERVICES)
        key = endpoint.place.key(self._domain)
        encode = partial(self._codec.encode, name.derived("Response"))

        def take(query: zenoh.Query) -> None:
            try:
                request = self._codec.decode(name.derived("Request"), _bytes(query.payload))
            except Ros2Error as error:  # any client may send anything
                self.complain(f"broken {service}", f"{service}: {error.message}")
                query.reply_err(str(error))
                query.drop()
                return
            answer(request, lambda response: _reply(query, key, encode(response)))

        source = InboxSource(take, _SERVICES.depth)
        queryable = self._session.declare_queryable(
            key, _called(partial(self._inbox.put, source)), complete=True
        )
        return self._announced(endpoint, name, queryable, source)

    def poll(self, timeout_s: float = 0.0) -> bool:
        if self._compared != self._graph.version:
            self._compared = self._graph.version
            for ours, kind in self._ours.values():
                self._compare(ours, kind)
        return self._inbox.hand_out(timeout_s)

    def close(self) -> None:
        for end in list(self._ends.values()):
            end()
        if not self._session.is_closed():
            self._session.close()

    # --- Zenoh --------------------------------------------------------------------------------------------

    def _endpoint(self, kind: Kind, place: TypedName, qos: QosProfile) -> GraphEndpoint:
        return GraphEndpoint(self._name, next(self._numbers), kind, place, qos)

    def _service(self, service: str, name: TypeName) -> TypedName:
        return place_of(check_topic(service), name, self._definitions, is_service=True)

    def _compare(self, ours: GraphEndpoint, kind: TypeName) -> None:
        """Complain about remote endpoints with the same name and another type."""
        wanted, peer = _PEERS[ours.kind]
        name = whole_name(ours.place.name)
        for theirs in self._graph.called(wanted, ours.place.name):
            known = tuple(
                "" if each == NO_HASH else each for each in (theirs.type_hash, ours.place.type_hash)
            )
            if text := misfit(name, peer, (theirs.kind, known[0]), (kind, known[1])):
                self.complain(f"type {name} {peer}", text)

    def _announced(
        self, endpoint: GraphEndpoint, name: TypeName, entity: Any, source: InboxSource | None = None
    ) -> Callable[[], None]:
        """Announce an endpoint; return the function that closes it."""
        token = self._session.liveliness().declare_token(endpoint.token)

        def end() -> None:
            if self._ends.pop(endpoint.number, None) is None:
                return
            del self._ours[endpoint.number]
            if source is not None:
                self._inbox.end(source)
            token.undeclare()
            entity.undeclare()

        self._ours[endpoint.number] = endpoint, name
        self._compare(endpoint, name)
        self._ends[endpoint.number] = end  # Zenoh ends an endpoint without a reference
        return end

    def _changed(self, sample: zenoh.Sample) -> None:
        """Update the graph; called in a thread of Zenoh."""
        update = self._graph.add if sample.kind == zenoh.SampleKind.PUT else self._graph.remove
        update(str(sample.key_expr))


def join(name: str, definitions: Definitions, domain: Domain, report: Report | None) -> ZenohNode:
    return ZenohNode(name, definitions, domain.url, domain.number, report)


class _Publisher(Publisher):
    def __init__(
        self,
        publisher: zenoh.Publisher | ext.AdvancedPublisher,
        gid: bytes,
        encode: Callable[[Mapping[str, Any]], bytes],
        subscriptions: Callable[[], frozenset[int]],
        end: Callable[[], None],
    ) -> None:
        self._publisher, self._gid, self._encode = publisher, gid, encode
        self._subscriptions, self._end = subscriptions, end
        self._numbers = count(1)

    def publish(self, message: Mapping[str, Any]) -> None:
        data = self._encode(message)
        attachment = bytes(MessageAttachment(next(self._numbers), time.time_ns(), self._gid))
        try:
            self._publisher.put(data, attachment=attachment)
        except zenoh.ZError as error:
            raise Ros2Error(f"Zenoh does not take a message: {error}") from None

    @property
    def subscriptions(self) -> int:
        return len(self._subscriptions())

    def close(self) -> None:
        self._end()


class _Client(Client):
    put: Callable[[tuple[int, zenoh.Reply | None]], None]
    end: Callable[[], None]

    def __init__(
        self,
        querier: zenoh.Querier,
        gid: bytes,
        encode: Callable[[Mapping[str, Any]], bytes],
        decode: Callable[[bytes], Any],
        servers: Callable[[], frozenset[int]],
        why: Callable[[], str],
    ) -> None:
        self._querier, self._gid, self._encode, self._decode = querier, gid, encode, decode
        self._servers, self._why = servers, why
        self._waiting: dict[int, tuple[Receive, Failed | None]] = {}
        self._numbers = count(1)

    def call(self, request: Mapping[str, Any], done: Receive, failed: Failed | None = None) -> int:
        data = self._encode(request)
        number = next(self._numbers)
        self._waiting[number] = done, failed
        attachment = bytes(MessageAttachment(number, time.time_ns(), self._gid))
        came: Callback[zenoh.Reply] = Callback(
            lambda reply: self.put((number, reply)), lambda: self.put((number, None))
        )
        try:
            self._querier.get(came, payload=data, attachment=attachment)
        except zenoh.ZError as error:
            del self._waiting[number]
            raise Ros2Error(f"Zenoh does not take a request: {error}") from None
        return number

    def forget(self, number: int) -> None:
        self._waiting.pop(number, None)

    def take(self, came: tuple[int, zenoh.Reply | None]) -> None:
        """Handle a response, an error, or the end of responses."""
        number, reply = came
        done, failed = self._waiting.pop(number, (None, None))
        if done is None:
            return  # a second response, or a response to a forgotten request
        try:
            response = self._decode(_answered(reply))
        except Ros2Error as error:
            if failed is not None:
                failed(str(error))
            return
        done(response)

    @property
    def servers(self) -> frozenset[int]:
        return self._servers()

    def why_unserved(self) -> str:
        return self._why()

    def close(self) -> None:
        self.end()


def _called(call: Callable[[Any], None], drop: Callable[[], None] | None = None) -> Callback[Any]:
    """Return a callback that runs in Zenoh's own thread: it must not block."""
    return Callback(call, drop, indirect=False)


def _declared_publisher(
    session: zenoh.Session, key: str, qos: QosProfile
) -> zenoh.Publisher | ext.AdvancedPublisher:
    reliable = qos.reliability == "reliable"
    options: Any = {
        # as in rmw_zenoh_cpp, so that no reader blocks us
        "congestion_control": zenoh.CongestionControl.DROP,
        "reliability": zenoh.Reliability.RELIABLE if reliable else zenoh.Reliability.BEST_EFFORT,
    }
    if qos.durability != "transient_local":
        return session.declare_publisher(key, **options)
    if reliable:
        options["sample_miss_detection"] = ext.MissDetectionConfig(
            heartbeat=None, sporadic_heartbeat=_HEARTBEAT_S
        )
    return ext.declare_advanced_publisher(
        session,
        key,
        cache=ext.CacheConfig(max_samples=max(1, qos.depth)),
        publisher_detection=True,
        **options,
    )


def _declared_subscriber(
    session: zenoh.Session, key: str, put: Callback[zenoh.Sample], qos: QosProfile
) -> zenoh.Subscriber[None] | ext.AdvancedSubscriber[None]:
    if qos.durability != "transient_local":
        return session.declare_subscriber(key, put)
    history = ext.HistoryConfig(detect_late_publishers=True, max_samples=max(1, qos.depth))
    recovery = ext.RecoveryConfig(periodic_queries=None, heartbeat=True)
    return ext.declare_advanced_subscriber(
        session,
        key,
        put,
        history=history,
        recovery=recovery if qos.reliability == "reliable" else None,
        subscriber_detection=True,
    )


def _reply(query: zenoh.Query, key: str, data: bytes) -> None:
    """Answer a query; the client may be gone."""
    attachment = _bytes(query.attachment)
    request_attachment = attachment_of(attachment)
    sent = (
        attachment
        if request_attachment is None
        else bytes(MessageAttachment(request_attachment.number, time.time_ns(), request_attachment.gid))
    )
    try:
        query.reply(key, data, attachment=sent)
        query.drop()
    except zenoh.ZError:
        return


def _answered(reply: zenoh.Reply | None) -> bytes:
    if reply is None:
        raise Ros2Error("the server has not answered: it is gone, or has taken too long")
    if reply.err is not None:
        raise Ros2Error(reply.err.payload.to_bytes().decode(errors="replace"))
    return b"" if reply.ok is None else reply.ok.payload.to_bytes()


def _bytes(data: zenoh.ZBytes | None) -> bytes:
    return b"" if data is None else data.to_bytes()
