"""The feature `protobuf`: messages and their connections. See docs/evidence/protocol-protobuf.md.

Rules hold a message by an external address, a handle of this process: CLIPS cannot know when the last copy of
an address is gone, so a message lives until ``pb-destroy``, as in Fawkes.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from cxbridge.clock import split_us
from cxbridge.errors import ClipsError, ProtobufError
from cxbridge.events import Logger
from cxbridge.executive.feature import Feature
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress, Symbol, Value
from cxbridge_protobuf.settings import CONNECTIONS, ProtobufSettings

if TYPE_CHECKING:
    from cxbridge.run.agent import Run
    from cxbridge_protobuf.connections import Connections, MakeConnections
    from cxbridge_protobuf.fields import MessageField
    from cxbridge_protobuf.frames import Frame
    from cxbridge_protobuf.inbox import Presence, Received

_FILE = Path(__file__).with_name("protobuf.clp")
_LOG = "CLIPS-Protobuf"
_FIRST_HANDLE = 1 << 40  # far from 0, the null pointer, and from pointers of other features
_MANY = 100_000  # number of live messages that suggests a missing pb-destroy

_INVALID = Symbol("INVALID-MESSAGE")
_UNKNOWN = Symbol("DOES-NOT-EXIST")
_NOT_SET = Symbol("NOT-SET")


class ProtobufFeature(Feature):
    """Defines the ``pb-*`` functions and asserts received messages.

    :param connections: the factory of connections; None for sockets.
    :param templates: whether to define the fact templates and the rules that retract old facts; False if the
        caller has its own.
    """

    name = "protobuf"

    user: ClassVar[type[ProtobufUser]]  # class of the feature's state per environment

    def __init__(
        self,
        settings: ProtobufSettings | None = None,
        connections: MakeConnections | None = None,
        *,
        templates: bool = True,
    ) -> None:
        self._settings = settings or ProtobufSettings()
        self._connections = connections
        self._templates = templates
        self._users: dict[str, ProtobufUser] = {}

    def init_context(self, env: ClipsEnvironment) -> None:
        """Read the message types, and define functions and templates."""
        user = self.user(env, self._settings, self._connections)
        self._users[env.name] = user
        user.define()
        if self._templates:
            env.load(_FILE)

    def before_run(self, env: ClipsEnvironment) -> None:
        """Assert received messages."""
        self._users[env.name].before_run()

    def connections(self, env: ClipsEnvironment) -> Connections:
        return self._users[env.name].network

    def forget(self, env: ClipsEnvironment) -> None:
        """Delete all messages of an environment whose rules neither keep nor destroy them."""
        self._users[env.name].forget()

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        user = self._users.pop(env.name, None)
        if user is not None:
            user.network.close()


def make_feature(context: Run) -> ProtobufFeature:
    """Return the feature of a run.

    For an inspected agent, compiled message modules are not imported, since they are programs.
    """
    settings = ProtobufSettings.from_config(context.config, context.paths.expand)
    if context.is_look:
        settings = replace(settings, modules=())
    return ProtobufFeature(settings, context.additions.values.get(CONNECTIONS))


class ProtobufUser:
    """The feature's state of an environment."""

    def __init__(
        self, env: ClipsEnvironment, settings: ProtobufSettings, connections: MakeConnections | None
    ) -> None:
        # a late import: only agents with the feature pay for protobuf
        from cxbridge_protobuf import fields, types  # noqa: PLC0415
        from cxbridge_protobuf.network import Network  # noqa: PLC0415

        self._env = env
        self._fields = fields
        self._frame_of = types.frame_of
        self._log: Logger = env.bus.logger(_LOG)
        self.types = types.MessageTypes(self._log.warn)
        self.types.add_folders(settings.folders)
        for module in settings.modules:
            self.types.add_module(module)
        self.network = (connections or Network)(self.types, settings.network, env.bus.clock.now_us)
        self._messages: dict[int, Any] = {}
        self._handles = itertools.count(_FIRST_HANDLE)
        self._warn_at = _MANY

    def define(self) -> None:
        # CLIPS' codes of argument types: the default (* any type), then a code for each argument: e external
        # address, sy symbol or string, l integer
        message, field = "*;e", "*;e;sy"
        table: Iterable[tuple[str, Callable[..., Value], int, str]] = (
            ("pb-register-type", self.register, 1, "*;sy"),
            ("pb-create", self._create, 1, "*;sy"),
            ("pb-ref", self._ref, 1, message),
            ("pb-destroy", self._destroy, 1, message),
            ("pb-field-names", self._names, 1, message),
            ("pb-field-type", partial(self._describe, self._fields.type_name), 2, field),
            ("pb-field-label", partial(self._describe, self._fields.label), 2, field),
            ("pb-has-field", self._has_field, 2, field),
            ("pb-field-is-list", self._is_list, 2, field),
            ("pb-field-value", self._value, 2, field),
            ("pb-field-list", self._list, 2, field),
            ("pb-set-field", partial(self._store, self._fields.set_value, "set"), 3, field),
            ("pb-add-list", partial(self._store, self._fields.add_value, "add"), 3, field),
            ("pb-tostring", self._to_string, 1, message),
            ("pb-server-enable", self._server_enable, 1, "*;l"),
            ("pb-server-disable", self.network.disable_server, 0, "*"),
            ("pb-connect", self.network.connect, 2, "*;sy;l"),
            ("pb-disconnect", self.network.disconnect, 1, "*;l"),
            ("pb-send", partial(self._send, self.network.send, "send"), 2, "*;l;e"),
            ("pb-broadcast", partial(self._send, self.network.broadcast, "broadcast"), 2, "*;l;e"),
            ("pb-peer-create", lambda host, port: self._peer(host, port, port), 2, "*;sy;l"),
            ("pb-peer-create-local", self._peer, 3, "*;sy;l;l"),
            (
                "pb-peer-create-crypto",
                lambda host, port, *crypto: self._peer(host, port, port, *crypto),
                4,
                "*;sy;l;sy;sy",
            ),
            ("pb-peer-create-local-crypto", self._peer, 5, "*;sy;l;l;sy;sy"),
            ("pb-peer-destroy", self.network.destroy_peer, 1, "*;l"),
            ("pb-peer-setup-crypto", self._setup_crypto, 3, "*;l;sy;sy"),
        )
        for name, function, count, types in table:
            self._env.define(name, function, count, types=types)

    # --- messages ---------------------------------------------------------------------------------------

    def _add(self, message: Any) -> ExternalAddress:
        handle = next(self._handles)
        self._messages[handle] = message
        if len(self._messages) >= self._warn_at:
            self._log.warn(
                f"{len(self._messages)} messages are alive in CLIPS: does a rule forget pb-destroy?"
            )
            self._warn_at *= 2
        return ExternalAddress(handle)

    def _get(self, address: Value) -> Any:
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

    def _create(self, full_name: str) -> Value:
        try:
            return self._add(self.types.create(full_name))
        except ProtobufError as error:
            self._log.warn(f"Cannot create message of type {full_name}: {error.message}")
            return ExternalAddress(0)

    def forget(self) -> None:
        """Delete all messages."""
        self._messages.clear()

    def _ref(self, address: Value) -> Value:
        message = self._get(address)
        return ExternalAddress(0) if message is None else self._add(message)

    def _destroy(self, address: Value) -> None:
        if isinstance(address, ExternalAddress):
            self._messages.pop(address.handle, None)

    def _to_string(self, address: Value) -> Value:
        message = self._get(address)
        if message is None:
            self._log.warn("Cannot convert message to string: invalid message")
            return ""
        return self.text_of(message)

    def text_of(self, message: Any) -> str:
        return str(message)

    # --- fields -----------------------------------------------------------------------------------------

    def _names(self, address: Value) -> Value:
        message = self._get(address)
        return () if message is None else self._fields.names(message)

    def _find(self, address: Value, name: str) -> tuple[Any, Any]:
        """Return the message at an address and a field of the message, each None if missing."""
        message = self._get(address)
        return message, None if message is None else self._fields.find(message, name)

    def _describe(self, describe: Callable[[MessageField], Value], address: Value, name: str) -> Value:
        message, field = self._find(address, name)
        return _INVALID if message is None else _UNKNOWN if field is None else describe(field)

    def _has_field(self, address: Value, name: str) -> Value:
        message, field = self._find(address, name)
        return field is not None and self._fields.has(message, field)

    def _is_list(self, address: Value, name: str) -> Value:
        _, field = self._find(address, name)
        return field is not None and field.is_list

    def _value(self, address: Value, name: str) -> Value:
        message, field = self._find(address, name)
        if message is None:
            self._log.warn(f"Invalid message when getting {name}")
            return _INVALID
        type_name = message.DESCRIPTOR.full_name
        if field is None:
            self._log.warn(f"Field {name} of {type_name} does not exist")
            return _UNKNOWN
        fields = self._fields
        if field.is_list:
            raise ClipsError(f"field {name} of {type_name} is a list", hint="pb-field-list")
        if not field.of and not fields.has(message, field):
            self._log.warn(f"Field {name} of {type_name} not set")
            return _NOT_SET
        return fields.value(message, field, self._add)

    def _list(self, address: Value, name: str) -> Value:
        message, field = self._find(address, name)
        if message is None:
            return (_INVALID,)
        if field is None:
            return (_UNKNOWN,)
        if not field.is_list:
            return (self._value(address, name),)
        return self._fields.items(message, field, self._add)

    def _store(self, store: Callable[..., None], verb: str, address: Value, name: str, value: Value) -> None:
        """Set a field or add to a list; a message as value is destroyed afterwards, as in Fawkes."""
        message, field = self._find(address, name)
        if message is None:
            return
        if field is None:
            self._log.warn(f"Could not find field {name}")
            return
        type_name = message.DESCRIPTOR.full_name
        try:
            store(message, field, value, self._get)
        except self._fields.UnknownEnumValueError:
            if verb == "set":  # Fawkes' pb-add-list ignores such values silently
                self._log.warn(f"{type_name}: cannot set invalid enum value '{value}' on '{name}'")
        except ProtobufError as error:
            self._log.warn(f"Failed to {verb} field {name} of {type_name}: {error.message}")
        if field.of:
            self._destroy(value)

    # --- connections ------------------------------------------------------------------------------------

    def _server_enable(self, port: int) -> None:
        try:
            self.network.enable_server(port)
        except ProtobufError as error:
            self._log.error(str(error))

    def _peer(self, host: str, send_port: int, recv_port: int, secret: str = "", cipher: str = "") -> Value:
        try:
            return self.network.create_peer(host, send_port, recv_port, secret, cipher)
        except ProtobufError as error:
            self._log.error(f"Cannot create a peer for {host}: {error}")
            return 0

    def _setup_crypto(self, peer: int, secret: str, cipher: str) -> None:
        try:
            self.network.setup_crypto(peer, secret, cipher)
        except ProtobufError as error:
            self._log.error(f"Cannot encrypt the messages of peer {peer}: {error}")

    def _send(self, send: Callable[[int, Frame], None], verb: str, link: int, address: Value) -> None:
        message = self._get(address)
        if message is None:
            target = f"send to {link}" if verb == "send" else "send broadcast"
            self._log.warn(f"Cannot {target}: invalid message")
            return
        try:
            send(link, self._frame_of(message))
        except ProtobufError as error:
            type_name = message.DESCRIPTOR.full_name
            self._log.warn(f"Failed to {verb} message of type {type_name}: {error.message}")

    # --- received messages ------------------------------------------------------------------------------

    def before_run(self) -> None:
        """Assert received messages."""
        from cxbridge_protobuf.inbox import Presence, Received  # noqa: PLC0415

        for event in self.network.drain():
            if isinstance(event, Received):
                self._assert_message(event)
            elif isinstance(event, Presence):
                self._assert_presence(event)
            else:
                self._log.warn(event.text)

    def _assert_message(self, event: Received) -> None:
        peer, server = event.origin.value == "PEER", event.origin.value == "SERVER"
        slots: dict[str, Value] = {
            "comp-id": event.component,
            "msg-type": event.type,
            "rcvd-via": Symbol("BROADCAST" if peer else "STREAM"),
            "client-id": event.link,
        }
        if event.message is None:
            if server:
                slots["rcvd-from"] = self.sender(event)
            template = "protobuf-server-receive-failed" if server else "protobuf-receive-failed"
            self._env.assert_fact(template, {**slots, "message": event.problem})
            return
        self._env.assert_fact(
            "protobuf-msg",
            {
                **slots,
                "type": event.message.DESCRIPTOR.full_name,
                "rcvd-from": self.sender(event),
                "rcvd-at": self.time(event.at_us),
                "client-type": Symbol(event.origin.value),
                "ptr": self._add(event.message),
            },
        )

    def sender(self, event: Received) -> Value:
        return (event.host, event.port)

    def time(self, time_us: int) -> Value:
        return split_us(time_us)

    def _assert_presence(self, event: Presence) -> None:
        state = "connected" if event.connected else "disconnected"
        if event.origin.value == "CLIENT":
            self._env.assert_string(f"(protobuf-client-{state} {event.link})")
        else:
            address = f" {event.host} {event.port}" if event.connected else ""
            self._env.assert_string(f"(protobuf-server-client-{state} {event.link}{address})")


ProtobufFeature.user = ProtobufUser  # here, since the class is defined after the feature
