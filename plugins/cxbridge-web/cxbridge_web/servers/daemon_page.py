"""A daemon as the data source of its web server; see :class:`cxbridge_web.host.WebHost`."""

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
    def __init__(self, daemon: Daemon) -> None:
        super().__init__(daemon)
        self._daemon, self._node = daemon, daemon.node
        self.operations = daemon.operations

    def command(self, verb: str) -> None:
        self._daemon.carry_out(verb)

    @property
    def board(self) -> BlackBoard:
        return self._daemon.board

    @property
    def rights(self) -> Rights:
        return self._daemon.settings.rights

    @property
    def executive(self) -> Executive | None:
        return None if self._node is None else self._node.executive

    def environments(self) -> Mapping[str, ClipsEnvironment]:
        return {} if self._node is None else self._node.environments

    def status(self) -> dict[str, Any]:
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
        return self._daemon.stalls.text

    def interrupt(self) -> None:
        self._daemon.stalls.interrupt()

    def plugins(self) -> Sequence[tuple[str, str, bool]]:
        """Return name, description and whether it is active, of each component that may be stopped."""
        return [
            (node.name, node.description, node.state is State.ACTIVE)
            for node in self._daemon.lifecycle.nodes
            if not node.steady
        ]

    def load_plugin(self, name: str, *, load: bool) -> None:
        manager = self._daemon.lifecycle
        (manager.start_one if load else manager.stop_one)(name)
