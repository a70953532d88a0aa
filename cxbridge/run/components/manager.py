"""Lifecycle of components, and the manager of all components of a run or daemon.

A component has the states of a ROS 2 *managed node*::

    UNCONFIGURED --configure--> INACTIVE --activate--> ACTIVE
       ^                       |    ^                  |
       +-------cleanup---------+    +----deactivate----+        shutdown, from any state --> FINALIZED

All calls run in the thread of the main loop, because CLIPS allows a single thread.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum, IntEnum, StrEnum
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

from msgspec import Struct

from cxbridge.clock import Clock
from cxbridge.errors import BrokenAgentError, CxbridgeError
from cxbridge.events import Level, Logger
from cxbridge.run.components.component import Component

if TYPE_CHECKING:
    from cxbridge.interrupt import Interrupt


class State(IntEnum):
    """Lifecycle states, numbered as in ComponentInterface."""

    UNCONFIGURED = 0
    INACTIVE = 1
    ACTIVE = 2
    FINALIZED = 3


class Transition(StrEnum):
    """Lifecycle transitions, named as in ROS 2."""

    CONFIGURE = "configure"
    ACTIVATE = "activate"
    DEACTIVATE = "deactivate"
    CLEANUP = "cleanup"
    SHUTDOWN = "shutdown"


# The states before and after each transition except shutdown, which any state permits.
_STATE_BEFORE: Final = {
    Transition.CONFIGURE: State.UNCONFIGURED,
    Transition.ACTIVATE: State.INACTIVE,
    Transition.DEACTIVATE: State.ACTIVE,
    Transition.CLEANUP: State.INACTIVE,
}
_STATE_AFTER: Final = {
    Transition.CONFIGURE: State.INACTIVE,
    Transition.ACTIVATE: State.ACTIVE,
    Transition.DEACTIVATE: State.INACTIVE,
    Transition.CLEANUP: State.UNCONFIGURED,
}
_START_TRANSITIONS: Final = (Transition.CONFIGURE, Transition.ACTIVATE)
_STOP_TRANSITIONS: Final = (Transition.DEACTIVATE, Transition.CLEANUP)


class FailurePolicy(Enum):
    """Reaction to a failed component: continue, stop all components, or raise the error to the caller."""

    CONTINUE = "continue"
    STOP = "stop"
    RAISE = "raise"


class LifecycleError(CxbridgeError):
    """A component cannot take a transition, or there is no such component or transition."""


class ComponentFailedError(CxbridgeError):
    """An unexpected error in a component, rather than a user's mistake. A retry may succeed."""

    exit_status = 4


class ComponentStatus(Struct, frozen=True):
    """A component's state.

    :param reason: why the component is not active; empty if the component is active or was never started.
    :param since_us: the time of the last change of the state, microseconds since the epoch.
    """

    name: str
    state: State
    reason: str
    since_us: int

    def to_json(self) -> dict[str, Any]:
        """Return the status as JSON values."""
        return {
            "name": self.name,
            "state": self.state.name,
            "since_us": self.since_us,
            "reason": self.reason,
        }


ComponentType = TypeVar("ComponentType", bound=Component)


class ManagedNode(Generic[ComponentType]):
    """A component with its lifecycle state. ``configure`` makes the component, and ``cleanup`` closes it.

    :param name: the name for lists and logs.
    :param make: makes the component; may raise.
    :param component_class: the class of the component that ``make`` returns.
    :param component: a component that exists before it is configured.
    """

    def __init__(
        self,
        name: str,
        make: Callable[[], ComponentType],
        component_class: type[ComponentType],
        component: ComponentType | None = None,
    ) -> None:
        self.name, self._make = name, make
        self.steady = component_class.steady
        self.description = component_class.description or name
        self.hooks = tuple(component_class.hooks)
        self.state = State.UNCONFIGURED
        self.reason = ""
        self.error: Exception = LifecycleError(f"{name} has not failed")
        """The error of the last failed transition; before such a failure, an error that says so."""
        self.component = component
        """The component; None while unconfigured, unless the component existed before the node."""

    def step(self) -> None:
        assert self.component is not None
        self.component.loop()

    def check(self) -> None:
        """Raise if the component is broken."""
        assert self.component is not None
        self.component.check()

    def configure_component(self, component: ComponentType) -> None:
        component.configure()

    def on_configure(self) -> None:
        self.component = self._make()
        self.configure_component(self.component)

    def on_cleanup(self) -> None:
        component, self.component = self.component, None
        assert component is not None
        component.close()

    def abort(self) -> None:
        """Release all resources after a failed configuration."""
        component, self.component = self.component, None
        if component is not None:
            component.abort()

    def take_transition(self, transition: Transition) -> None:
        """Take one transition.

        A shutdown leads through the states in between, and continues after a failure.

        :raises LifecycleError: if the state does not permit the transition.
        :raises Exception: the failure of the component; a shutdown raises its first failure after all steps.
        """
        if transition is Transition.SHUTDOWN:
            self._shut_down()
            return
        state_before, state_after = _STATE_BEFORE[transition], _STATE_AFTER[transition]
        if self.state is not state_before:
            raise LifecycleError(
                f"{self.name} is {self.state.name.lower()}, expected {state_before.name.lower()}"
            )
        try:
            if transition is Transition.CONFIGURE:
                self.on_configure()
            elif transition is Transition.CLEANUP:
                self.on_cleanup()
            else:
                getattr(self.component, transition)()
        except Exception:
            # a component that fails to stop counts as stopped: another attempt would fail, too
            if transition in _STOP_TRANSITIONS:
                self.state = state_after
            raise
        self.state = state_after

    def _shut_down(self) -> None:
        failures: list[Exception] = []
        for transition in _STOP_TRANSITIONS:
            if self.state is _STATE_BEFORE[transition]:
                _collect_failure(partial(self.take_transition, transition), failures)
        if self.component is not None:  # the executive of a run exists before it is configured
            _collect_failure(self.on_cleanup, failures)
        self.state = State.FINALIZED
        if failures:
            raise failures[0]


class ComponentManager:
    """Starts components first to last, stops them last to first, and watches them in between.

    All calls run in the caller's thread. The policy decides what follows the failure of a transition: the
    manager raises the error; or it logs the error, keeps the error as the component's reason, and either lets
    the other components continue or sets :attr:`failure`, so that the owner calls :meth:`shutdown`.

    :param nodes: components in start order; each may depend on its predecessors.
    :param log: gets a line for each change; None: changes are not logged.
    :param policy: the reaction to failures.
    :param on_change: called after each change of a state or reason.
    """

    def __init__(
        self,
        nodes: Sequence[ManagedNode[Any]],
        clock: Clock,
        log: Logger | None = None,
        *,
        policy: FailurePolicy = FailurePolicy.STOP,
        on_change: Callable[[], None] = lambda: None,
    ) -> None:
        self.nodes = tuple(nodes)
        self.policy, self.on_change, self._clock, self._log = policy, on_change, clock, log
        self.failure = ""
        """The first failure since :meth:`startup` under :attr:`FailurePolicy.STOP`; else empty."""
        self.first_error: Exception = LifecycleError("nothing has failed")
        """The exception of :attr:`failure`; before a failure, an error that says so."""
        self.paused = False
        self._changed_us = dict.fromkeys((node.name for node in self.nodes), clock.now_us())

    def add(self, node: ManagedNode[Any]) -> None:
        """Add a component at the end: it starts last and stops first."""
        self.nodes = (*self.nodes, node)
        self._changed_us[node.name] = self._clock.now_us()

    def _log_change(self, level: Level, text: str) -> None:
        if self._log is not None:
            self._log.log(level, text)

    def status(self) -> list[ComponentStatus]:
        """Return the status of each component, in start order."""
        return [
            ComponentStatus(node.name, node.state, node.reason, self._changed_us[node.name])
            for node in self.nodes
        ]

    def startup(self, interrupt: Interrupt | None = None) -> None:
        """Configure all components, then activate all.

        Under :attr:`FailurePolicy.STOP`, a failure ends the sequence.

        :param interrupt: a received signal ends the sequence.
        """
        self.failure = ""
        self.paused = False
        # two rounds: an active component may call all others, which therefore must be configured
        for transition in _START_TRANSITIONS:
            for node in self.nodes:
                if interrupt is not None and interrupt.is_signalled:
                    return
                self._start_if_due(node, transition)

    def _start_if_due(self, node: ManagedNode[Any], transition: Transition) -> None:
        if node.state is _STATE_BEFORE[transition] and not self.failure:
            self._try_transition(node, transition)

    def pause(self) -> None:
        """Deactivate all components except steady ones, last to first."""
        self.paused = True
        for node in reversed(self.nodes):
            if node.state is State.ACTIVE and not node.steady:
                self._try_transition(node, Transition.DEACTIVATE, "paused")

    def resume(self) -> None:
        """Activate the inactive components, first to last."""
        self.paused = False
        for node in self.nodes:
            self._start_if_due(node, Transition.ACTIVATE)

    def reset(self) -> None:
        """Clean up all components except steady ones, and start them again."""
        for node in reversed(self.nodes):
            if not node.steady and node.state is not State.FINALIZED:
                self._wind_down(node, "reset")
        self.startup()

    def shutdown(self) -> None:
        """Finalize all components, last to first. Further calls do nothing.

        :raises Exception: under :attr:`FailurePolicy.RAISE` the first failure, after all components are
            finalized.
        """
        failures: list[Exception] = []
        for node in reversed(self.nodes):
            if node.state is not State.FINALIZED:
                shut_down = partial(
                    self._try_transition, node, Transition.SHUTDOWN, node.reason or "shut down"
                )
                _collect_failure(shut_down, failures)
        if failures:
            raise failures[0]

    def start_component(self, name: str) -> None:
        """Activate one component.

        :raises LifecycleError: if the component is unknown.
        :raises Exception: as :meth:`start`.
        """
        self.start(self._find_changeable_node(name))

    def start(self, node: ManagedNode[Any]) -> None:
        """Activate the component of a node. A failure is raised under every policy.

        :raises LifecycleError: if the component was shut down or fails to start.
        :raises Exception: under :attr:`FailurePolicy.RAISE`, the failure itself.
        """
        name = node.name
        if node.state is State.FINALIZED:
            raise LifecycleError(f"{name} was shut down", hint="restart the daemon to start it again")
        for transition in _START_TRANSITIONS:
            if node.state is _STATE_BEFORE[transition] and not self._take_transition(node, transition):
                raise LifecycleError(f"{name} cannot {transition}: {node.reason}")

    def stop_component(self, name: str) -> None:
        """Clean up one component.

        :raises LifecycleError: if the component is unknown.
        """
        node = self._find_changeable_node(name)
        if node.state not in (State.UNCONFIGURED, State.FINALIZED):
            self._wind_down(node, "unloaded")

    def change_component(self, name: str, transition: str) -> None:
        """Take one lifecycle transition of a component.

        A failure is raised under every policy. A finalized component stays finalized.

        :param transition: the value of a :class:`Transition`.
        :raises LifecycleError: if the component or the transition is unknown, the component's state does not
            permit the transition, or the transition fails.
        :raises Exception: under :attr:`FailurePolicy.RAISE`, the failure itself.
        """
        node = self._find_changeable_node(name)
        if transition not in list(Transition):
            raise LifecycleError(
                f"there is no transition '{transition}'", hint=f"use one of: {', '.join(Transition)}"
            )
        permitted_states = (
            (_STATE_BEFORE[Transition(transition)],)
            if transition in _STATE_BEFORE
            else (State.UNCONFIGURED, State.INACTIVE, State.ACTIVE)  # a shutdown
        )
        if node.state not in permitted_states:
            raise LifecycleError(
                f"{name} cannot {transition}: it is {node.state.name.lower()}, expected "
                + " or ".join(state.name.lower() for state in permitted_states)
            )
        reason = "" if transition == Transition.ACTIVATE else f"{transition} on request"
        if not self._take_transition(node, Transition(transition), reason):
            raise LifecycleError(f"{name} cannot {transition}: {node.reason}")

    def _find_changeable_node(self, name: str) -> ManagedNode[Any]:
        """Return a node that clients may start and stop; steady components are excluded.

        :raises LifecycleError: if there is no such node.
        """
        nodes = {node.name: node for node in self.nodes if not node.steady}
        if name not in nodes:
            hint = f"there are: {', '.join(nodes) or 'none, all components of this daemon are steady'}"
            raise LifecycleError(f"there is no component '{name}' to change", hint=hint)
        return nodes[name]

    def list_changeable(self) -> list[tuple[str, str, bool]]:
        """Return the name, the description and the activity of each component that clients may stop."""
        return [
            (node.name, node.description, node.state is State.ACTIVE)
            for node in self.nodes
            if not node.steady
        ]

    def check_active(self) -> None:
        """Check all active components, and stop those whose check fails; see :meth:`fail`."""
        for node in self.nodes:
            self.guarded(node, node.check)()

    def guarded(self, node: ManagedNode[Any], step: Callable[[], object]) -> Callable[[], None]:
        """Return a function that calls ``step`` while the node is active; a failure stops the node."""

        def run_step() -> None:  # the watchdog finds the active component by this name and ``node``
            if node.state is State.ACTIVE:
                try:
                    step()
                except Exception as error:  # noqa: BLE001 - a component may fail in any way
                    self.fail(node, error)

        return run_step

    def fail(self, node: ManagedNode[Any], error: Exception) -> None:
        """Stop a failed component; under :attr:`FailurePolicy.STOP`, set :attr:`failure`."""
        reason = _describe_error(error)
        self._log_change(Level.ERROR, f"{node.name} failed: {reason}")
        self._wind_down(node, reason)
        if self.policy is FailurePolicy.STOP and not self.failure:
            self.failure, self.first_error = f"{node.name}: {reason}", error

    def _wind_down(self, node: ManagedNode[Any], reason: str) -> None:
        for transition in _STOP_TRANSITIONS:
            if node.state is _STATE_BEFORE[transition]:
                self._try_transition(node, transition, reason)
        node.reason = reason
        self.on_change()

    def _try_transition(self, node: ManagedNode[Any], transition: Transition, reason: str = "") -> None:
        """Take a transition; under :attr:`FailurePolicy.STOP`, a failure sets :attr:`failure`."""
        if (
            not self._take_transition(node, transition, reason)
            and self.policy is FailurePolicy.STOP
            and not self.failure
        ):
            self.failure, self.first_error = f"{node.name}: {node.reason}", node.error

    def _take_transition(self, node: ManagedNode[Any], transition: Transition, reason: str = "") -> bool:
        """Take a transition; return whether it succeeded.

        :param reason: why the component will be inactive; replaced by the error of a failure.
        :raises Exception: under :attr:`FailurePolicy.RAISE`, the failure.
        """
        state_before, succeeded = node.state, True
        try:
            node.take_transition(transition)
        except Exception as error:
            if self.policy is FailurePolicy.RAISE:
                raise  # the caller's close() closes the component
            if node.state is State.UNCONFIGURED:
                node.abort()
            text = _describe_error(error)
            self._log_change(Level.ERROR, f"{node.name} cannot {transition}: {text}")
            node.error, reason, succeeded = error, text, False
        if node.state is not state_before:
            self._changed_us[node.name] = self._clock.now_us()
            self._log_change(Level.DEBUG, f"{node.name} is {node.state.name.lower()}")
        node.reason = reason
        self.on_change()
        return succeeded


def _collect_failure(step: Callable[[], object], failures: list[Exception]) -> None:
    """Call a step, and append its error, so that the following steps are still called."""
    try:
        step()
    except Exception as error:  # noqa: BLE001 - the caller raises the failure
        failures.append(error)


def _describe_error(error: Exception) -> str:
    """Return the text of an error in one line, with the class of an unexpected error."""
    if isinstance(error, BrokenAgentError):
        return error.message  # the client that starts the agent gets each mistake separately
    text = str(error) if isinstance(error, CxbridgeError) else f"{type(error).__name__}: {error}"
    return "; ".join(line.strip() for line in text.splitlines())
