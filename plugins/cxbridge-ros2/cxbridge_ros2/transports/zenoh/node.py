"""A node on Zenoh with the Python package of Eclipse Zenoh, for robots with rmw_zenoh_cpp.

Messages have keys that contain their type, a service is a queryable of Zenoh, and liveliness tokens announce
endpoints. Since Zenoh calls back in its own threads, received messages wait until the node is polled.
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
from cxbridge_ros2.names import TypeName, check_topic, parse_type
from cxbridge_ros2.node import (
    Client,
    Domain,
    FailureCallback,
    MessageCallback,
    Node,
    ProblemCallback,
    Publisher,
    RequestHandler,
)
from cxbridge_ros2.qos import PROFILES, QosProfile
from cxbridge_ros2.transports.environment import read_domain_id
from cxbridge_ros2.transports.mismatches import describe_mismatch, find_public_name
from cxbridge_ros2.transports.zenoh.graph import RosGraph
from cxbridge_ros2.transports.zenoh.inbox import InboxSource, MessageInbox
from cxbridge_ros2.transports.zenoh.names import (
    NO_HASH,
    EndpointKind,
    GraphEndpoint,
    MessageAttachment,
    NodeName,
    make_token_pattern,
    make_typed_name,
    parse_attachment,
)
from cxbridge_ros2.transports.zenoh.session import open_session

_SERVICE_QOS: Final = PROFILES["services_default"]
_HEARTBEAT_PERIOD_S: Final = 0.5  # time until a subscription notices that it has missed the last message
_REQUEST_TIMEOUT_S: Final = 600.0  # time until a request counts as failed
_RESULT_TIMEOUT_S: Final = 1e9  # the same for the result of a goal, which may take any time
# The kind of the matching endpoints and ROS' term for them, by the kind of an endpoint.
_PEERS: Final[Mapping[EndpointKind, tuple[EndpointKind, str]]] = {
    "MP": ("MS", "subscription"),
    "MS": ("MP", "publisher"),
    "SS": ("SC", "client"),
    "SC": ("SS", "server"),
}

_GET_RESULT_SUFFIX: Final = "/_action/get_result"


class ZenohNode(Node):
    """A node on Zenoh.

    :param url: the router, such as ``tcp/robot:7447``; empty for the router in the environment or on this
        host.
    :param domain: the domain; by default ``ROS_DOMAIN_ID``.
    :param report: see the base class.
    :raises Ros2Error: if there is no router.
    """

    def __init__(
        self,
        name: str,
        definitions: Definitions,
        url: str = "",
        domain: int | None = None,
        report: ProblemCallback | None = None,
    ) -> None:
        super().__init__(report)
        self._definitions = definitions
        self._codec = Codec(definitions)
        self._domain = read_domain_id() if domain is None else domain
        self._session = open_session(url)
        self._node_name = NodeName(self._domain, str(self._session.zid()), 0, name)
        self._numbers = count(1)
        self._inbox = MessageInbox()
        self._close_functions: dict[int, Callable[[], None]] = {}
        self._endpoints: dict[int, tuple[GraphEndpoint, TypeName]] = {}
        self._compared_version = -1
        self._graph = RosGraph()
        liveliness = self._session.liveliness()
        # referenced, since Zenoh ends a subscription or a token when its Python object is deleted
        self._token_subscriber = liveliness.declare_subscriber(
            make_token_pattern(self._domain), _make_direct_callback(self._update_graph), history=True
        )
        self._node_token = liveliness.declare_token(self._node_name.token)

    # --- the interface of a node --------------------------------------------------------------------------

    def create_publisher(
        self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]
    ) -> Publisher:
        type_name = parse_type(message_type)
        endpoint = self._make_endpoint("MP", topic, type_name, qos)
        zenoh_publisher = _declare_publisher(self._session, endpoint.topic.make_key(self._domain), qos)
        gid, numbers = endpoint.gid, count(1)

        def publish(message: Mapping[str, Any]) -> None:
            data = self._codec.encode(type_name, message)
            attachment = bytes(MessageAttachment(next(numbers), time.time_ns(), gid))
            try:
                zenoh_publisher.put(data, attachment=attachment)
            except zenoh.ZError as error:
                raise Ros2Error(f"Zenoh rejects a message: {error}") from None

        return Publisher(
            publish,
            lambda: len(self._graph.find_endpoint_numbers("MS", endpoint.topic)),
            self._announce(endpoint, type_name, zenoh_publisher),
        )

    def _subscribe(
        self, topic: str, message_type: str, callback: MessageCallback, qos: QosProfile
    ) -> Callable[[], None]:
        type_name = parse_type(message_type)
        endpoint = self._make_endpoint("MS", topic, type_name, qos)

        def handle_sample(sample: zenoh.Sample) -> None:
            if sample.kind == zenoh.SampleKind.PUT:
                message = self._try_decode(
                    topic, lambda: self._codec.decode(type_name, sample.payload.to_bytes())
                )
                if message is not None:
                    callback(message)

        source = InboxSource(handle_sample, max(1, qos.depth))
        queue_sample = _make_direct_callback(partial(self._inbox.put, source))
        zenoh_subscriber = _declare_subscriber(
            self._session, endpoint.topic.make_key(self._domain), queue_sample, qos
        )
        return self._announce(endpoint, type_name, zenoh_subscriber, source)

    def create_client(self, service: str, service_type: str) -> Client:
        type_name = parse_type(service_type, "srv")
        endpoint = self._make_endpoint("SC", service, type_name, _SERVICE_QOS)
        querier = self._session.declare_querier(
            endpoint.topic.make_key(self._domain),
            # each server gets the request, and the first response counts, as in rmw_zenoh_cpp
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=_RESULT_TIMEOUT_S if service.endswith(_GET_RESULT_SUFFIX) else _REQUEST_TIMEOUT_S,
        )
        client = _Client(querier, endpoint, type_name, self._codec, self._graph)
        source = InboxSource(client.handle_reply, 0)
        client.queue_reply = partial(self._inbox.put, source)
        client.close_endpoint = self._announce(endpoint, type_name, querier, source)
        return client

    def _serve_later(self, service: str, service_type: str, handler: RequestHandler) -> Callable[[], None]:
        type_name = parse_type(service_type, "srv")
        endpoint = self._make_endpoint("SS", service, type_name, _SERVICE_QOS)
        key = endpoint.topic.make_key(self._domain)
        encode = partial(self._codec.encode, type_name.derive("Response"))

        def handle_query(query: zenoh.Query) -> None:
            try:
                request = self._codec.decode(type_name.derive("Request"), _read_bytes(query.payload))
            except Ros2Error as error:  # a client may send any bytes
                self.complain(f"broken {service}", f"{service}: {error.message}")
                query.reply_err(str(error))
                query.drop()
                return
            handler(request, lambda response: _send_reply(query, key, encode(response)))

        source = InboxSource(handle_query, _SERVICE_QOS.depth)
        # complete, since the server responds to each request with its key
        return self._announce(
            endpoint,
            type_name,
            self._session.declare_queryable(
                key, _make_direct_callback(partial(self._inbox.put, source)), complete=True
            ),
            source,
        )

    def poll(self, timeout_s: float = 0.0) -> bool:
        if self._compared_version != self._graph.version:
            self._compared_version = self._graph.version
            for endpoint, type_name in self._endpoints.values():
                self._compare_types(endpoint, type_name)
        return self._inbox.deliver(timeout_s)

    def close(self) -> None:
        for close_endpoint in list(self._close_functions.values()):
            close_endpoint()
        if not self._session.is_closed():
            self._session.close()

    # --- Zenoh --------------------------------------------------------------------------------------------

    def _make_endpoint(
        self, kind: EndpointKind, topic: str, type_name: TypeName, qos: QosProfile
    ) -> GraphEndpoint:
        is_service = kind in ("SS", "SC")
        return GraphEndpoint(
            self._node_name,
            next(self._numbers),
            kind,
            make_typed_name(check_topic(topic), type_name, self._definitions, is_service=is_service),
            qos,
        )

    def _compare_types(self, endpoint: GraphEndpoint, type_name: TypeName) -> None:
        """Complain about endpoints of other nodes with the same name and another type."""
        peer_kind, peer = _PEERS[endpoint.kind]
        name, our_hash = find_public_name(endpoint.topic.name), _find_known_hash(endpoint.topic.type_hash)
        for topic in self._graph.find_topics(peer_kind, endpoint.topic.name):
            their_hash = _find_known_hash(topic.type_hash)
            if text := describe_mismatch(name, peer, topic.dds_type, their_hash, type_name, our_hash):
                self.complain(f"type {name} {peer}", text)

    def _announce(
        self, endpoint: GraphEndpoint, type_name: TypeName, entity: Any, source: InboxSource | None = None
    ) -> Callable[[], None]:
        """Announce an endpoint; return the function that closes the endpoint.

        :param entity: the object of Zenoh that sends or receives.
        """
        token = self._session.liveliness().declare_token(endpoint.token)

        def close_endpoint() -> None:
            if self._close_functions.pop(endpoint.number, None) is None:
                return
            del self._endpoints[endpoint.number]
            if source is not None:
                self._inbox.close_source(source)
            token.undeclare()
            entity.undeclare()

        self._endpoints[endpoint.number] = endpoint, type_name
        self._compare_types(endpoint, type_name)
        # also a reference to the token and the entity, which Zenoh ends when their Python objects are deleted
        self._close_functions[endpoint.number] = close_endpoint
        return close_endpoint

    def _update_graph(self, sample: zenoh.Sample) -> None:
        """Update the graph; called in a thread of Zenoh."""
        update = self._graph.add if sample.kind == zenoh.SampleKind.PUT else self._graph.remove
        update(str(sample.key_expr))


def join(name: str, definitions: Definitions, domain: Domain, report: ProblemCallback | None) -> ZenohNode:
    return ZenohNode(name, definitions, domain.url, domain.number, report)


class _Client(Client):
    """A client of a service. A request is a query, whose replies arrive in threads of Zenoh.

    :ivar queue_reply: queues the number of a request and a reply for the polling thread. None stands for the
        end of the replies.
    :ivar close_endpoint: closes the endpoint.
    """

    queue_reply: Callable[[tuple[int, zenoh.Reply | None]], None]
    close_endpoint: Callable[[], None]

    def __init__(
        self,
        querier: zenoh.Querier,
        endpoint: GraphEndpoint,
        type_name: TypeName,
        codec: Codec,
        graph: RosGraph,
    ) -> None:
        super().__init__()
        self._querier, self._endpoint, self._type_name = querier, endpoint, type_name
        self._codec, self._graph, self._gid = codec, graph, endpoint.gid

    def call(
        self,
        request: Mapping[str, Any],
        on_response: MessageCallback,
        on_failure: FailureCallback | None = None,
    ) -> int:
        data = self._codec.encode(self._type_name.derive("Request"), request)
        number = self._register_request(on_response, on_failure)
        attachment = bytes(MessageAttachment(number, time.time_ns(), self._gid))
        callback: Callback[zenoh.Reply] = Callback(
            lambda reply: self.queue_reply((number, reply)), lambda: self.queue_reply((number, None))
        )
        try:
            self._querier.get(callback, payload=data, attachment=attachment)
        except zenoh.ZError as error:
            self.forget(number)
            raise Ros2Error(f"Zenoh rejects a request: {error}") from None
        return number

    def handle_reply(self, numbered_reply: tuple[int, zenoh.Reply | None]) -> None:
        """Handle a response, an error, or the end of the replies."""
        number, reply = numbered_reply
        on_response, on_failure = self._pending_callbacks.pop(number, (None, None))
        if on_response is None:
            return  # a response of a further server, or to a forgotten request
        try:
            response = self._codec.decode(self._type_name.derive("Response"), _read_payload(reply))
        except Ros2Error as error:
            if on_failure is not None:
                on_failure(str(error))
            return
        on_response(response)

    @property
    def server_numbers(self) -> frozenset[int]:
        return self._graph.find_endpoint_numbers("SS", self._endpoint.topic)

    def explain_missing_server(self) -> str:
        return self._graph.describe_missing_server(
            self._endpoint.topic, self._type_name, f"the domain {self._endpoint.node.domain}"
        )

    def close(self) -> None:
        self.close_endpoint()


def _find_known_hash(type_hash: str) -> str:
    return "" if type_hash == NO_HASH else type_hash


def _make_direct_callback(call: Callable[[Any], None]) -> Callback[Any]:
    """Return a callback that Zenoh calls in its own threads, without a thread of Python between.

    The function must not block.
    """
    return Callback(call, None, indirect=False)


def _declare_publisher(
    session: zenoh.Session, key: str, qos: QosProfile
) -> zenoh.Publisher | ext.AdvancedPublisher:
    is_reliable = qos.reliability == "reliable"
    options: Any = {
        # as in rmw_zenoh_cpp, so that no reader blocks us
        "congestion_control": zenoh.CongestionControl.DROP,
        "reliability": zenoh.Reliability.RELIABLE if is_reliable else zenoh.Reliability.BEST_EFFORT,
    }
    if qos.durability != "transient_local":
        return session.declare_publisher(key, **options)
    if is_reliable:
        options["sample_miss_detection"] = ext.MissDetectionConfig(
            heartbeat=None, sporadic_heartbeat=_HEARTBEAT_PERIOD_S
        )
    # as in rmw_zenoh_cpp: late subscriptions find the publisher, and query its cache
    return ext.declare_advanced_publisher(
        session,
        key,
        cache=ext.CacheConfig(max_samples=max(1, qos.depth)),
        publisher_detection=True,
        **options,
    )


def _declare_subscriber(
    session: zenoh.Session, key: str, queue_sample: Callback[zenoh.Sample], qos: QosProfile
) -> zenoh.Subscriber[None] | ext.AdvancedSubscriber[None]:
    if qos.durability != "transient_local":
        return session.declare_subscriber(key, queue_sample)
    # as in rmw_zenoh_cpp: queries for the messages before the subscription, and for missed messages
    history = ext.HistoryConfig(detect_late_publishers=True, max_samples=max(1, qos.depth))
    recovery = ext.RecoveryConfig(periodic_queries=None, heartbeat=True)
    return ext.declare_advanced_subscriber(
        session,
        key,
        queue_sample,
        history=history,
        recovery=recovery if qos.reliability == "reliable" else None,
        subscriber_detection=True,
    )


def _send_reply(query: zenoh.Query, key: str, data: bytes) -> None:
    """Send the response to a query, unless the client is gone."""
    attachment = _read_bytes(query.attachment)
    # The client finds its request by the number and the GID in the attachment of the response. An attachment
    # of an unknown format is sent back unchanged.
    if request := parse_attachment(attachment):
        attachment = bytes(MessageAttachment(request.number, time.time_ns(), request.gid))
    try:
        query.reply(key, data, attachment=attachment)
        query.drop()
    except zenoh.ZError:
        return  # the client is gone


def _read_payload(reply: zenoh.Reply | None) -> bytes:
    if reply is None:
        raise Ros2Error("the server has not answered: it is gone, or has taken too long")
    if reply.err is not None:
        raise Ros2Error(reply.err.payload.to_bytes().decode(errors="replace"))
    return b"" if reply.ok is None else reply.ok.payload.to_bytes()


def _read_bytes(data: zenoh.ZBytes | None) -> bytes:
    return b"" if data is None else data.to_bytes()
