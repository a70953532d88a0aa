"""ROS 2 by its own client library in a sourced ROS 2 environment, with any RMW.

Messages go through CDR (:mod:`cxbridge_ros2.messages`) for the same checks as in other transports: topics
carry the bytes, and rclpy makes objects from them for services.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import partial
from importlib import import_module
from typing import Any, Final

from cxbridge.errors import Ros2Error
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.messages import EMPTY_MESSAGE_FIELD, Codec, Message
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
from cxbridge_ros2.transports.environment import MAX_DDS_DOMAIN

# Members of an action's Python class (`Impl`), by the suffix of their types.
_ACTION_MEMBERS: Final = {
    "SendGoal": "SendGoalService",
    "GetResult": "GetResultService",
    "FeedbackMessage": "FeedbackMessage",
}

_BATCH: Final = 256  # callbacks per poll, so that a fast topic does not starve the loop


class RclpyNode(Node):
    """A node of rclpy.

    :param definitions: the types, which must equal those of the sourced environment.
    :param domain: the domain; by default ``ROS_DOMAIN_ID``.
    :param report: see the base class.
    :raises Ros2Error: if ROS cannot start.
    """

    def __init__(
        self,
        name: str,
        definitions: Definitions,
        domain: int | None = None,
        report: ProblemCallback | None = None,
    ) -> None:
        super().__init__(report)
        self.name = name
        self._definitions = definitions
        self._codec = Codec(definitions)
        self._rclpy = rclpy = _import_rclpy()
        if domain is not None and domain > MAX_DDS_DOMAIN and "zenoh" not in _rmw(rclpy):
            # some RMWs abort the process for an invalid domain
            raise Ros2Error(f"there is no domain {domain}: the last of {_rmw(rclpy)} is {MAX_DDS_DOMAIN}")
        self._context = rclpy.context.Context()
        try:
            rclpy.init(
                args=[],
                context=self._context,
                domain_id=domain,
                signal_handler_options=rclpy.signals.SignalHandlerOptions.NO,
            )
            self._node = rclpy.create_node(
                name,
                context=self._context,
                use_global_arguments=False,
                start_parameter_services=False,  # the class Parameters serves them
                enable_rosout=False,
            )
        except Exception as error:  # noqa: BLE001 - rclpy's errors have no common base class
            raise Ros2Error(
                f"rclpy cannot begin: {_one_line(error)}",
                hint="are ROS_DOMAIN_ID and RMW_IMPLEMENTATION right, and is this RMW installed?",
            ) from None
        self._executor = rclpy.executors.SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._received = 0  # number of messages so far

    # --- the interface of a node --------------------------------------------------------------------------

    def create_publisher(
        self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]
    ) -> Publisher:
        name = parse_type(message_type)
        rcl_publisher = self._node.create_publisher(
            self._message_class(name), check_topic(topic), self._qos(qos)
        )
        return Publisher(
            lambda message: rcl_publisher.publish(self._codec.encode(name, message)),
            lambda: int(rcl_publisher.get_subscription_count()),
            self._make_closer("publisher", rcl_publisher),
        )

    def _subscribe(
        self, topic: str, message_type: str, callback: MessageCallback, qos: QosProfile
    ) -> Callable[[], None]:
        name = parse_type(message_type)

        def take(data: bytes) -> None:
            self._received += 1
            message = self._try_decode(topic, partial(self._codec.decode, name, data))
            if message is not None:
                callback(message)

        rcl_subscription = self._node.create_subscription(
            self._message_class(name), check_topic(topic), take, self._qos(qos), raw=True
        )
        return self._make_closer("subscription", rcl_subscription)

    def create_client(self, service: str, service_type: str) -> Client:
        name = parse_type(service_type, "srv")
        kind = self._service_class(name)
        rcl_client = self._node.create_client(
            kind, check_topic(service), qos_profile=self._qos(PROFILES["services_default"])
        )
        request, response = name.derive("Request"), name.derive("Response")

        def encode(message: Mapping[str, Any]) -> Any:
            return self._to_object(kind.Request, request, message)

        def decode(message: Any) -> Message:
            self._received += 1
            return self._from_object(response, message)

        return _Client(
            rcl_client,
            encode,
            decode,
            lambda: self._servers(rcl_client, service),
            self._make_closer("client", rcl_client),
        )

    def _serve_later(self, service: str, service_type: str, handler: RequestHandler) -> Callable[[], None]:
        name = parse_type(service_type, "srv")
        kind = self._service_class(name)
        request, response = name.derive("Request"), name.derive("Response")

        def take(message: Any, _response: object) -> _Response:
            self._received += 1
            response_later = _Response(lambda reply: self._to_object(kind.Response, response, reply))
            handler(self._from_object(request, message), response_later.reply)
            return response_later

        rcl_service = self._node.create_service(
            kind, check_topic(service), take, qos_profile=self._qos(PROFILES["services_default"])
        )
        # in rclpy, a later response takes a coroutine, which would keep its executor busy until the response
        send = rcl_service.send_response
        rcl_service.send_response = lambda later, header: later.send_with(lambda reply: send(reply, header))
        return self._make_closer("service", rcl_service)

    def poll(self, timeout_s: float = 0.0) -> bool:
        received_before = self._received
        self._executor.spin_once(timeout_sec=max(0.0, timeout_s))  # one callback
        for _ in range(_BATCH):
            received = self._received
            self._executor.spin_once(timeout_sec=0.0)
            if received == self._received:
                break
        return self._received != received_before

    def close(self) -> None:
        if self._context.ok():
            self._executor.shutdown()
            self._node.destroy_node()
            self._rclpy.shutdown(context=self._context)

    # --- rclpy --------------------------------------------------------------------------------------------

    def _make_closer(self, kind: str, entity: Any) -> Callable[[], None]:
        """Return the function that closes an entity of this node."""
        destroy = getattr(self._node, f"destroy_{kind}")
        return lambda: destroy(entity) if self._context.ok() else None

    def _servers(self, client: Any, service: str) -> frozenset[int]:
        if not self._context.ok() or not client.service_is_ready():
            return frozenset()
        publishers = self._node.get_publishers_info_by_topic(f"rr{service}Reply", no_mangle=True)
        # an RMW without DDS has no such topics; then all servers count as one
        gids = (bytes(publisher.endpoint_gid) for publisher in publishers)
        return frozenset(int.from_bytes(gid, "big") for gid in gids) or frozenset({0})

    def _message_class(self, name: TypeName) -> Any:
        """Return the Python class of a message."""
        self._definitions.fields(name)  # raises the error about an unknown type
        message_class = _python_class(name)
        self._check_fields(name, message_class)
        return message_class

    def _service_class(self, name: TypeName) -> Any:
        """Return the Python class of a service."""
        self._definitions.fields(name.derive("Request"))  # raises the error about an unknown type
        service_class = _python_class(name)
        self._check_fields(name.derive("Request"), service_class.Request)
        self._check_fields(name.derive("Response"), service_class.Response)
        return service_class

    def _check_fields(self, name: TypeName, sourced_class: Any) -> None:
        """Check that the sourced type equals our definition, since CDR does not reveal a difference."""
        ours = [field for field, _ in self._definitions.fields(name) if field != EMPTY_MESSAGE_FIELD]
        theirs = list(sourced_class.get_fields_and_field_types())
        if ours != theirs:
            hint = "name no older package in 'packages'"
            difference = f"{', '.join(theirs) or 'nothing'}, not {', '.join(ours) or 'nothing'}"
            raise Ros2Error(f"the sourced {name} has the fields {difference}", hint=hint)

    def _to_object(self, kind: Any, name: TypeName, message: Mapping[str, Any]) -> Any:
        return self._rclpy.serialization.deserialize_message(self._codec.encode(name, message), kind)

    def _from_object(self, name: TypeName, message: Any) -> Message:
        return self._codec.decode(name, self._rclpy.serialization.serialize_message(message))

    def _qos(self, profile: QosProfile) -> Any:
        qos = self._rclpy.qos
        return qos.QoSProfile(
            depth=profile.depth,
            reliability=qos.ReliabilityPolicy[profile.reliability.upper()],
            durability=qos.DurabilityPolicy[profile.durability.upper()],
        )


def join(name: str, definitions: Definitions, domain: Domain, report: ProblemCallback | None) -> RclpyNode:
    return RclpyNode(name, definitions, domain.number, report)


class _Client(Client):
    def __init__(
        self,
        client: Any,
        encode: Callable[[Mapping[str, Any]], Any],
        decode: Callable[[Any], Message],
        servers: Callable[[], frozenset[int]],
        end: Callable[[], None],
    ) -> None:
        super().__init__()
        self._client, self._encode, self._decode = client, encode, decode
        self._servers, self._end = servers, end
        self._futures: dict[int, Any] = {}

    def call(
        self,
        request: Mapping[str, Any],
        on_response: MessageCallback,
        on_failure: FailureCallback | None = None,  # noqa: ARG002 - rclpy reports no failures
    ) -> int:
        number = next(self._numbers)
        self._futures[number] = future = self._client.call_async(self._encode(request))

        def finish(response: Any) -> None:
            if self._futures.pop(number, None) is not None:
                on_response(self._decode(response.result()))

        future.add_done_callback(finish)
        return number

    def forget(self, number: int) -> None:
        future = self._futures.pop(number, None)
        if future is not None:
            self._client.remove_pending_request(future)

    @property
    def server_numbers(self) -> frozenset[int]:
        return self._servers()

    def close(self) -> None:
        self._futures.clear()
        self._end()


class _Response:
    """A response that is sent as soon as both its content and its header are known."""

    def __init__(self, encode: Callable[[Mapping[str, Any]], Any]) -> None:
        self._encode = encode
        self._response: Any = None
        self._send: Callable[[Any], None] | None = None

    def reply(self, response: Mapping[str, Any]) -> None:
        self._response = self._encode(response)
        self._send_if_complete()

    def send_with(self, send: Callable[[Any], None]) -> None:
        self._send = send
        self._send_if_complete()

    def _send_if_complete(self) -> None:
        if self._send is not None and self._response is not None:
            self._send(self._response)


def _import_rclpy() -> Any:
    """Return rclpy with all modules that are used here."""
    try:
        for module in ("context", "executors", "qos", "serialization", "signals", "utilities"):
            import_module(f"rclpy.{module}")
        return import_module("rclpy")
    except ImportError as error:
        python = ".".join(map(str, sys.version_info[:2]))
        raise Ros2Error(
            f"rclpy is not installed: {_one_line(error)}",
            hint=f"source the setup.bash of a ROS 2 for Python {python}, or take the transport dds",
        ) from None


def _rmw(rclpy: Any) -> str:
    return str(rclpy.utilities.get_rmw_implementation_identifier())


def _python_class(name: TypeName) -> Any:
    """Return the Python class of a message or a service."""
    action, _, suffix = name.name.rpartition("_")
    try:
        module = import_module(f"{name.package}.{name.kind}")
        if name.kind == "action":
            return getattr(getattr(module, action).Impl, _ACTION_MEMBERS[suffix])
        return getattr(module, name.name)
    except (ImportError, AttributeError, KeyError) as error:
        raise Ros2Error(
            f"ROS has no {name} for Python: {_one_line(error)}",
            hint=f"source the workspace that the package {name.package} was built in",
        ) from None


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__
