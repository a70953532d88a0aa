"""The plug-in ``cx::ProtobufPlugin``: protobuf messages and their connections.

The plug-in adapts the feature of cxbridge-protobuf to the templates and texts of the ROS 2 CX.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.executive.host.values import TRUE, Symbol, Value
from cxbridge_protobuf.feature import ProtobufFeature, ProtobufState
from cxbridge_protobuf.settings import ProtobufSettings
from cxbridge_ros2cx.cx.plugin import CxPlugin

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge_protobuf.inbox import ReceivedMessage
    from cxbridge_ros2cx.cx.plugin import NodeContext

_SENDER_SLOTS: Final = (
    "(slot comp-id (type INTEGER)) (slot msg-type (type INTEGER))"
    " (slot rcvd-via (type SYMBOL) (allowed-values STREAM BROADCAST)) (multislot rcvd-from (cardinality 2 2))"
)
_FAILURE_SLOTS: Final = f"{_SENDER_SLOTS} (slot client-id (type INTEGER)) (slot message (type STRING))"
_TEMPLATES: Final = {
    "protobuf-msg": f"(slot type (type STRING)) {_SENDER_SLOTS} (slot rcvd-at (type FLOAT))"
    " (slot client-type (type SYMBOL) (allowed-values SERVER CLIENT PEER)) (slot client-id (type INTEGER))"
    " (slot ptr (type EXTERNAL-ADDRESS))",
    "protobuf-receive-failed": _FAILURE_SLOTS,
    "protobuf-server-receive-failed": _FAILURE_SLOTS,
}
# the pattern and the action of each clean-up rule, by the last part of its name
_CLEANUP_PATTERNS_AND_ACTIONS: Final = {
    "receive-failed": ("(protobuf-receive-failed)", ""),
    "server-receive-failed": ("(protobuf-server-receive-failed)", ""),
    "message": ("(protobuf-msg (ptr ?message))", "(pb-destroy ?message)"),
}
# The low salience lets the rules of agents use a message before this rule destroys it. The ROS 2 CX has the
# same salience.
_CLEANUP_RULE: Final = (
    "(defrule protobuf-cleanup-{} (declare (salience -10000)) ?fact <- {} => {} (retract ?fact))"
)


class _CxProtobufState(ProtobufState):
    """The protobuf state of an environment, with the values and texts of the ROS 2 CX."""

    def register(self, full_name: str) -> Value:
        """Register a type; return TRUE also for a type that is registered already, e.g. from the folders."""
        return TRUE if self.types.is_registered(full_name) else super().register(full_name)

    def sender_value(self, event: ReceivedMessage) -> Value:
        """Return the host and port of a sender; for a message to a client, 0 alone.

        In the ROS 2 CX, such a message has an empty host and the port 0, and CLIPS parses the text of both.
        """
        if event.role.value == "CLIENT":
            return (0,)
        return (Symbol(event.host), event.port)

    def time_value(self, time_us: int) -> Value:
        return time_us / MICROSECONDS

    def format_message(self, message: Any) -> str:
        return str(message).replace("\n", " ")


class _CxProtobufFeature(ProtobufFeature):
    state_class: ClassVar[type[ProtobufState]] = _CxProtobufState


class ProtobufPlugin(CxPlugin):
    """Defines the ``pb-*`` functions and the facts of received messages.

    :param proto_files: the .proto files of a generated plug-in; empty for the plug-in whose parameters name
        the folders.
    """

    def __init__(self, name: str, context: NodeContext, proto_files: Sequence[Path] = ()) -> None:
        super().__init__(name, context)
        self._proto_files = tuple(proto_files)
        self._environments: list[ClipsEnvironment] = []

    def initialize(self) -> None:
        """Find the folders with message definitions."""
        share_folders = (Path("/"), *self.find_share_folders())
        folders = [file.parent for file in self._proto_files]
        for path_text in self.parameters.get_strings(self.parameter("proto_paths")):
            # if `path_text` is absolute, `share_folder / path_text` is `path_text`
            candidates = (share_folder / path_text for share_folder in share_folders)
            folder = next(filter(Path.is_dir, candidates), None)
            if folder is None:
                self.log_parameter_error("proto_paths", f"names a folder that does not exist: {path_text}")
            else:
                folders.append(folder.resolve())
        self._feature = _CxProtobufFeature(
            ProtobufSettings(tuple(dict.fromkeys(folders))), self.context.connections, defines_templates=False
        )

    def init_context(self, env: ClipsEnvironment) -> None:
        """Define functions, templates and rules."""
        self._feature.init_context(env)
        # after the functions, which the clean-up rules call
        for name, slots in _TEMPLATES.items():
            if not env.has_template(name):
                env.build(f"(deftemplate {name} {slots})")
        for name, (pattern, action) in _CLEANUP_PATTERNS_AND_ACTIONS.items():
            env.build(_CLEANUP_RULE.format(name, pattern, action))
        self._environments.append(env)

    def receive_messages(self) -> None:
        """Assert facts for received messages and for changes of connections."""
        for env in self._environments:
            with env.lock:
                self._feature.before_run(env)

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Close the connections of an environment."""
        if env in self._environments:
            self._environments.remove(env)
            self._feature.context_destroyed(env)
            self.log.debug("Destroying clips context!")
