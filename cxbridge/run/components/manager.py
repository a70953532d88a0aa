"""The life of components, and the manager that leads all components of a run or a daemon through it.

A component has the states of a *managed node* of ROS 2: unconfigured, inactive, active or finalized.

::

    UNCONFIGURED --configure--> INACTIVE --activate--> ACTIVE
         ^                       |    ^                  |
         +-------cleanup---------+    +----deactivate----+        shutdown, from anywhere --> FINALIZED
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum, StrEnum
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

from cxbridge.clock import Clock
from cxbridge.errors import BrokenAgentError, CxbridgeError
from cxbridge.events import Level, Logger
from cxbridge.run.components.component import Component


class State(IntEnum):
    """Where in its life a component is; the numbers are those of ComponentInterface."""

    UNCONFIGURED = 0
    INACTIVE = 1
    ACTIVE = 2
    FINALIZED = 3


class Transition(StrEnum):
    """A step of a component's life, under the name that ROS 2 has for it."""

    CONFIGURE = "configure"
    ACTIVATE = "activate"
    DEACTIVATE = "deactivate"
    CLEANUP = "cleanup"
    SHUTDOWN = "shutdown"


_FROM = {
    Transition.CONFIGURE: (State.UNCONFIGURED,),
    Transition.ACTIVATE: (State.INACTIVE,),
    Transition.DEACTIVATE: (State.ACTIVE,),
    Transition.CLEANUP: (State.INACTIVE,),
    Transition.SHUTDOWN: (State.UNCONFIGURED, State.INACTIVE, State.ACTIVE),
}
"""The states in which each can be taken."""


class Policy(Enum):
    """Whether the other components stop when a component fails; RAISE hands the error to the caller."""

    CONTINUE = "continue"
    STOP = "stop"
    RAISE = "raise"


class Interruption(Protocol):
    """Returns whether a signal asks for the end."""

    @property
    def received(self) -> bool:
        """Whether a signal has come."""


class LifecycleError(CxbridgeError):
    """A component is in no state for a transition, or failed at the transition."""


class ComponentFailedError(CxbridgeError):
    """A component failed with an unexpected error: not the user's mistake; a second attempt may succeed."""

    exit_status = 4


@dataclass(frozen=True, slots=True)
class ComponentStatus:
    """Describes a component.

    :param reason: why the component is not active; empty when it is active, or was never started.
    :param since_us: when it came into this state, microseconds since the epoch.
    """

    name: str
    state: State
    reason: str
    since_us: int

    def plain(self) -> dict[str, Any]:
        """Return the description as JSON can have it."""
        return {
            "name": self.name,
            "state": self.state.name,
            "since_us": self.since_us,
            "reason": self.reason,
        }


ComponentType = TypeVar("ComponentType", bound=Component)


class ManagedNode(Generic[ComponentType]):
    """A component with its state: made when it is configured, closed at its cleanup.

    :param name: for lists and logs.
    :param make: makes the component; an exception is a failure.
    :param kind: the component's class.
    :param component: the component, if it was made already.
    """

    def __init__(
        self,
        name: str,
        make: Callable[[], ComponentType],
        kind: type[ComponentType],
        component: ComponentType | None = None,
    ) -> None:
        self.name = name
        self.steady = kind.steady
        self.description = kind.description or name
        self.hooks = tuple(kind.hooks)
        self.state = State.UNCONFIGURED
        self.reason = ""
        self.error: Exception = LifecycleError(f"{name} has not failed")
        """The error of the last failure."""
        self.component = component
        """None while it is not configured, unless it was made before."""
        self._make = make

    def configure_component(self, component: ComponentType) -> None:
        """Get a component ready that was made."""
        component.configure()

    def step(self) -> None:
        """Let the component do the work of a loop."""
        if self.component is not None:
            self.component.loop()

    def check(self) -> None:
        """Raise when the component does not work any more; asked about once a second while active."""
        if self.component is not None:
            self.component.check()

    def on_configure(self) -> None:
        """Make the component, and get it ready."""
        self.component = self._make()
        self.configure_component(self.component)

    def abort(self) -> None:
        """Release everything after a failure to configure."""
        component, self.component = self.component, None
        if component is not None:
            component.abort()

    def on_activate(self) -> None:
        """Let the component begin to work."""
        if self.component is not None:
            self.component.activate()

    def on_deactivate(self) -> None:
        """Let the component stop working."""
        if self.component is not None:
            self.component.deactivate()

    def on_cleanup(self) -> None:
        """Close the component."""
        try:
            if self.component is not None:
                self.component.close()
        finally:
            self.component = None

    def configure(self) -> None:
        """Go from unconfigured to inactive."""
        self._go(State.UNCONFIGURED, State.INACTIVE, self.on_configure)

    def activate(self) -> None:
        """Go from inactive to active."""
        self._go(State.INACTIVE, State.ACTIVE, self.on_activate)

    def deactivate(self) -> None:
        """Go from active to inactive; it is inactive afterwards even if it fails."""
        self._go(State.ACTIVE, State.INACTIVE, self.on_deactivate, regardless=True)

    def cleanup(self) -> None:
        """Go from inactive to unconfigured; it is unconfigured afterwards even if it fails."""
        self._go(State.INACTIVE, State.UNCONFIGURED, self.on_cleanup, regardless=True)

    def shutdown(self) -> None:
        """Go from any state to finalized, on the way through all between; a failure does not stop it.

        :raises Exception: the first failure, when all is done.
        """
        failures: list[Exception] = []
        for state, step in ((State.ACTIVE, self.deactivate), (State.INACTIVE, self.cleanup)):
            if self.state is state:
                _attempt(step, failures)
        if self.component is not None:
            _attempt(self.on_cleanup, failures)
        self.state = State.FINALIZED
        if failures:
            raise failures[0]

    def _go(self, before: State, after: State, step: Callable[[], None], *, regardless: bool = False) -> None:
        """Take one step of life.

        :raises LifecycleError: when the node is not in the state ``before``.
        """
        if self.state is not before:
            raise LifecycleError(
                f"{self.name} is {self.state.name.lower()}, it would have to be {before.name.lower()}"
            )
        try:
            step()
        except Exception:
            if regardless:
                self.state = after
            raise
        self.state = after


class ComponentManager:
    """Starts components first to last, stops them last to first, and watches them in between.

    Everything happens in the thread that calls. Failures are logged, kept as the component's reason, and by
    the policy either leave the other components alone or set :attr:`failure`, upon which the owner should
    :meth:`shutdown`. Under the policy of a run they are raised.

    :param nodes: the components in the order of their start; those behind may need those before.
    :param log: None: changes of states are not logged.
    :param policy: whether the other components stop when one fails.
    :param on_change: called after each change of a component's state or reason.
    """

    def __init__(
        self,
        nodes: Sequence[ManagedNode[Any]],
        clock: Clock,
        log: Logger | None = None,
        *,
        policy: Policy = Policy.STOP,
        on_change: Callable[[], None] = lambda: None,
    ) -> None:
        self.nodes = tuple(nodes)
        self.policy = policy
        self.failure = ""
        """The first failure under the policy to stop; empty when there was none."""
        self.failure_error: Exception = LifecycleError("nothing has failed")
        """The error that :attr:`failure` came of."""
        self.paused = False
        self.on_change = on_change
        self._clock = clock
        self._log = log
        self._since = dict.fromkeys((node.name for node in self.nodes), clock.now_us())

    def add(self, node: ManagedNode[Any]) -> None:
        """Manage one more component; it stops first."""
        self.nodes = (*self.nodes, node)
        self._since[node.name] = self._clock.now_us()

    def _say(self, level: Level, text: str) -> None:
        if self._log is not None:
            self._log.log(level, text)

    def status(self) -> list[ComponentStatus]:
        """Return a description of each component, in the order of their start."""
        return [
            ComponentStatus(node.name, node.state, node.reason, self._since[node.name]) for node in self.nodes
        ]

    # -- all of them

    def startup(self, interrupt: Interruption | None = None) -> bool:
        """Configure all, then activate all, first to last; return whether all are active.

        A component whose forerunner failed under the policy to stop is not tried.

        :param interrupt: when it has received a signal no further one is tried.
        """
        self.failure = ""
        self.paused = False
        for wanted, step in ((State.UNCONFIGURED, "configure"), (State.INACTIVE, "activate")):
            for node in self.nodes:
                if interrupt is not None and interrupt.received:
                    return False
                if node.state is wanted and not self.failure:
                    node.reason = node.reason if step == "activate" else ""
                    self._try(node, step)
        return all(node.state is State.ACTIVE for node in self.nodes)

    def pause(self) -> None:
        """Deactivate all but the steady ones, last to first."""
        self.paused = True
        for node in reversed(self.nodes):
            if node.state is State.ACTIVE and not node.steady:
                self._try(node, "deactivate", "paused")

    def resume(self) -> bool:
        """Activate the inactive components, first to last; return whether all are active."""
        self.paused = False
        for node in self.nodes:
            if node.state is State.INACTIVE and not self.failure:
                self._try(node, "activate")
        return all(node.state is State.ACTIVE for node in self.nodes)

    def reset(self) -> bool:
        """Bring all but the steady ones back to the start, last to first, and start them again.

        :returns: whether all are active.
        """
        for node in reversed(self.nodes):
            if not node.steady and node.state is not State.FINALIZED:
                self._wind_down(node, "reset")
        return self.startup()

    def shutdown(self) -> None:
        """Finalize all, last to first; a second call does nothing.

        :raises Exception: under the policy to raise: the first failure, when all are finalized.
        """
        failures: list[Exception] = []
        for node in reversed(self.nodes):
            if node.state is not State.FINALIZED:
                reason = node.reason or "shut down"
                _attempt(partial(self._try, node, "shutdown", reason), failures)
        if failures:
            raise failures[0]

    # -- one of them

    def start_one(self, name: str) -> None:
        """Bring one component to be active; no error when it is.

        A failure is an error for the caller, whatever the policy.

        :raises LifecycleError: when there is no such component, or it cannot be started.
        """
        self.start(self._changeable(name))

    def start(self, node: ManagedNode[Any]) -> None:
        """As :meth:`start_one`."""
        name = node.name
        if node.state is State.FINALIZED:
            raise LifecycleError(f"{name} was shut down", hint="it comes back when the daemon starts again")
        for state, step in ((State.UNCONFIGURED, "configure"), (State.INACTIVE, "activate")):
            if node.state is state and not self._step(node, step):
                raise LifecycleError(f"{name} cannot {step}: {node.reason}")

    def stop_one(self, name: str) -> None:
        """Bring one component back to the start; no error when it is unconfigured.

        :raises LifecycleError: when there is no such component.
        """
        node = self._changeable(name)
        if node.state not in (State.UNCONFIGURED, State.FINALIZED):
            self._wind_down(node, "unloaded")

    def find(self, name: str) -> ComponentStatus:
        """Return a description of one component.

        :raises LifecycleError: when there is none of that name.
        """
        for status in self.status():
            if status.name == name:
                return status
        names = ", ".join(node.name for node in self.nodes)
        raise LifecycleError(f"there is no component '{name}'", hint=f"there are: {names}")

    def change_one(self, name: str, transition: str) -> None:
        """Let one component take one step of its life.

        A failure is an error for the caller, whatever the policy. A component that was shut down stays so.

        :param transition: the name of a :class:`Transition`.
        :raises LifecycleError: when there is no such component or transition, the component is not in a state
            for it, or fails at it.
        """
        node = self._changeable(name)
        if transition not in list(Transition):
            raise LifecycleError(
                f"there is no transition '{transition}'", hint=f"use one of: {', '.join(Transition)}"
            )
        wanted = _FROM[Transition(transition)]
        if node.state not in wanted:
            states = " or ".join(state.name.lower() for state in wanted)
            raise LifecycleError(
                f"{name} cannot {transition}: it is {node.state.name.lower()}, it would have to be {states}"
            )
        reason = "" if transition == Transition.ACTIVATE else f"{transition} on request"
        if not self._step(node, transition, reason):
            raise LifecycleError(f"{name} cannot {transition}: {node.reason}")

    def _changeable(self, name: str) -> ManagedNode[Any]:
        names = [node.name for node in self.nodes if not node.steady]
        for node in self.nodes:
            if node.name == name and name in names:
                return node
        raise LifecycleError(
            f"there is no component '{name}' to change", hint=f"there are: {', '.join(names)}"
        )

    def watch(self) -> None:
        """Ask every active component whether it still works."""
        for node in self.nodes:
            if node.state is State.ACTIVE:
                try:
                    node.check()
                except Exception as error:  # noqa: BLE001 - a component may fail in any way
                    self.fail(node, error)

    def guarded(self, node: ManagedNode[Any], step: Callable[[], object]) -> Callable[[], None]:
        """Return ``step`` as the main loop may call it: while the node is active, and never raising."""

        def run() -> None:
            if node.state is State.ACTIVE:
                try:
                    step()
                except Exception as error:  # noqa: BLE001 - a component may fail in any way
                    self.fail(node, error)

        return run

    def fail(self, node: ManagedNode[Any], error: Exception) -> None:
        """Take a component that failed out of service; by the policy, ask for the end of all."""
        reason = _words(error)
        self._say(Level.ERROR, f"{node.name} failed: {reason}")
        self._wind_down(node, reason)
        if self.policy is Policy.STOP and not self.failure:
            self.failure, self.failure_error = f"{node.name}: {reason}", error

    def _wind_down(self, node: ManagedNode[Any], reason: str) -> None:
        if node.state is State.ACTIVE:
            self._try(node, "deactivate", reason)
        if node.state is State.INACTIVE:
            self._try(node, "cleanup", reason)
        node.reason = reason
        self.on_change()

    def _try(self, node: ManagedNode[Any], step: str, reason: str = "") -> None:
        """Let a component take a step of its life; by the policy, a failure asks for the end of all."""
        if not self._step(node, step, reason) and self.policy is Policy.STOP and not self.failure:
            self.failure, self.failure_error = f"{node.name}: {node.reason}", node.error

    def _step(self, node: ManagedNode[Any], step: str, reason: str = "") -> bool:
        """Let a component take a step of its life; return whether it did not fail."""
        before, done = node.state, True
        try:
            getattr(node, step)()
        except Exception as error:
            if self.policy is Policy.RAISE:
                raise  # close() closes the component
            if node.state is State.UNCONFIGURED:
                node.abort()
            words = _words(error)
            self._say(Level.ERROR, f"{node.name} cannot {step}: {words}")
            node.error, reason, done = error, words, False
        if node.state is not before:
            self._since[node.name] = self._clock.now_us()
            self._say(Level.DEBUG, f"{node.name} is {node.state.name.lower()}")
        node.reason = reason
        self.on_change()
        return done


def _attempt(step: Callable[[], object], failures: list[Exception]) -> None:
    """Take a step; note its failure."""
    try:
        step()
    except Exception as error:  # noqa: BLE001 - the caller raises the failure
        failures.append(error)


def _words(error: Exception) -> str:
    """Return the text of an error in one line; of an unexpected error its class as well."""
    if isinstance(error, BrokenAgentError):
        return error.message  # who has asked for the start gets to know each mistake
    text = str(error) if isinstance(error, CxbridgeError) else f"{type(error).__name__}: {error}"
    return "; ".join(line.strip() for line in text.splitlines())
