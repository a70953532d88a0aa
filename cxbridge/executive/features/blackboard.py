"""The feature ``blackboard``: interfaces as facts, messages to their writers.

Rules open interfaces with functions of the feature. After ``(blackboard-enable-time-read)``, the rule
``blackboard-read`` reads the interfaces that are open for reading, at each ``time`` fact. Each interface with
new data becomes a fact, whose template has the name of the interface's type.
"""

from __future__ import annotations

import itertools
from functools import partial

from msgspec import Struct, field

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.errors import NoWriterError, UnknownTypeError
from cxbridge.clock import split_us
from cxbridge.errors import ClipsError, CxbridgeError, InterfaceError
from cxbridge.events import Level, Logger
from cxbridge.executive.feature import Feature
from cxbridge.executive.features import interface_facts
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.loading import Diagnostic
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress, Symbol, Value
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.message import Message

_INTERFACE = Symbol("blackboard-interface")
# errors in the definition of an interface type, which is a file of the agent
_DEFINITION_ERRORS = (InterfaceError, UnknownTypeError)

# Fawkes opens a type under this id to preload it
_PRELOAD_ID = "__clips_blackboard_preload__"


class _BlackBoardContext(Struct):
    """The feature's state in one environment."""

    env: ClipsEnvironment
    log: Logger
    defined_types: set[str] = field(default_factory=set)
    """The types with a template in the environment."""
    read_interfaces: dict[str, list[Interface]] = field(default_factory=dict)
    """The interfaces that are open for reading, by type."""
    written_interfaces: dict[str, list[Interface]] = field(default_factory=dict)
    """The interfaces that are open for writing, by type."""
    messages: dict[int, Message] = field(default_factory=dict)
    """The messages that rules have made and not sent, by handle."""
    receivers: dict[int, Interface] = field(default_factory=dict)
    """The interfaces that get the messages, by handle."""
    handles: itertools.count[int] = field(default_factory=lambda: itertools.count(1))
    """The handles of further messages, from 1: 0 means no message."""

    def has_slot(self, name: str) -> bool:
        """Return whether the template ``blackboard-interface`` has a slot."""
        return bool(self.env.call("deftemplate-slot-existp", _INTERFACE, Symbol(name)) == TRUE)

    def find_writer(self, uid: str) -> Interface | None:
        """Return an interface opened for writing; None after a warning in Fawkes' words."""
        interface_type = uid.partition("::")[0]
        writer = next(
            (
                interface
                for interface in self.written_interfaces.get(interface_type, ())
                if interface.uid == uid
            ),
            None,
        )
        if interface_type not in self.written_interfaces:
            self.log.warn(
                f"No interface of type {interface_type} opened for, writing in environment {self.env.name}"
            )
        elif writer is None:
            self.log.warn(f"Interface {uid} not opened for writing, in environment {self.env.name}")
        return writer


class BlackBoardFeature(Feature):
    """Provides the ``blackboard-*`` functions.

    :param board: the blackboard of the environments.
    :param retract_early: Fawkes' ``/clips/retract-early``: retract interface facts at the end of each
        run of the rules.
    :param sender: the sender of messages, by default the name of the executive's thread in Fawkes.
    """

    name = "blackboard"

    def __init__(
        self, board: BlackBoard, *, retract_early: bool = False, sender: str = "ClipsExecutiveThread"
    ) -> None:
        self._board, self._retract_early, self._sender = board, retract_early, sender
        self._contexts: dict[str, _BlackBoardContext] = {}

    def init_context(self, env: ClipsEnvironment) -> None:
        env.call("path-load", "blackboard.clp")
        context = self._contexts[env.name] = _BlackBoardContext(env, env.bus.logger(f"BBCLIPS|{env.name}"))
        # name, function, number of arguments, types (see `UdfTable.define`)
        for name, function, argument_count, types in (
            ("blackboard-open", partial(self._open, context, writing=False), 2, "*;sy;sy"),
            ("blackboard-open-reading", partial(self._open, context, writing=False), 2, "*;sy;sy"),
            ("blackboard-open-writing", partial(self._open, context, writing=True), 2, "*;sy;sy"),
            ("blackboard-preload", partial(self._preload, context), 1, "*;sy"),
            ("blackboard-close", partial(self._close, context), 2, "*;sy;sy"),
            ("blackboard-enable-time-read", partial(self._enable_time_read, env), 0, "*"),
            ("blackboard-read", partial(self._read, context), 0, "*"),
            ("blackboard-write", partial(self._write, context), 1, "*;sy"),
            ("blackboard-get-info", partial(self._get_info, env), 0, "*"),
            ("blackboard-set", partial(self._set_field, context), 3, "*;sy;sy"),
            ("blackboard-set-multifield", partial(self._set_field, context), 3, "*;sy;sy;m"),
            ("blackboard-create-msg", partial(self._create_msg, context), 2, "*;sy;sy"),
            ("blackboard-list-msg-fields", partial(self._list_msg_fields, context), 1, "*;e"),
            ("blackboard-set-msg-field", partial(self._set_msg_field, context), 3, "*;e;sy"),
            ("blackboard-set-msg-multifield", partial(self._set_msg_field, context), 3, "*;e;sy;m"),
            ("blackboard-send-msg", partial(self._send_msg, context), 1, "*;e"),
        ):
            env.define(name, function, argument_count, types=types)

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Close the environment's interfaces."""
        context = self._contexts.pop(env.name)
        for interfaces in (*context.read_interfaces.values(), *context.written_interfaces.values()):
            for interface in interfaces:
                interface.close()

    @staticmethod
    def _enable_time_read(env: ClipsEnvironment) -> None:
        """Let a rule read the interfaces at each ``time`` fact."""
        # the salience of Fawkes: rules of the agent at the default salience then match the new facts
        env.build("(defrule blackboard-read (declare (salience 1000)) (time $?) => (blackboard-read))")

    def _define_type(self, context: _BlackBoardContext, interface: Interface) -> bool:
        """Build the deftemplate of an interface type, and the construct that retracts its facts, once.

        :returns: whether the environment has the deftemplate now.
        """
        if interface.type in context.defined_types:
            return True
        template = interface_facts.deftemplate_text(interface)
        if self._retract_early:
            construct, retract = "Defrule", interface_facts.cleanup_rule_text(interface.type)
        else:
            construct, retract = "Deffunction", interface_facts.cleanup_function_text(interface.type)
        try:
            context.env.build(template)
            context.env.build(retract)
        except ClipsError as error:
            context.log.warn(f"Defining blackboard type for {interface.type} in {context.env.name} failed")
            context.log.warn(str(error))
            return False
        context.defined_types.add(interface.type)
        context.log.debug(f"Deftemplate:\n{template}")
        context.log.debug(f"{construct}:\n{retract}")
        return True

    def _preload(self, context: _BlackBoardContext, interface_type: str) -> None:
        if interface_type in context.read_interfaces or interface_type in context.written_interfaces:
            return
        try:
            with self._board.open_for_reading(interface_type, _PRELOAD_ID) as interface:
                self._define_type(context, interface)
        except CxbridgeError as error:
            context.log.warn(f"Failed to preload interface type {interface_type}, exception follows")
            self._report_open_error(context, interface_type, error)
            return
        context.read_interfaces[interface_type] = []  # marks the type as preloaded

    @staticmethod
    def _report_open_error(context: _BlackBoardContext, interface_type: str, error: CxbridgeError) -> None:
        """Log why an interface cannot be opened. A faulty definition is also a mistake of the agent."""
        loader = context.env.loader
        if not isinstance(error, _DEFINITION_ERRORS):
            context.log.warn(str(error))
            return
        file, line = (error.file, error.line) if error.file else loader.executing_rule_location()
        mistake = Diagnostic(file or interface_type, line, "", "XML", error.message, error.hint or "")
        loader.report(mistake, str(error), context.log, Level.WARN)

    def _open(
        self, context: _BlackBoardContext, interface_type: str, identifier: str, *, writing: bool
    ) -> None:
        interfaces_by_type = context.written_interfaces if writing else context.read_interfaces
        if any(interface.id == identifier for interface in interfaces_by_type.get(interface_type, ())):
            return
        open_interface = self._board.open_for_writing if writing else self._board.open_for_reading
        try:
            interface = open_interface(interface_type, identifier, owner=f"CLIPS:{context.env.name}")
        except CxbridgeError as error:
            # a faulty definition is reported with the other mistakes of the agent
            is_reported = context.env.loader.is_quiet and isinstance(error, _DEFINITION_ERRORS)
            context.log.log(
                Level.DEBUG if is_reported else Level.WARN,
                f"Failed to open interface {interface_type}:{identifier}, exception follows",
            )
            self._report_open_error(context, interface_type, error)
            return
        if not self._define_type(context, interface):
            interface.close()
            return
        interfaces_by_type.setdefault(interface_type, []).append(interface)
        context.log.info(f"Added interface {interface.uid} for {'writing' if writing else 'reading'}")
        slots: dict[str, Value] = {
            "id": interface.id,
            "type": interface.type,
            "uid": interface.uid,
            "writing": TRUE if writing else FALSE,
        }
        # the template of ros2_cx (the CLIPS Executive for ROS 2) lacks these slots
        identification = {"hash": interface.hash.hex().upper(), "serial": str(interface.serial)}
        slots |= {name: value for name, value in identification.items() if context.has_slot(name)}
        context.env.assert_fact(str(_INTERFACE), slots)

    @staticmethod
    def _close(context: _BlackBoardContext, interface_type: str, identifier: str) -> None:
        for interfaces_by_type in (context.read_interfaces, context.written_interfaces):
            for interface in interfaces_by_type.get(interface_type, []):
                if interface.id == identifier:
                    interfaces_by_type[interface_type].remove(interface)
                    interface.close()
                    break

    def _read(self, context: _BlackBoardContext) -> None:
        """Read the interfaces that are open for reading; assert a fact for each interface with new data."""
        env = context.env
        for interface_type in sorted(context.read_interfaces):  # Fawkes' map of interfaces is sorted, too
            for interface in context.read_interfaces[interface_type]:
                if not interface.read():
                    continue
                if not self._retract_early:
                    env.call(f"{interface_type}-cleanup-late", interface.id)
                env.assert_fact(interface_type, interface_facts.fact_slots(interface))

    @staticmethod
    def _write(context: _BlackBoardContext, uid: str) -> None:
        interface = context.find_writer(uid)
        if interface is not None:
            interface.write()

    def _get_info(self, env: ClipsEnvironment) -> None:
        for info in self._board.list_all():
            env.assert_fact(
                "blackboard-interface-info",
                {
                    "id": info.id,
                    "type": info.type,
                    "hash": info.hash.hex().upper(),
                    "has-writer": TRUE if info.has_writer else FALSE,
                    "num-readers": info.num_readers,
                    "writer": info.writer,
                    "readers": tuple(info.readers),
                    "timestamp": split_us(info.timestamp_us),
                },
            )

    def _set_field(self, context: _BlackBoardContext, uid: str, name: str, value: Value) -> None:
        interface = context.find_writer(uid)
        if interface is not None:
            self._store_field(context, interface, name, value)

    @staticmethod
    def _store_field(
        context: _BlackBoardContext, block: Interface | Message, name: str, value: Value
    ) -> bool:
        """Set a field of an interface or message; return False after logging an error."""
        try:
            interface_facts.store_field(block, name, value)
        except CxbridgeError as error:
            context.log.error(str(error))
            return False
        return True

    def _create_msg(self, context: _BlackBoardContext, uid: str, message_type: str) -> Value:
        """Make a message to the writer of an interface; return its handle, or 0 after a failure."""
        interfaces = context.read_interfaces.get(uid.partition("::")[0], ())
        interface = next((interface for interface in interfaces if interface.uid == uid), None)
        if interface is None:
            context.log.warn(
                f"Can't create message {message_type}, the interface {uid} is not opened for reading"
            )
            return ExternalAddress(0)
        try:
            message = interface.create_message(message_type)
        except CxbridgeError as error:
            context.log.warn(str(error))
            return ExternalAddress(0)
        message.sender_thread_name = self._sender
        # a number instead of an address: a rule may use a message after it was sent
        handle = next(context.handles)
        context.messages[handle], context.receivers[handle] = message, interface
        return ExternalAddress(handle)

    @staticmethod
    def _list_msg_fields(context: _BlackBoardContext, address: ExternalAddress) -> Value:
        message = context.messages.get(address.handle)
        if message is None:
            context.log.warn("Can't list message fields, the pointer is wrong.")
            return ()
        names = tuple(field_.name for field_ in message.fields())
        for name in names:
            context.log.info(f"Message has field {name}")
        return names

    def _set_msg_field(
        self, context: _BlackBoardContext, address: ExternalAddress, name: str, value: Value
    ) -> None:
        message = context.messages.get(address.handle)
        if message is None:
            context.log.warn("Can't set message field, the pointer is wrong.")
        elif not self._store_field(context, message, name, value):
            context.log.warn("Can't set message field.")

    @staticmethod
    def _send_msg(context: _BlackBoardContext, address: ExternalAddress) -> Value:
        """Send a message; return the message's id, or 0 after a failure."""
        message = context.messages.pop(address.handle, None)
        if message is None:
            reason = "was it already sent?" if address.handle else "the pointer is wrong."
            context.log.warn(f"Can't send message, {reason}")
            return 0
        try:
            return context.receivers.pop(address.handle).msgq_enqueue(message)
        except CxbridgeError as error:
            if not isinstance(error, NoWriterError):  # which the blackboard has logged
                context.log.warn(f"Failed to send message: {error}")
            return 0
