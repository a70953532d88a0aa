"""A daemon as its web server sees it; :class:`cxbridge_web.host.WebHost`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from cxbridge.run.components.manager import State
from cxbridge_web.host import WebHost

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.daemon.daemon import Daemon
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.rights import Rights


class DaemonWeb(WebHost):
    """The parts of a daemon that the web server sees."""

    def __init__(self, daemon: Daemon) -> None:
        super().__init__(daemon)
        self._daemon, self._node = daemon, daemon.node
        self.operations = daemon.operations

    def command(self, verb: str) -> None:
        """Carry out a command of a client."""
        self._daemon.carry_out(verb)

    @property
    def board(self) -> BlackBoard:
        """The blackboard."""
        return self._daemon.board

    @property
    def rights(self) -> Rights:
        """What clients may do."""
        return self._daemon.settings.rights

    @property
    def executive(self) -> Executive | None:
        """The executive; None while it does not run."""
        return None if self._node is None else self._node.executive

    def environments(self) -> Mapping[str, ClipsEnvironment]:
        """Return the CLIPS environments by name; empty while the executive does not run."""
        return {} if self._node is None else self._node.environments

    def status(self) -> dict[str, Any]:
        """Return how the daemon and its components stand."""
        daemon = self._daemon
        components = daemon.status_of_components()
        return self._status(
            daemon.state,
            [part.plain() for part in components],
            endpoints=daemon.endpoints,
            error=next((f"{part.name}: {part.reason}" for part in components if part.reason), ""),
        )

    @property
    def stall(self) -> str:
        """Why the main loop does not come to its end; empty when it does."""
        return self._daemon.stalls.text

    def interrupt(self) -> None:
        """End what rules do in this loop, from any thread."""
        self._daemon.stalls.interrupt()

    def plugins(self) -> Sequence[tuple[str, str, bool]]:
        """Return name, description and whether it is loaded, of all components that are not steady."""
        return [
            (node.name, node.description, node.state is State.ACTIVE)
            for node in self._daemon.lifecycle.nodes
            if not node.steady
        ]

    def load_plugin(self, name: str, *, load: bool) -> None:
        """Start or stop a component; no error when it is already.

        :raises CxbridgeError: when that is not possible.
        """
        manager = self._daemon.lifecycle
        (manager.start_one if load else manager.stop_one)(name)
