"""A daemon as its web server sees it; :class:`cxbridge.web.host.WebHost`."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from cxbridge import __version__
from cxbridge.daemon.client import ask_why
from cxbridge.daemon.components import component_row
from cxbridge.daemon.lifecycle import State
from cxbridge.daemon.plugins import DESCRIPTIONS

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.config import Configuration
    from cxbridge.daemon.daemon import Daemon
    from cxbridge.daemon.nodes import ExecutiveNode
    from cxbridge.events import EventBus
    from cxbridge.executive.debugger import Debugger
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.operations.operation import OperationContext
    from cxbridge.rights import Rights
    from cxbridge.tf.listener import TransformListener

_OWNER = "TransformsRestApi"
_RULES = 1
"""Rules that are listed of those that fired before each step of a goal."""


class DaemonWeb:
    """What the web server gets to see of a daemon.

    :param command: carries out a command.
    :param executive: None: there will be none.
    :param operations: what operations work on.
    """

    def __init__(
        self,
        daemon: Daemon,
        command: Callable[[str], None],
        executive: ExecutiveNode | None,
        operations: OperationContext,
    ) -> None:
        self._daemon = daemon
        self._executive = executive
        self._transforms: TransformListener | None = None
        self._start_us = daemon.clock.now_us()
        self.command = command
        self.operations = operations

    @property
    def board(self) -> BlackBoard:
        """The blackboard."""
        return self._daemon.board

    @property
    def bus(self) -> EventBus:
        """What happens."""
        return self._daemon.bus

    @property
    def config(self) -> Configuration:
        """The configuration."""
        return self._daemon.config

    @property
    def rights(self) -> Rights:
        """What clients may do."""
        return self._daemon.settings.rights

    @property
    def debugger(self) -> Debugger | None:
        """The executive's debugger; None while it is not there."""
        return None if self._executive is None else self._executive.debugger

    def environments(self) -> Mapping[str, ClipsEnvironment]:
        """Return the CLIPS environments by name; empty while the executive is not there."""
        return {} if self._executive is None else self._executive.environments

    def status(self) -> dict[str, Any]:
        """Return how the daemon and its components stand."""
        daemon = self._daemon
        components = daemon.components()
        return {
            "state": daemon.state,
            "version": __version__,
            "pid": os.getpid(),
            "started_us": self._start_us,
            "now_us": daemon.clock.now_us(),
            "clock": daemon.clock.name,
            "endpoints": list(daemon.endpoints),
            "error": next((f"{part.name}: {part.reason}" for part in components if part.reason), ""),
            "loop": {"count": daemon.loop.loops, "period_us": daemon.loop.period_us},
            "components": [component_row(part) for part in components],
        }

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
            (node.name, DESCRIPTIONS.get(node.name, node.name), node.state is State.ACTIVE)
            for node in self._daemon.manager.nodes
            if not node.steady
        ]

    def load_plugin(self, name: str, *, load: bool) -> None:
        """Start or stop a component; no error when it is already.

        :raises CxbridgeError: when that is not possible.
        """
        manager = self._daemon.manager
        (manager.start_one if load else manager.stop_one)(name)

    def frames(self) -> Mapping[str, str | None]:
        """Return the parent of each coordinate frame; listens to them from the first question on."""
        if self._transforms is None:
            from cxbridge.tf.listener import TransformListener  # noqa: PLC0415 - for those who ask

            self._transforms = TransformListener(self.board, owner=_OWNER)
        return self._transforms.buffer.frames

    def why(self, name: str, kind: str, timeout_s: float) -> dict[str, Any] | None:
        """Tell why a rule has not fired, or how a goal came about; not in the main loop's thread."""
        return ask_why(self.board, name, kind, _RULES, timeout_s)
