"""Several agents in one run, each with its environment, blackboard and Skillers.

See docs/several-agents.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Protocol

from msgspec import structs

from cxbridge.closing import Closing
from cxbridge.events import Event, EventBus, InterfaceMessage, Logger, Publication
from cxbridge.executive.robmem.settings import Settings
from cxbridge.run.agent import MakeComponent, Player, Run, RunBase
from cxbridge.run.agents import choose_agent
from cxbridge.run.options import RunOptions
from cxbridge.run.program.additions import NOTHING, Additions

if TYPE_CHECKING:
    from cxbridge.executive.robmem.store import Store


class AgentWatcher(Protocol):
    """Watches the agents of a run."""

    def left(self, agent: Run) -> None:
        """Take note of an agent that was killed."""

    def joined(self, agent: Run) -> None:
        """Take note of an agent that was made again and is not started yet."""


class Team(Closing):
    """A run of several agents, with the face of a :class:`Run`.

    :param options: the options of the run; checked.
    :param base: the clock, bus, loop and configuration that they share.
    :param names: the agents.
    :param replay: plays the environment of each.
    :param additions: what each gets besides.
    :param components: makes the components of an agent that no configuration names.
    :raises CxbridgeError: when something that the options or the configuration name is missing or wrong.
    """

    def __init__(
        self,
        options: RunOptions,
        base: RunBase,
        names: list[str],
        replay: Player | None = None,
        additions: Additions = NOTHING,
        components: Callable[[str], Sequence[MakeComponent]] = lambda _name: (),
    ) -> None:
        self.bus, self.clock, self.loop = base.bus, base.clock, base.loop
        self.config, self.early = base.config, base.early
        self._memory = SharedMemory(base)
        self.options, self._base, self._additions = options, base, additions
        self._components = components
        self._dead: list[Run] = []
        self.watchers: list[AgentWatcher] = []
        """Called when an agent is killed or started again."""
        with ExitStack() as undo:
            undo.callback(self._memory.close)
            made = []
            for name in names:
                part = None if replay is None else replay.of_agent(name)
                one = self._one(base, name)
                agent = Run(options, one, part, additions, components(name))
                made.append(undo.enter_context(agent))
            undo.pop_all()
        self.agents: tuple[Run, ...] = tuple(made)
        self.paths, self.registry = self.agents[0].paths, self.agents[0].registry
        self.spec = " ".join(dict.fromkeys(agent.spec for agent in self.agents))

    def _one(self, base: RunBase, name: str) -> RunBase:
        config = choose_agent(base.config, name)
        config.warnings = ()  # they are reported once
        return replace(
            base,
            name=name,
            config=config,
            bus=AgentBus(name, base.bus),
            embedded=partial(self._memory.part, name),
        )

    def start(self) -> None:
        """Start all agents."""
        for warning in self.config.warnings:
            self.bus.logger("Config").warn(str(warning))
        for agent in self.agents:
            agent.start()

    def kill(self, agent: Run) -> None:
        """Let an agent end as by ``kill -9``; the databases that it shares with other agents do not change.

        To be called between two loops. The agent is none of :attr:`agents` any more.
        """
        agent.kill()
        self._dead.append(agent)
        self.agents = tuple(other for other in self.agents if other is not agent)
        for watcher in self.watchers:
            watcher.left(agent)

    def reorder(self, names: Sequence[str]) -> None:
        """Let the agents take their turns in this order from the next loop on."""
        for agent in self.agents:
            agent.leave_loop()
        self.agents = tuple(sorted(self.agents, key=lambda agent: names.index(agent.name)))
        for agent in self.agents:
            agent.enter_loop()

    def restart(self, name: str) -> None:
        """Make and start an agent that was killed, as a process that starts again.

        :raises CxbridgeError: when the agent cannot be made.
        """
        one, more = self._one(self._base, name), self._components(name)
        agent = Run(self.options, one, None, self._additions, more)
        self.agents = (*self.agents, agent)
        for watcher in self.watchers:
            watcher.joined(agent)
        agent.start()

    @property
    def is_over(self) -> bool:
        """Whether all agents have nothing left to do."""
        return all(agent.is_over for agent in self.agents)

    @property
    def loss(self) -> str:
        """Why the run cannot come to its end; empty while it can."""
        return next((agent.loss for agent in self.agents if agent.loss), "")

    def interrupt(self) -> None:
        """End the rules that fire now, and let no rule fire any more. From any thread."""
        for agent in self.agents:
            agent.interrupt()

    def finalize(self) -> None:
        """Run the rules of all agents for the shutdown."""
        for agent in self.agents:
            agent.finalize()

    def close(self) -> None:
        """Stop everything and let go of it."""
        with ExitStack() as stack:
            stack.callback(self._memory.close)
            for agent in (*self._dead, *self.agents):
                stack.callback(agent.close)
            self.finalize()


class AgentBus(EventBus):
    """The bus of one agent of several: its events go to the run's bus, too, under the agent's name.

    :param name: the agent's, which is that of its environment.
    :param run: the bus of the run.
    """

    def __init__(self, name: str, run: EventBus) -> None:
        super().__init__(run.clock)
        self._name = name
        self._run = run

    def wants(self, event_type: type[Event]) -> bool:
        """Whether anybody listens to this type, here or there."""
        return super().wants(event_type) or self._run.wants(event_type)

    def emit(self, event: Event) -> None:
        """Hand ``event`` to the sinks here, and, with the agent's name, to those of the run."""
        super().emit(event)
        if isinstance(event, Publication | InterfaceMessage):
            kind, mark, own = event.uid.partition("::")
            event = structs.replace(event, uid=f"{kind}{mark}{self._name}/{own}")
        self._run.emit(event)

    def logger(self, component: str) -> Logger:
        """Return a logger for a component of the agent."""
        named = component.endswith((f"({self._name})", f"|{self._name}"))
        return Logger(self, component if named else f"{self._name}/{component}")


class SharedMemory:
    """The shared part of the embedded robot memories of a run's agents: the distributed databases.

    :param base: whose configuration says where they survive.
    """

    def __init__(self, base: RunBase) -> None:
        self._base = base
        self._store: Store | None = None

    def part(self, agent: str, settings: Settings) -> Store:
        """Return an agent's robot memory: its databases, and the shared ones.

        :raises CxbridgeError: when a file cannot be used.
        """
        # most runs have no robot memory
        from cxbridge.executive.robmem.embedded import EmbeddedStore  # noqa: PLC0415
        from cxbridge.executive.robmem.split import SplitStore  # noqa: PLC0415

        clock = self._base.clock
        if self._store is None:
            shared = Settings.read(self._base.config)
            self._store = EmbeddedStore(clock, shared.file)
        file = settings.file
        own = None if file is None else file.with_name(f"{file.stem}-{agent}{file.suffix}")
        return SplitStore(EmbeddedStore(clock, own), self._store, settings.distributed)

    def close(self) -> None:
        """Close it."""
        if self._store is not None:
            self._store.close()
            self._store = None
