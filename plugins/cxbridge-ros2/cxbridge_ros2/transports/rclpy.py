"""A node of rclpy, ROS' own client library, in a sourced ROS 2 environment with any RMW (ROS middleware).

Messages are encoded to CDR (:mod:`cxbridge_ros2.messages`) for the checks that other transports have. rclpy
sends and receives the bytes on topics; for services, rclpy converts the bytes to its objects and back.
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
from cxbridge_ros2.names import TypeName, check_ros_name, parse_type
from cxbridge_ros2.node import (
    Client,
    FailureCallback,
    MessageCallback,
    Node,
    ProblemCallback,
    Publisher,
    RequestHandler,
)
from cxbridge_ros2.qos import PROFILES, QosProfile
from cxbridge_ros2.transports.environment import MAX_DDS_DOMAIN

# The member of `Impl` in the Python class of an action, by the suffix of the type's name.
_ACTION_MEMBERS: Final = {
    "SendGoal": "SendGoalService",
    "GetResult": "GetResultService",
    "FeedbackMessage": "FeedbackMessage",
}

# callbacks per poll after the first, so that a fast topic does not starve the loop
_MAX_CALLBACKS: Final = 256


class RclpyNode(Node):
    """A node of rclpy.

    :param definitions: the types, whose fields must equal those in the sourced environment.
    :param domain: the domain; by default ``ROS_DOMAIN_ID``.
    :param report: see the base class.
    :raises Ros2Error: if rclpy is not installed, the domain does not exist, or rclpy cannot start.
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
        if domain is not None and domain > MAX_DDS_DOMAIN:
            # some RMWs abort the process for an invalid domain
            raise Ros2Error(f"the domain {domain} does not exist: the highest is {MAX_DDS_DOMAIN}")
        self._context = rclpy.context.Context()
        try:
            rclpy.init(
                args=[],
                context=self._context,
                domain_id=domain,
                # cxbridge handles signals
                signal_handler_options=rclpy.signals.SignalHandlerOptions.NO,
            )
            self._node = rclpy.create_node(
                name,
                context=self._context,
                use_global_arguments=False,  # the arguments of this process are not arguments of ROS
                start_parameter_services=False,  # the class Parameters has the services
                enable_rosout=False,  # the class RosoutPublisher publishes the log
            )
        except Exception as error:  # noqa: BLE001 - rclpy's errors have no common base class
            raise Ros2Error(
                f"rclpy cannot start: {_format_error(error)}",
                hint="are ROS_DOMAIN_ID and RMW_IMPLEMENTATION right, and is this RMW installed?",
            ) from None
        self._executor = rclpy.executors.SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._received_count = 0  # number of messages so far

    # --- the interface of a node --------------------------------------------------------------------------

    def create_publisher(
        self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]
    ) -> Publisher:
        type_name = parse_type(message_type)
        rcl_publisher = self._node.create_publisher(
            self._find_message_class(type_name), check_ros_name(topic), self._make_qos(qos)
        )
        return Publisher(
            lambda message: rcl_publisher.publish(self._codec.encode(type_name, message)),
            lambda: int(rcl_publisher.get_subscription_count()),
            self._make_close_function("publisher", rcl_publisher),
        )

    def _subscribe(
        self, topic: str, message_type: str, callback: MessageCallback, qos: QosProfile
    ) -> Callable[[], None]:
        type_name = parse_type(message_type)

        def receive(encoded_message: bytes) -> None:
            self._received_count += 1
            message = self._try_decode(topic, partial(self._codec.decode, type_name, encoded_message))
            if message is not None:
                callback(message)

        rcl_subscription = self._node.create_subscription(
            self._find_message_class(type_name), check_ros_name(topic), receive, self._make_qos(qos), raw=True
        )
        return self._make_close_function("subscription", rcl_subscription)

    def create_client(self, service: str, service_type: str) -> Client:
        type_name = parse_type(service_type, "srv")
        service_class = self._find_service_class(type_name)
        rcl_client = self._node.create_client(
            service_class, check_ros_name(service), qos_profile=self._make_qos(PROFILES["services_default"])
        )
        request, response = type_name.derive("Request"), type_name.derive("Response")

        def make_request(message: Mapping[str, Any]) -> Any:
            return self._to_object(service_class.Request, request, message)

        def count_and_convert(rcl_response: Any) -> Message:
            self._received_count += 1
            return self._from_object(response, rcl_response)

        return _Client(
            rcl_client,
            make_request,
            count_and_convert,
            lambda: self._find_server_numbers(rcl_client, service),
            self._make_close_function("client", rcl_client),
        )

    def _serve_later(self, service: str, service_type: str, handler: RequestHandler) -> Callable[[], None]:
        type_name = parse_type(service_type, "srv")
        service_class = self._find_service_class(type_name)
        request, response = type_name.derive("Request"), type_name.derive("Response")

        def receive(rcl_request: Any, _rcl_response: object) -> _DeferredResponse:
            self._received_count += 1
            deferred_response = _DeferredResponse(
                lambda fields: self._to_object(service_class.Response, response, fields)
            )
            handler(self._from_object(request, rcl_request), deferred_response.set_response)
            return deferred_response

        rcl_service = self._node.create_service(
            service_class,
            check_ros_name(service),
            receive,
            qos_profile=self._make_qos(PROFILES["services_default"]),
        )
        # rclpy supports later responses by coroutines only, which would keep its executor busy until the
        # response. Therefore the callback returns a deferred response, and a function that understands the
        # deferred response replaces rclpy's function that sends the returned object.
        send = rcl_service.send_response
        rcl_service.send_response = lambda deferred_response, header: deferred_response.set_sender(
            lambda rcl_response: send(rcl_response, header)
        )
        return self._make_close_function("service", rcl_service)

    def poll(self, timeout_s: float = 0.0) -> bool:
        count_before = self._received_count
        self._executor.spin_once(timeout_sec=max(0.0, timeout_s))  # one callback
        for _ in range(_MAX_CALLBACKS):
            received_count = self._received_count
            self._executor.spin_once(timeout_sec=0.0)
            if received_count == self._received_count:
                break
        return self._received_count != count_before

    def close(self) -> None:
        if self._context.ok():
            self._executor.shutdown()
            self._node.destroy_node()
            self._rclpy.shutdown(context=self._context)

    # --- rclpy --------------------------------------------------------------------------------------------

    def _make_close_function(self, kind: str, entity: Any) -> Callable[[], None]:
        """Return the function that destroys an entity of the node.

        :param kind: ``publisher``, ``subscription``, ``client`` or ``service``.
        """
        destroy = getattr(self._node, f"destroy_{kind}")
        return lambda: destroy(entity) if self._context.ok() else None

    def _find_server_numbers(self, client: Any, service: str) -> frozenset[int]:
        if not self._context.ok() or not client.service_is_ready():
            return frozenset()
        publishers = self._node.get_publishers_info_by_topic(f"rr{service}Reply", no_mangle=True)
        # an RMW without DDS has no such topics: all servers of a service count as one, with the number 0
        gids = (bytes(publisher.endpoint_gid) for publisher in publishers)
        return frozenset(int.from_bytes(gid, "big") for gid in gids) or frozenset({0})

    def _find_message_class(self, type_name: TypeName) -> Any:
        """Return the Python class of a message, after a check of its fields."""
        self._definitions.find_fields(type_name)  # raises the error about an unknown type
        message_class = _import_class(type_name)
        self._check_fields(type_name, message_class)
        return message_class

    def _find_service_class(self, type_name: TypeName) -> Any:
        """Return the Python class of a service, after a check of the fields of its messages."""
        self._definitions.find_fields(type_name.derive("Request"))  # raises the error about an unknown type
        service_class = _import_class(type_name)
        self._check_fields(type_name.derive("Request"), service_class.Request)
        self._check_fields(type_name.derive("Response"), service_class.Response)
        return service_class

    def _check_fields(self, type_name: TypeName, sourced_class: Any) -> None:
        """Raise `Ros2Error` if a sourced type has other fields than our definition.

        CDR contains no names of fields, so that messages of another type would be misread.
        """
        our_fields = [
            field for field, _ in self._definitions.find_fields(type_name) if field != EMPTY_MESSAGE_FIELD
        ]
        sourced_fields = list(sourced_class.get_fields_and_field_types())
        if our_fields != sourced_fields:
            hint = "remove older packages from 'packages'"
            difference = f"{', '.join(sourced_fields) or 'nothing'}, not {', '.join(our_fields) or 'nothing'}"
            raise Ros2Error(f"the sourced {type_name} has the fields {difference}", hint=hint)

    def _to_object(self, message_class: Any, type_name: TypeName, message: Mapping[str, Any]) -> Any:
        return self._rclpy.serialization.deserialize_message(
            self._codec.encode(type_name, message), message_class
        )

    def _from_object(self, type_name: TypeName, rcl_message: Any) -> Message:
        return self._codec.decode(type_name, self._rclpy.serialization.serialize_message(rcl_message))

    def _make_qos(self, profile: QosProfile) -> Any:
        qos = self._rclpy.qos
        return qos.QoSProfile(
            depth=profile.depth,
            reliability=qos.ReliabilityPolicy[profile.reliability.upper()],
            durability=qos.DurabilityPolicy[profile.durability.upper()],
        )


class _Client(Client):
    """A client of a service.

    :param client: the client of rclpy.
    :param make_request: makes an object of rclpy from a request.
    :param convert_response: returns the message in an object of rclpy.
    """

    def __init__(
        self,
        client: Any,
        make_request: Callable[[Mapping[str, Any]], Any],
        convert_response: Callable[[Any], Message],
        find_server_numbers: Callable[[], frozenset[int]],
        close_client: Callable[[], None],
    ) -> None:
        super().__init__()
        self._client, self._make_request, self._convert_response = client, make_request, convert_response
        self._find_server_numbers, self._close_client = find_server_numbers, close_client
        self._futures: dict[int, Any] = {}

    def call(
        self,
        request: Mapping[str, Any],
        on_response: MessageCallback,
        on_failure: FailureCallback | None = None,  # noqa: ARG002 - rclpy reports no failures
    ) -> int:
        number = next(self._numbers)
        self._futures[number] = future = self._client.call_async(self._make_request(request))

        def finish(done_future: Any) -> None:
            if self._futures.pop(number, None) is not None:
                on_response(self._convert_response(done_future.result()))

        future.add_done_callback(finish)
        return number

    def forget(self, number: int) -> None:
        future = self._futures.pop(number, None)
        if future is not None:
            self._client.remove_pending_request(future)

    @property
    def server_numbers(self) -> frozenset[int]:
        return self._find_server_numbers()

    def close(self) -> None:
        self._futures.clear()
        self._close_client()


class _DeferredResponse:
    """A response that is sent when the handler has given the content, and rclpy the function to send.

    :param make_response: makes an object of rclpy from a response.
    """

    def __init__(self, make_response: Callable[[Mapping[str, Any]], Any]) -> None:
        self._make_response = make_response
        self._rcl_response: Any = None
        self._sender: Callable[[Any], None] | None = None

    def set_response(self, response: Mapping[str, Any]) -> None:
        self._rcl_response = self._make_response(response)
        self._send_if_complete()

    def set_sender(self, send: Callable[[Any], None]) -> None:
        self._sender = send
        self._send_if_complete()

    def _send_if_complete(self) -> None:
        if self._sender is not None and self._rcl_response is not None:
            self._sender(self._rcl_response)


def _import_rclpy() -> Any:
    """Import rclpy and the modules of rclpy that this module uses."""
    try:
        for module in ("context", "executors", "qos", "serialization", "signals"):
            import_module(f"rclpy.{module}")
        return import_module("rclpy")
    except ImportError as error:
        python = ".".join(map(str, sys.version_info[:2]))
        raise Ros2Error(
            f"rclpy is not installed: {_format_error(error)}",
            hint=f"source the setup.bash of a ROS 2 for Python {python}, or use the transport dds",
        ) from None


def _import_class(type_name: TypeName) -> Any:
    """Import the Python class of a message or a service, which may be derived from an action."""
    action, _, suffix = type_name.name.rpartition("_")
    try:
        module = import_module(f"{type_name.package}.{type_name.kind}")
        if type_name.kind == "action":
            return getattr(getattr(module, action).Impl, _ACTION_MEMBERS[suffix])
        return getattr(module, type_name.name)
    except (ImportError, AttributeError, KeyError) as error:
        raise Ros2Error(
            f"{type_name} has no Python class: {_format_error(error)}",
            hint=f"source the workspace that the package {type_name.package} was built in",
        ) from None


def _format_error(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__
