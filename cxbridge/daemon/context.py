"""The context that the components of a daemon share: more than those of a run have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from cxbridge.run.context import RunContext

if TYPE_CHECKING:
    from cxbridge.blackboard import LocalBlackBoard
    from cxbridge.clock import Clock
    from cxbridge.config import Configuration
    from cxbridge.daemon.components import DaemonComponents
    from cxbridge.daemon.lifecycle import ComponentStatus, LifecycleManager
    from cxbridge.daemon.nodes import ExecutiveNode
    from cxbridge.daemon.plugins import DaemonPlugins
    from cxbridge.daemon.settings import DaemonSettings
    from cxbridge.daemon.stalls import DaemonStalls
    from cxbridge.events import EventBus, Logger
    from cxbridge.mainloop import MainLoop
    from cxbridge.operations.operation import OperationContext
    from cxbridge.rights import Rights
    from cxbridge.run.plugin_settings import PluginSettings


class DaemonAccess(Protocol):
    """The daemon as its servers see it.

    :ivar endpoints: where it can be reached, as far as its servers are up.
    :ivar executive: None: there shall be none.
    :ivar plugins: its components for Fawkes' plugin tool; None without a server for that.
    """

    config: Configuration
    settings: DaemonSettings
    clock: Clock
    bus: EventBus
    board: LocalBlackBoard
    loop: MainLoop
    log: Logger
    endpoints: list[str]
    executive: ExecutiveNode | None
    manager: LifecycleManager
    parts: DaemonComponents
    stalls: DaemonStalls
    plugins: DaemonPlugins | None

    @property
    def operations(self) -> OperationContext:
        """What operations on the daemon work on."""

    @property
    def state(self) -> str:
        """Name of a ``DaemonState``."""

    def components(self) -> list[ComponentStatus]:
        """Return the states of the components."""

    def carry_out(self, what: str) -> None:
        """Carry out a command of a client."""

    def add_endpoints(self, endpoints: Sequence[str], purpose: str = "the blackboard") -> None:
        """Announce where a server can be reached."""


@dataclass(kw_only=True)
class DaemonContext(RunContext):
    """What every component of a daemon needs.

    :param settings: the tree ``cxbridge:`` of the configuration.
    """

    settings: DaemonSettings
    daemon: DaemonAccess

    def section(self, name: str) -> PluginSettings | None:
        """Return the settings of a plug-in; None when the configuration has none."""
        return self.settings.sections.get(name)

    @property
    def has_clients(self) -> bool:
        """Whether clients may ask questions: always."""
        return True

    @property
    def rights(self) -> Rights:
        """What clients may do."""
        return self.settings.rights
