"""The executive of a daemon, as its clients see it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from cxbridge.run.components.component import ThinkingComponent
from cxbridge.run.components.manager import ManagedNode
from cxbridge.run.ending.mistakes import AgentChecks

if TYPE_CHECKING:
    from cxbridge.executive.executive import Executive, RuleControl
    from cxbridge.executive.goals import GoalState
    from cxbridge.executive.host.environment import ClipsEnvironment
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

    _configured = False
    _control: RuleControl | None = None
    _checks: AgentChecks | None = None

    def configure_component(self, component: ThinkingComponent) -> None:
        """Load the core and the agent."""
        component.watch()
        if self._control is not None:
            self._control.move_to(component.executive)
        self._checks = AgentChecks((self._run,))
        component.configure()
        self._checks.start()
        self._configured = True

    def on_cleanup(self) -> None:
        """Finalize, and unload everything."""
        if self.executive is not None:
            self._control = self.executive.control
        self._configured = False
        super().on_cleanup()

    def step(self) -> None:
        """Think, and do what clients have asked for."""
        super().step()
        if self._checks is not None:
            self._checks.look()
            if self._checks.all_initialized:
                self._checks = None  # from now on clients load files, too
        if self._configured and self.component is not None:
            self.component.manager.run_extra()

    @property
    def executive(self) -> Executive | None:
        """The executive; None while it is not configured."""
        component = self.component
        return component.executive if component is not None and self._configured else None

    @property
    def env(self) -> ClipsEnvironment | None:
        """The environment."""
        return None if self.executive is None else self.executive.env

    @property
    def goals(self) -> Mapping[str, GoalState]:
        """The goals that have a fact, by id."""
        return {} if self.executive is None else self.executive.goals.open

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
