"""Several agents in one run, each with its own environment, blackboard and Skillers.

See docs/several-agents.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import Protocol

from msgspec import structs

from cxbridge.closing import Closing
from cxbridge.events import Event, EventBus, InterfaceMessage, Logger, Publication
from cxbridge.run.agent import MakeComponent, Run, RunBase
from cxbridge.run.agents import choose_agent
from cxbridge.run.options import RunOptions
from cxbridge.run.program.additions import NO_ADDITIONS, Additions
from cxbridge.run.shared import SharedObjects


class AgentWatcher(Protocol):
    """An observer of the agents of a run."""

    def left(self, agent: Run) -> None:
        """Handle an agent that was killed."""

    def joined(self, agent: Run) -> None:
        """Handle an agent that was restarted, before it starts."""


class Team(Closing):
    """A run of several agents, with the interface of a :class:`Run`.

    :param base: the shared clock, bus, loop and configuration.
    :param names: the names of the agents, in the order of their steps.
    :param components: returns, for the name of an agent, functions that make further components.
    :raises CxbridgeError: if a named file or setting is missing or wrong.
    """

    def __init__(
        self,
        options: RunOptions,
        base: RunBase,
        names: list[str],
        additions: Additions = NO_ADDITIONS,
        components: Callable[[str], Sequence[MakeComponent]] = lambda _name: (),
    ) -> None:
        self.bus, self.clock, self.loop = base.bus, base.clock, base.loop
        self.config, self.early_sources = base.config, base.early_sources
        self.options, self._base, self._additions = options, base, additions
        self._component_makers = components
        self._killed: list[Run] = []  # killed agents keep their resources until the end of the team
        self.watchers: list[AgentWatcher] = []
        """Observers that the team informs when an agent is killed or restarted."""
        with ExitStack() as undo:
            undo.callback(base.shared.close)
            self.agents = tuple([undo.enter_context(self._make_agent(name)) for name in names])
            undo.pop_all()
        self.paths, self.registry = self.agents[0].paths, self.agents[0].registry
        self.spec = " ".join(dict.fromkeys(agent.spec for agent in self.agents))

    def _make_agent(self, name: str) -> Run:
        config = choose_agent(self.config, name)
        config.warnings = ()  # reported once, by the team
        base = structs.replace(
            self._base,
            name=name,
            config=config,
            bus=AgentBus(name, self.bus),
            team=self._base,
            shared=SharedObjects(),
        )
        return Run(self.options, base, None, self._additions, self._component_makers(name))

    def start(self) -> None:
        """Start the agents one after the other."""
        for warning in self.config.warnings:
            self.bus.logger("Config").warn(str(warning))
        for agent in self.agents:
            agent.start()

    def kill(self, agent: Run) -> None:
        """Kill an agent as ``kill -9`` does. Its data in a shared database stays.

        To be called between two loops. Removes the agent from :attr:`agents`.
        """
        agent.kill()
        self._killed.append(agent)
        self.agents = tuple(member for member in self.agents if member is not agent)
        for watcher in self.watchers:
            watcher.left(agent)

    def restart(self, name: str) -> None:
        """Start a killed agent again, as a new process would.

        :raises CxbridgeError: if the agent cannot be made.
        """
        agent = self._make_agent(name)
        self.agents = (*self.agents, agent)
        for watcher in self.watchers:
            watcher.joined(agent)
        agent.start()

    @property
    def is_over(self) -> bool:
        """Whether all agents have finished, except killed agents."""
        return all(agent.is_over for agent in self.agents)

    @property
    def loss_reason(self) -> str:
        """The lost component that the run needs, with the reason; empty if none is lost."""
        return next((agent.loss_reason for agent in self.agents if agent.loss_reason), "")

    def interrupt(self) -> None:
        """Stop the current rules and all further rules. Callable from any thread."""
        for agent in self.agents:
            agent.interrupt()

    def finalize(self) -> None:
        """Run the finalization rules of all agents."""
        for agent in self.agents:
            agent.finalize()

    def close(self) -> None:
        """Stop all agents and release their resources."""
        # the stack closes the last agent first and the shared objects last, even after an error
        with ExitStack() as stack:
            stack.callback(self._base.shared.close)
            for agent in (*self._killed, *self.agents):
                stack.callback(agent.close)
            self.finalize()


class AgentBus(EventBus):
    """The bus of one agent in a team. It forwards events to the run's bus under the agent's name."""

    def __init__(self, name: str, run_bus: EventBus) -> None:
        super().__init__(run_bus.clock)
        self._name, self._run_bus = name, run_bus

    def wants(self, event_type: type[Event]) -> bool:
        """Return whether this bus or the run's bus has a subscriber for the type."""
        return super().wants(event_type) or self._run_bus.wants(event_type)

    def emit(self, event: Event) -> None:
        """Emit an event here, and on the run's bus with the agent's name."""
        super().emit(event)
        if isinstance(event, Publication | InterfaceMessage):
            # each agent has a Skiller of the same id on its own blackboard
            kind, separator, interface = event.uid.partition("::")
            event = structs.replace(event, uid=f"{kind}{separator}{self._name}/{interface}")
        self._run_bus.emit(event)

    def logger(self, component: str) -> Logger:
        """Return a logger for a component, named after agent and component."""
        # the log names of an agent's CLIPS environment contain its name: CLIPS (NAME), CLIPS|NAME
        has_name = component.endswith((f"({self._name})", f"|{self._name}"))
        return Logger(self, component if has_name else f"{self._name}/{component}")
