"""The executive of a daemon, as its clients see it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from cxbridge.run.components.component import ThinkingComponent
from cxbridge.run.components.manager import ManagedNode
from cxbridge.run.ending.mistakes import AgentChecks

if TYPE_CHECKING:
    from cxbridge.executive.breakpoints import Breakpoint, Stop
    from cxbridge.executive.debugger import Debugger
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.goals import GoalState
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.service import EnvironmentService
    from cxbridge.run.agent import Run


class ExecutiveNode(ManagedNode[ThinkingComponent]):
    """The executive as clients see it; without environments while it is not configured.

    Breakpoints survive a reset.

    :param run: the daemon.
    """

    def __init__(
        self, name: str, make: Callable[[], ThinkingComponent], kind: type[ThinkingComponent], run: Run
    ) -> None:
        super().__init__(name, make, kind)
        self._run = run

    service: EnvironmentService | None = None
    """What manages the environments."""
    _breakpoints: tuple[Breakpoint, ...] = ()
    _checks: AgentChecks | None = None

    def configure_component(self, component: ThinkingComponent) -> None:
        """Load the core and the agent."""
        from cxbridge.executive.service import EnvironmentService  # noqa: PLC0415 - start-up time is a feature

        component.watch()
        for item in self._breakpoints:
            component.executive.debugger.add(item)
        self._checks = AgentChecks((self._run,))
        component.configure()
        self._checks.start()
        self.service = EnvironmentService(component.manager)

    def on_cleanup(self) -> None:
        """Finalize, and unload everything."""
        if self._executive is not None:
            self._breakpoints = self._executive.debugger.breakpoints
        self.service = None
        super().on_cleanup()

    def step(self) -> None:
        """Think, and do what clients have asked for."""
        super().step()
        if self._checks is not None:
            self._checks.look()
            if self._checks.all_initialized:
                self._checks = None  # from now on clients load files, too
        if self.service is not None:
            self.service.run()

    @property
    def _executive(self) -> Executive | None:
        component = self.component
        return component.executive if component is not None and self.service is not None else None

    @property
    def env(self) -> ClipsEnvironment | None:
        """The environment."""
        return None if self._executive is None else self._executive.env

    @property
    def goals(self) -> Mapping[str, GoalState]:
        """The goals that have a fact, by id."""
        return {} if self._executive is None else self._executive.goals.open

    @property
    def debugger(self) -> Debugger | None:
        """The debugger of the executive."""
        return None if self._executive is None else self._executive.debugger

    @property
    def stopped(self) -> Stop | None:
        """Where the debugger has stopped the rules; None while it has not."""
        return None if self.service is None or self.component is None else self.component.executive.stopped

    @property
    def environments(self) -> dict[str, ClipsEnvironment]:
        """All environments by name; also while they are being loaded or finalized."""
        return {} if self.component is None else self.component.manager.environments

    def interrupt(self) -> None:
        """End the thinking that is under way, and let no other begin; from any thread."""
        for env in tuple(self.environments.values()):
            env.interrupt()

    def break_off(self) -> None:
        """End the thinking of this loop; from any thread."""
        for env in tuple(self.environments.values()):
            env.break_off()
