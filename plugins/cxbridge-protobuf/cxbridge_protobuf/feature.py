"""The feature ``protobuf``: functions for rules that create, read, send and receive protobuf messages.

Rules refer to a message by an external address, a handle of the message. CLIPS cannot know when the last copy
of an address is gone, so a handle is valid until a rule passes it to ``pb-destroy``, or stores its
message in a field, as in Fawkes.
docs/evidence/protocol-protobuf.md describes the functions and the protocol.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from cxbridge.clock import split_us
from cxbridge.errors import ClipsError, ProtobufError
from cxbridge.events import Logger
from cxbridge.executive.feature import Feature
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress, Symbol, Value
from cxbridge_protobuf import fields
from cxbridge_protobuf.inbox import ConnectionChange, LinkRole, ReceivedMessage
from cxbridge_protobuf.settings import CONNECTIONS_KEY, ProtobufSettings
from cxbridge_protobuf.socket_connections import SocketConnections
from cxbridge_protobuf.types import MessageTypes, make_frame

if TYPE_CHECKING:
    from cxbridge.run.agent import Run
    from cxbridge_protobuf.connections import Connections, MakeConnections
    from cxbridge_protobuf.fields import MessageField
    from cxbridge_protobuf.frames import Frame

_CLIPS_FILE = Path(__file__).with_name("protobuf.clp")
_LOG_COMPONENT = "CLIPS-Protobuf"
_FIRST_HANDLE = 1 << 40  # differs from 0, the null pointer, and from the addresses of other features

_INVALID_MESSAGE = Symbol("INVALID-MESSAGE")
_UNKNOWN_FIELD = Symbol("DOES-NOT-EXIST")
_NOT_SET = Symbol("NOT-SET")


class ProtobufState:
    """The feature's state in an environment: its message types, messages and connections.

    The log lines about problems that Fawkes logs, too, follow the texts of Fawkes.
    """

    def __init__(
        self, env: ClipsEnvironment, settings: ProtobufSettings, make_connections: MakeConnections | None
    ) -> None:
        self._env = env
        self._log: Logger = env.bus.logger(_LOG_COMPONENT)
        self.types = MessageTypes(self._log.warn)
        self.types.add_folders(settings.folders)
        now_us = env.bus.clock.now_us
        self.connections: Connections = (
            SocketConnections(self.types, now_us, settings.server_address)
            if make_connections is None
            else make_connections(self.types, now_us)
        )
        self._messages: dict[int, Any] = {}
        self._handles = itertools.count(_FIRST_HANDLE)

    def define(self) -> None:
        """Define the functions ``pb-...`` in the environment."""
        # CLIPS' codes for the types of arguments: the default (*: any type), then a code for each argument
        # (e: external address, sy: symbol or string, l: integer)
        message_only, message_and_field = "*;e", "*;e;sy"
        definitions: Iterable[tuple[str, Callable[..., Value], int, str]] = (
            ("pb-register-type", self.register, 1, "*;sy"),
            ("pb-create", self._create_message, 1, "*;sy"),
            ("pb-ref", self._copy_reference, 1, message_only),
            ("pb-destroy", self._destroy_message, 1, message_only),
            ("pb-field-names", self._get_field_names, 1, message_only),
            ("pb-field-type", partial(self._describe_field, fields.field_type), 2, message_and_field),
            ("pb-field-label", partial(self._describe_field, fields.field_label), 2, message_and_field),
            ("pb-has-field", self._has_field, 2, message_and_field),
            ("pb-field-is-list", self._is_list_field, 2, message_and_field),
            ("pb-field-value", self._get_value, 2, message_and_field),
            ("pb-field-list", self._get_list, 2, message_and_field),
            ("pb-set-field", partial(self._change_field, "set"), 3, message_and_field),
            ("pb-add-list", partial(self._change_field, "add"), 3, message_and_field),
            ("pb-tostring", self._to_string, 1, message_only),
            ("pb-server-enable", self._enable_server, 1, "*;l"),
            ("pb-server-disable", self.connections.disable_server, 0, "*"),
            ("pb-connect", self.connections.connect, 2, "*;sy;l"),
            ("pb-disconnect", self.connections.disconnect, 1, "*;l"),
            ("pb-send", partial(self._send_message, self.connections.send, "send"), 2, "*;l;e"),
            (
                "pb-broadcast",
                partial(self._send_message, self.connections.broadcast, "broadcast"),
                2,
                "*;l;e",
            ),
            ("pb-peer-create", lambda host, port: self._create_peer(host, port, port), 2, "*;sy;l"),
            ("pb-peer-create-local", self._create_peer, 3, "*;sy;l;l"),
            (
                "pb-peer-create-crypto",
                lambda host, port, *crypto: self._create_peer(host, port, port, *crypto),
                4,
                "*;sy;l;sy;sy",
            ),
            ("pb-peer-create-local-crypto", self._create_peer, 5, "*;sy;l;l;sy;sy"),
            ("pb-peer-destroy", self.connections.destroy_peer, 1, "*;l"),
            ("pb-peer-setup-crypto", self._setup_crypto, 3, "*;l;sy;sy"),
        )
        for name, function, argument_count, types in definitions:
            self._env.define(name, function, argument_count, types=types)

    # --- messages ---------------------------------------------------------------------------------------

    def _add_message(self, message: Any) -> ExternalAddress:
        handle = next(self._handles)
        self._messages[handle] = message
        return ExternalAddress(handle)

    def _find_message(self, address: Value) -> Any:
        """Return the message at an address; None if the address is unknown."""
        return self._messages.get(address.handle) if isinstance(address, ExternalAddress) else None

    def register(self, full_name: str) -> Value:
        """Register a type, as ``pb-register-type`` does."""
        try:
            self.types.register(full_name)
        except ProtobufError as error:
            self._log.error(f"Registering type {full_name} failed: {error.message}")
            return FALSE
        return TRUE

    def _create_message(self, full_name: str) -> Value:
        try:
            return self._add_message(self.types.create(full_name))
        except ProtobufError as error:
            self._log.warn(f"Cannot create message of type {full_name}: {error.message}")
            return ExternalAddress(0)

    def delete_messages(self) -> None:
        """Delete all messages."""
        self._messages.clear()

    def _copy_reference(self, address: Value) -> Value:
        message = self._find_message(address)
        return ExternalAddress(0) if message is None else self._add_message(message)

    def _destroy_message(self, address: Value) -> None:
        if isinstance(address, ExternalAddress):
            self._messages.pop(address.handle, None)

    def _to_string(self, address: Value) -> Value:
        message = self._find_message(address)
        if message is None:
            self._log.warn("Cannot convert message to string: invalid message")
            return ""
        return self.format_message(message)

    def format_message(self, message: Any) -> str:
        """Return the text of a message for ``pb-tostring``. Subclasses may override this method."""
        return str(message)

    # --- fields -----------------------------------------------------------------------------------------

    def _get_field_names(self, address: Value) -> Value:
        message = self._find_message(address)
        return () if message is None else fields.field_names(message)

    def _find_field(self, address: Value, name: str) -> tuple[Any, Any]:
        """Return the message at an address and a field of the message, each None if missing."""
        message = self._find_message(address)
        return message, None if message is None else fields.find_field(message, name)

    def _describe_field(self, describe: Callable[[MessageField], Value], address: Value, name: str) -> Value:
        message, field = self._find_field(address, name)
        return _INVALID_MESSAGE if message is None else _UNKNOWN_FIELD if field is None else describe(field)

    def _has_field(self, address: Value, name: str) -> Value:
        message, field = self._find_field(address, name)
        return field is not None and fields.has_value(message, field)

    def _is_list_field(self, address: Value, name: str) -> Value:
        _, field = self._find_field(address, name)
        return field is not None and field.is_list

    def _get_value(self, address: Value, name: str) -> Value:
        message, field = self._find_field(address, name)
        if message is None:
            self._log.warn(f"Invalid message when getting {name}")
            return _INVALID_MESSAGE
        type_name = message.DESCRIPTOR.full_name
        if field is None:
            self._log.warn(f"Field {name} of {type_name} does not exist")
            return _UNKNOWN_FIELD
        if field.is_list:
            raise ClipsError(f"field {name} of {type_name} is a list", hint="pb-field-list")
        # as in Fawkes, a message field that is not set has an empty message
        if not field.nested_type and not fields.has_value(message, field):
            self._log.warn(f"Field {name} of {type_name} not set")
            return _NOT_SET
        return fields.field_value(message, field, self._add_message)

    def _get_list(self, address: Value, name: str) -> Value:
        message, field = self._find_field(address, name)
        if message is None:
            return (_INVALID_MESSAGE,)
        if field is None:
            return (_UNKNOWN_FIELD,)
        if not field.is_list:
            return (self._get_value(address, name),)
        return fields.list_values(message, field, self._add_message)

    def _change_field(self, verb: str, address: Value, name: str, value: Value) -> None:
        """Set a field or add to a list; as in Fawkes, this destroys a message that is the value.

        :param verb: ``set`` or ``add``.
        """
        message, field = self._find_field(address, name)
        if message is None:
            return
        if field is None:
            self._log.warn(f"Could not find field {name}")
            return
        type_name = message.DESCRIPTOR.full_name
        try:
            fields.change_value(message, field, value, self._find_message, is_added=verb == "add")
        except fields.UnknownEnumValueError:
            if verb == "set":  # Fawkes' pb-add-list ignores such values silently
                self._log.warn(f"{type_name}: cannot set invalid enum value '{value}' on '{name}'")
        except ProtobufError as error:
            self._log.warn(f"Failed to {verb} field {name} of {type_name}: {error.message}")
        if field.nested_type:
            self._destroy_message(value)

    # --- connections ------------------------------------------------------------------------------------

    def _enable_server(self, port: int) -> None:
        try:
            self.connections.enable_server(port)
        except ProtobufError as error:
            self._log.error(str(error))

    def _create_peer(
        self, host: str, send_port: int, recv_port: int, secret: str = "", cipher: str = ""
    ) -> Value:
        try:
            return self.connections.create_peer(host, send_port, recv_port, secret, cipher)
        except ProtobufError as error:
            self._log.error(f"Cannot create a peer for {host}: {error}")
            return 0

    def _setup_crypto(self, peer_id: int, secret: str, cipher: str) -> None:
        try:
            self.connections.setup_crypto(peer_id, secret, cipher)
        except ProtobufError as error:
            self._log.error(f"Cannot encrypt the messages of peer {peer_id}: {error}")

    def _send_message(
        self, send: Callable[[int, Frame], None], verb: str, link_id: int, address: Value
    ) -> None:
        message = self._find_message(address)
        if message is None:
            target = f"send to {link_id}" if verb == "send" else "send broadcast"
            self._log.warn(f"Cannot {target}: invalid message")
            return
        try:
            send(link_id, make_frame(message))
        except ProtobufError as error:
            type_name = message.DESCRIPTOR.full_name
            self._log.warn(f"Failed to {verb} message of type {type_name}: {error.message}")

    # --- received messages ------------------------------------------------------------------------------

    def before_run(self) -> None:
        """Assert facts for received messages and for changes of connections, and log the warnings."""
        for event in self.connections.drain():
            if isinstance(event, ReceivedMessage):
                self._assert_message(event)
            elif isinstance(event, ConnectionChange):
                self._assert_connection_change(event)
            else:  # a LogWarning
                self._log.warn(event.text)

    def _assert_message(self, event: ReceivedMessage) -> None:
        # the server's end of a connection receives the messages of a client
        is_from_peer, is_from_client = event.role is LinkRole.PEER, event.role is LinkRole.SERVER
        slots: dict[str, Value] = {
            "comp-id": event.component,
            "msg-type": event.type,
            "rcvd-via": Symbol("BROADCAST" if is_from_peer else "STREAM"),
            "client-id": event.link_id,
        }
        if event.message is None:
            if is_from_client:
                slots["rcvd-from"] = self.sender_value(event)
            template = "protobuf-server-receive-failed" if is_from_client else "protobuf-receive-failed"
            self._env.assert_fact(template, {**slots, "message": event.problem})
            return
        self._env.assert_fact(
            "protobuf-msg",
            {
                **slots,
                "type": event.message.DESCRIPTOR.full_name,
                "rcvd-from": self.sender_value(event),
                "rcvd-at": self.time_value(event.arrival_us),
                "client-type": Symbol(event.role.value),
                "ptr": self._add_message(event.message),
            },
        )

    def sender_value(self, event: ReceivedMessage) -> Value:
        """Return the value of the slot ``rcvd-from``. Subclasses may override this method."""
        return (event.host, event.port)

    def time_value(self, time_us: int) -> Value:
        """Return the value of the slot ``rcvd-at``. Subclasses may override this method."""
        return split_us(time_us)

    def _assert_connection_change(self, event: ConnectionChange) -> None:
        state = "connected" if event.is_connected else "disconnected"
        if event.role is LinkRole.CLIENT:
            self._env.assert_string(f"(protobuf-client-{state} {event.link_id})")
        else:
            address = f" {event.host} {event.port}" if event.is_connected else ""
            self._env.assert_string(f"(protobuf-server-client-{state} {event.link_id}{address})")


class ProtobufFeature(Feature):
    """Defines the ``pb-*`` functions, and asserts facts for received messages.

    :param make_connections: makes the connections of an environment; None for connections over sockets.
    :param defines_templates: whether to define the templates of the facts, and the rules that retract the
        facts after the agent's rules; False if the caller defines templates and rules.
    """

    name = "protobuf"

    state_class: ClassVar = ProtobufState  # the class of the feature's state in an environment

    def __init__(
        self,
        settings: ProtobufSettings | None = None,
        make_connections: MakeConnections | None = None,
        *,
        defines_templates: bool = True,
    ) -> None:
        self._settings = settings or ProtobufSettings()
        self._make_connections = make_connections
        self._defines_templates = defines_templates
        self._states: dict[str, ProtobufState] = {}

    def init_context(self, env: ClipsEnvironment) -> None:
        """Read the message types, and define functions and templates."""
        state = self.state_class(env, self._settings, self._make_connections)
        self._states[env.name] = state
        state.define()
        if self._defines_templates:
            env.load(_CLIPS_FILE)

    def before_run(self, env: ClipsEnvironment) -> None:
        """Assert facts for received messages and for changes of connections, and log the warnings."""
        self._states[env.name].before_run()

    def connections(self, env: ClipsEnvironment) -> Connections:
        return self._states[env.name].connections

    def delete_messages(self, env: ClipsEnvironment) -> None:
        """Delete all messages of an environment: afterwards, all addresses that its rules have are invalid.

        The method is for environments whose rules do not call ``pb-destroy``.
        """
        self._states[env.name].delete_messages()

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        state = self._states.pop(env.name, None)
        if state is not None:
            state.connections.close()


def make_feature(run: Run) -> ProtobufFeature:
    """Return the feature of a run."""
    settings = ProtobufSettings.from_config(run.config, run.paths.expand)
    return ProtobufFeature(settings, run.additions.values.get(CONNECTIONS_KEY))
