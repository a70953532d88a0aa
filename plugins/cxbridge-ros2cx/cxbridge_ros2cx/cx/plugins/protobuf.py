"""``cx::ProtobufPlugin``: protobuf messages and their connections."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.executive.host.values import TRUE, Symbol, Value
from cxbridge_protobuf.feature import ProtobufFeature, ProtobufUser
from cxbridge_protobuf.settings import ProtobufSettings
from cxbridge_ros2cx.cx.plugin import CxPlugin

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge_protobuf.inbox import Received
    from cxbridge_ros2cx.cx.plugin import NodeContext

_SENDER: Final = (
    "(slot comp-id (type INTEGER)) (slot msg-type (type INTEGER))"
    " (slot rcvd-via (type SYMBOL) (allowed-values STREAM BROADCAST)) (multislot rcvd-from (cardinality 2 2))"
)
_FAILED: Final = f"{_SENDER} (slot client-id (type INTEGER)) (slot message (type STRING))"
_TEMPLATES: Final = {
    "protobuf-msg": f"(slot type (type STRING)) {_SENDER} (slot rcvd-at (type FLOAT))"
    " (slot client-type (type SYMBOL) (allowed-values SERVER CLIENT PEER)) (slot client-id (type INTEGER))"
    " (slot ptr (type EXTERNAL-ADDRESS))",
    "protobuf-receive-failed": _FAILED,
    "protobuf-server-receive-failed": _FAILED,
}
_CLEANUPS: Final = {
    "receive-failed": ("(protobuf-receive-failed)", ""),
    "server-receive-failed": ("(protobuf-server-receive-failed)", ""),
    "message": ("(protobuf-msg (ptr ?message))", "(pb-destroy ?message)"),
}
# the low salience lets the rules of agents see a message before it is destroyed
_RULE: Final = "(defrule protobuf-cleanup-{} (declare (salience -10000)) ?fact <- {} => {} (retract ?fact))"


class _User(ProtobufUser):
    """The protobuf state of an environment, with the original's templates and texts."""

    def register(self, full_name: str) -> Value:
        """Register a type; the plug-in's own types are registered already."""
        return TRUE if self.types.is_registered(full_name) else super().register(full_name)

    def sender(self, event: Received) -> Value:
        """Return the address and the port of a sender; the original does not know a server's address."""
        if event.origin.value == "CLIENT":
            return (Symbol(""),)
        return (Symbol(event.host), event.port)

    def time(self, time_us: int) -> Value:
        return time_us / MICROSECONDS

    def text_of(self, message: Any) -> str:
        return str(message).replace("\n", " ")


class _Feature(ProtobufFeature):
    user: ClassVar[type[ProtobufUser]] = _User


class ProtobufPlugin(CxPlugin):
    """Defines the ``pb-*`` functions and the facts of received messages.

    :param linked: the .proto files of a generated plug-in; empty for the plug-in with paths in parameters.
    """

    def __init__(self, name: str, context: NodeContext, linked: Sequence[Path] = ()) -> None:
        super().__init__(name, context)
        self._linked = tuple(linked)
        self._environments: list[ClipsEnvironment] = []

    def initialize(self) -> None:
        """Find the folders with message definitions."""
        packages = self.parameters.get_strings(self.parameter("pkg_share_dirs"))
        shares = [
            share for package in packages if (share := self.context.packages.share(package)) is not None
        ]
        folders = [file.parent for file in self._linked]
        for text in self.parameters.get_strings(self.parameter("proto_paths")):
            # an absolute path stays itself below any share folder
            folder_path = next(
                (folder for share in (Path("/"), *shares) if (folder := share / text).is_dir()), None
            )
            if folder_path is None:
                fault = f"names a folder that is not there: {text}"
                self.log.error(str(self.parameters.wrong(self.parameter("proto_paths"), fault)))
            else:
                folders.append(folder_path.resolve())
        settings = ProtobufSettings(tuple(dict.fromkeys(folders)))
        self._feature = _Feature(settings, self.context.connections, templates=False)

    def init_context(self, env: ClipsEnvironment) -> None:
        """Define functions, templates and rules."""
        self._feature.init_context(env)
        # after the functions, which the clean-up rules call
        for name, slots in _TEMPLATES.items():
            if not env.has_template(name):
                env.build(f"(deftemplate {name} {slots})")
        for name, (pattern, action) in _CLEANUPS.items():
            env.build(_RULE.format(name, pattern, action))
        self._environments.append(env)

    def take(self) -> None:
        """Assert received messages."""
        for env in self._environments:
            with env.lock:
                self._feature.before_run(env)

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Close the connections of an environment."""
        if env in self._environments:
            self._environments.remove(env)
            self._feature.context_destroyed(env)
            self.log.debug("Destroying clips context!")
