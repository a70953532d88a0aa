"""The executive of a daemon, as its clients use it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from cxbridge.run.components.component import BaseExecutiveComponent
from cxbridge.run.components.manager import ManagedNode
from cxbridge.run.mistakes import AgentChecks

if TYPE_CHECKING:
    from cxbridge.executive.executive import Executive, RuleControl
    from cxbridge.executive.goals import GoalState
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.run.agent import Run


class ExecutiveNode(ManagedNode[BaseExecutiveComponent]):
    """The executive of a daemon across resets, each of which makes a new component; breakpoints survive.

    :param run: the daemon.
    """

    def __init__(
        self,
        name: str,
        make: Callable[[], BaseExecutiveComponent],
        component_class: type[BaseExecutiveComponent],
        run: Run,
    ) -> None:
        super().__init__(name, make, component_class)
        self._run = run
        self._is_configured = False
        self._control: RuleControl | None = None
        """The debugger of the rules, which a reset moves to the new executive."""
        self._checks: AgentChecks | None = None
        """The checks of the files that are loaded during the initialisation; None afterwards."""

    def configure_component(self, component: BaseExecutiveComponent) -> None:
        component.watch()
        if self._control is not None:
            self._control.move_to(component.executive)
        self._checks = AgentChecks((self._run,))
        component.configure()
        self._checks.check_loaded_files()
        self._is_configured = True

    def on_cleanup(self) -> None:
        if self.executive is not None:
            self._control = self.executive.control
        self._is_configured = False
        super().on_cleanup()

    def step(self) -> None:
        """Run a step of the executive and the requested work of clients."""
        super().step()
        if self._checks is not None:
            self._checks.check_new_files()
            if self._checks.all_initialized:
                # from now on clients may load files, whose mistakes must not end the daemon
                self._checks = None
        if self._is_configured and self.component is not None:
            self.component.manager.run_client_environments()

    @property
    def executive(self) -> Executive | None:
        """The executive, None unless it is configured."""
        component = self.component
        return component.executive if component is not None and self._is_configured else None

    @property
    def env(self) -> ClipsEnvironment | None:
        """The environment of the executive, None unless it is configured."""
        return None if self.executive is None else self.executive.env

    @property
    def goals(self) -> Mapping[str, GoalState]:
        """The goals that have a fact, by id."""
        return {} if self.executive is None else self.executive.goals.open_goals

    @property
    def environments(self) -> dict[str, ClipsEnvironment]:
        """A new dict of all environments by name, including those that are being loaded or finalized."""
        return {} if self.component is None else self.component.manager.environments

    def interrupt(self) -> None:
        """Interrupt the running rules, and let no rule start; callable from any thread."""
        for env in self.environments.values():
            env.interrupt()

    def abort_rule(self) -> None:
        """Interrupt the rules of this cycle; callable from any thread."""
        for env in self.environments.values():
            env.abort_rule()
