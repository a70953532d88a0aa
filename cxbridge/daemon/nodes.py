"""Components as managed nodes of a daemon."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Generic, TypeVar

from cxbridge.daemon.lifecycle import ManagedNode
from cxbridge.run.components.component import Component
from cxbridge.run.ending.mistakes import AgentChecks

if TYPE_CHECKING:
    from cxbridge.executive.breakpoints import Breakpoint, Stop
    from cxbridge.executive.debugger import Debugger
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.goals import GoalState
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.service import EnvironmentService
    from cxbridge.run.components.executive import ExecutiveComponent

ComponentType = TypeVar("ComponentType", bound=Component)


class ComponentNode(ManagedNode, Generic[ComponentType]):
    """A component that is made when it is configured, and closed at its cleanup.

    :param component_class: its class.
    :param make: makes it.
    """

    def __init__(
        self, name: str, component_class: type[ComponentType], make: Callable[[], ComponentType]
    ) -> None:
        super().__init__(name, steady=component_class.steady, description=component_class.description)
        self.hooks = tuple(component_class.hooks)
        self._make = make
        self.component: ComponentType | None = None
        """None while it is not configured."""

    def on_configure(self) -> None:
        """Make it, and get it ready."""
        component = self.component = self._make()
        try:
            self.configure_component(component)
        except Exception:
            self.component = None
            component.abort()
            raise

    def configure_component(self, component: ComponentType) -> None:
        """Get a component ready that was made."""
        component.configure()

    def on_activate(self) -> None:
        """Let it begin to work."""
        if self.component is not None:
            self.component.activate()

    def on_deactivate(self) -> None:
        """Let it stop working."""
        if self.component is not None:
            self.component.deactivate()

    def on_cleanup(self) -> None:
        """Close it."""
        try:
            if self.component is not None:
                self.component.close()
        finally:
            self.component = None

    def step(self) -> None:
        """Let it work."""
        if self.component is not None:
            self.component.loop()

    def check(self) -> None:
        """Raise when it does not work any more."""
        if self.component is not None:
            self.component.check()


class ExecutiveNode(ComponentNode["ExecutiveComponent"]):
    """The executive as clients see it; nothing of it is there while it is not configured.

    Breakpoints survive a reset.
    """

    service: EnvironmentService | None = None
    """What manages the environments."""
    _breakpoints: tuple[Breakpoint, ...] = ()
    _checks: AgentChecks | None = None

    def configure_component(self, component: ExecutiveComponent) -> None:
        """Load the core and the agent."""
        from cxbridge.executive.service import EnvironmentService  # noqa: PLC0415 - start-up time is a feature

        component.watch()
        for item in self._breakpoints:
            component.executive.debugger.add(item)
        self._checks = AgentChecks((component,))
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
        component: ExecutiveComponent | None = self.component
        return component.executive if component is not None and self.service is not None else None

    @property
    def env(self) -> ClipsEnvironment | None:
        """The environment."""
        return None if self._executive is None else self._executive.env

    @property
    def goals(self) -> Mapping[str, GoalState]:
        """The goals whose facts are there, by id."""
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
