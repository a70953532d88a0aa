"""A run: an agent with its configuration, clock, blackboard and components.

Unless the agent is only inspected, the constructor makes the executive, so that recorders and servers can
subscribe before :meth:`Run.start` loads the first file. A team has a run for each agent
(:mod:`cxbridge.run.team`); a daemon is a run, too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, Self, TypeVar
from uuid import UUID, uuid4

from msgspec import Struct, field

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import Clock
from cxbridge.closing import Closing
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.events import EventBus
from cxbridge.executive.executive import ENVIRONMENT
from cxbridge.executive.features.pddl_parser import PddlParserFeature, reads_as_fawkes
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.mainloop import MainLoop
from cxbridge.plugins import installed_plugins, unused_section_warnings
from cxbridge.rights import Rights
from cxbridge.run.agents import agent_names, choose_agent, make_configured_clock, make_main_loop
from cxbridge.run.components.component import BaseExecutiveComponent, Component
from cxbridge.run.components.manager import ComponentManager, FailurePolicy, ManagedNode
from cxbridge.run.components.table import COMPONENTS, EXECUTIVE, needed_components
from cxbridge.run.options import RunOptions
from cxbridge.run.paths import RunPaths
from cxbridge.run.program.additions import NO_ADDITIONS, Additions
from cxbridge.run.rights import read_rights
from cxbridge.run.shared import SharedObjects
from cxbridge.run.source import source_of
from cxbridge.run.specs import find_missing_files
from cxbridge.trace.source_records import EarlySources

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cxbridge.executive.executive import Executive
    from cxbridge.executive.manager import EnvironmentManager
    from cxbridge.run.plugin_settings import PluginSettings
    from cxbridge.skiller.board.executor import Execution
    from cxbridge.skiller.board.service import SkillBoardService
    from cxbridge.skiller.board.settings import BoardSettings
    from cxbridge.space.navgraph import NavGraph

T = TypeVar("T")

MakeComponent = Callable[["Run"], Component]


class RunBase(Struct, frozen=True):
    """The configuration, clock, bus and loop of a run. The agents of a team share clock, bus and loop.

    :param name: the name of the CLIPS environment.
    :param early_sources: the files read before the recording begins; None in a run without recording.
    :param team: the base of the agent's team; None without a team.
    :ivar shared: the objects that plug-ins share within a run or a team.
    """

    name: str
    config: Configuration
    config_file: Path
    clock: Clock
    bus: EventBus
    loop: MainLoop
    early_sources: EarlySources | None = None
    team: RunBase | None = None
    shared: SharedObjects = field(default_factory=SharedObjects)


def make_base(options: RunOptions, clock: Clock | None = None, *, recorded: bool = False) -> RunBase:
    """Read the configuration, and make the clock, the bus and the main loop.

    :param clock: by default the clock of the options.
    :param recorded: whether a program records the run in addition to the options.
    :raises CxbridgeError: if a file is missing or wrong, or the scenario has no such agent.
    """
    source = source_of(options)
    config, config_file = source.load_configuration()
    name = options.agent or ENVIRONMENT
    if options.agent is not None:
        config = choose_agent(config, options.agent)
    clock = clock or make_configured_clock(options.clock_name, config, config_file.parent)
    bus = EventBus(clock)
    early_sources = EarlySources(bus) if (options.trace or recorded) and options.trace_files else None
    return RunBase(
        name,
        config,
        config_file,
        clock,
        bus,
        make_main_loop(source.loop_period_us(config), bus),
        early_sources,
    )


def make_only_base(options: RunOptions) -> RunBase:
    """Make the base of a run with one agent.

    :raises ConfigError: if the scenario has several agents and the options choose none.
    :raises CxbridgeError: as :func:`make_base`.
    """
    base = make_base(options)
    if names := [] if options.agent else agent_names(base.config):
        raise ConfigError(
            "this scenario has several agents",
            file=base.config_file,
            hint="choose one with --agent, or ask a recording of all, with --env; there are: "
            + ", ".join(names),
        )
    return base


class RecordedEnvironment(Protocol):
    """The environment of a recorded run, see :class:`~cxbridge.run.replay.replay.Replay`."""

    @property
    def board_class(self) -> type[LocalBlackBoard]: ...

    def components(self, run: Run) -> Iterator[Component]:
        """Make the components that play Skillers, executors and sensors."""

    def is_over(self, now_us: int, *, run_is_over: bool) -> bool:
        """Return whether the replay is over.

        :param run_is_over: whether the run itself has ended.
        """


class Run(Closing):
    """One agent with its components. :meth:`start` loads the agent; leaving a ``with`` block closes the run.

    :param base: the configuration, clock, bus and loop; by default made from the options.
    :param replay: the recorded environment, which replaces Skillers and local executors.
    :param additions: features, skills and writers of a program.
    :param components: functions that make components; these start before the components of the configuration.
    :param is_inspection: whether the agent is only inspected: no component starts, no configured module is
        imported.
    :raises CxbridgeError: if a named file or setting is missing or wrong.
    """

    has_executive = True
    """Whether the run has an executive; a daemon may have none."""

    waits_for_skiller = True
    """Whether the start waits for a remote Skiller, without which the run ends."""

    def __init__(
        self,
        options: RunOptions,
        base: RunBase | None = None,
        replay: RecordedEnvironment | None = None,
        additions: Additions = NO_ADDITIONS,
        components: Sequence[MakeComponent] = (),
        *,
        is_inspection: bool = False,
    ) -> None:
        base = base or make_only_base(options)
        self.name, self.config, self.early_sources = base.name, base.config, base.early_sources
        self.clock, self.bus, self.loop = base.clock, base.bus, base.loop
        self.source = source_of(options)
        # without actions that use a Skiller, its start would only cost time
        self.options = options if self.source.needs_skiller else replace(options, skiller="none")
        self.additions, self.is_inspection, self._first_components = additions, is_inspection, components
        self.replay = replay
        """The recorded environment; None in a run that is not a replay."""
        # logged by start(): consoles and recorders do not listen yet
        self.warnings = [str(plugin.error) for plugin in installed_plugins() if plugin.error is not None]
        self.warnings += [*unused_section_warnings(self.config.keys), *map(str, self.config.warnings)]
        self.spec, spec_warnings = (
            self.source.choose_spec(self.config, base.config_file) if self.has_executive else ("", [])
        )
        self.warnings += spec_warnings
        self.paths: RunPaths = self.source.find_paths(self.config, base.config_file)
        self.missing_files: list[ConfigError] = (
            find_missing_files(self.config, self.spec, self.paths.rule_dirs) if self.spec else []
        )
        """An error for each missing file of the spec, with its place in the configuration."""
        self.skill_board: BoardSettings | None = self.source.board_settings(
            self.config, self.paths, additions.executors
        )
        self.skill_service: SkillBoardService | None = None
        """The active skill board; None before its start and after its end."""
        self.execution: Execution | None = None
        """Executes the calls of the skill board's executors; None: the configured execution."""
        self.known_skills: dict[str, frozenset[str] | None] = {}
        """The skills by Skiller of this process; None: the Skiller accepts any skill."""
        self.pddl_parser = PddlParserFeature(as_fawkes=reads_as_fawkes(self.config))
        self.registry = InterfaceRegistry(self.paths.interface_dirs)
        self.board = (LocalBlackBoard if replay is None else replay.board_class)(
            self.registry, self.clock, self.bus, serials=_make_serial_generator(self.clock)
        )
        self.thinking_node: ManagedNode[BaseExecutiveComponent] | None = None
        # without one of its components a run would have other results, so any failure ends the run
        self.lifecycle = ComponentManager((), self.clock, policy=FailurePolicy.RAISE)
        self.team, self._shared = base.team, base.shared
        self._graph: NavGraph | None = None
        if not is_inspection:
            self._make_nodes()

    def _make_nodes(self) -> None:
        thinking: BaseExecutiveComponent = COMPONENTS.load_target(COMPONENTS.find(EXECUTIVE))(self)
        self.thinking_node = ManagedNode(EXECUTIVE, lambda: thinking, type(thinking), thinking)
        self.lifecycle.add(self.thinking_node)

    @property
    def thinking(self) -> BaseExecutiveComponent | None:
        """The component with the executive.

        None before it is made, in an inspection, and in a daemon without an executive.
        """
        return None if self.thinking_node is None else self.thinking_node.component

    @property
    def executive(self) -> Executive:
        """The executive of the agent."""
        assert self.thinking is not None
        return self.thinking.executive

    @property
    def manager(self) -> EnvironmentManager:
        """The manager of the CLIPS environments."""
        assert self.thinking is not None
        return self.thinking.manager

    @property
    def components(self) -> list[Component]:
        """The components that have been made and not yet closed."""
        return [node.component for node in self.lifecycle.nodes if node.component is not None]

    @property
    def navgraph(self) -> NavGraph:
        """The navigation graph, shared by skills and rules: both see the same blocked edges.

        :raises CxbridgeError: if no graph is configured or its file cannot be read.
        """
        if self._graph is None:
            from cxbridge.skiller.make import load_configured_navgraph  # noqa: PLC0415
            from cxbridge.space.navgraph import emit_navgraph  # noqa: PLC0415 - start-up time is a feature

            self._graph = load_configured_navgraph(self.config, self.paths.confdir)
            emit_navgraph(self.bus, self._graph)
        return self._graph

    def shared_object(self, make: Callable[[Self], T]) -> T:
        """Return the object that a plug-in shares within the run; the first call makes the object."""
        return self._shared.get_or_make(make, self)

    def section(self, name: str) -> PluginSettings | None:  # noqa: ARG002 - only a daemon has such settings
        """Return a plug-in's settings of a daemon; None in a run."""
        return None

    @property
    def rights(self) -> Rights:
        """The rights of clients."""
        return read_rights(self.config, self.options.skiller)

    @property
    def has_clients(self) -> bool:
        """Whether clients may send requests while the rules run, e.g. from a run's page."""
        return any(group.is_interactive for group in self.options.plugin_groups)

    @property
    def watch_level(self) -> str:
        """The level of a recording that determines the watched rules and facts.

        The level is ``facts``, which watches all, if clients may ask for them.
        """
        return "facts" if self.has_clients else self.options.trace_level

    def start(self) -> None:
        """Start the components and add them to the main loop, the executive last.

        :raises CxbridgeError: if a component cannot start.
        """
        node, thinking = self.thinking_node, self.thinking
        assert node is not None
        assert thinking is not None
        for warning in self.warnings:
            self.bus.logger("Config").warn(warning)
        if not self.executive.env.loader.is_quiet:
            for error in self.missing_files:
                self.bus.logger("Config").warn(f"{error.location}: {error.message}")
        thinking.watch()
        # the executive starts last, because its rules open interfaces and call features of all others
        if self.replay is not None:
            for component in self.replay.components(self):
                self._start_component(component)
        for make in self._first_components:
            self._start_component(make(self))
        for row in needed_components(self, is_replay=self.replay is not None):
            if row.name != EXECUTIVE:
                self._start_component(COMPONENTS.load_target(row)(self), row.name)
        self.lifecycle.start(node)
        self._enter_hooks(thinking)

    def _start_component(self, component: Component, name: str = "") -> None:
        node = ManagedNode(name or type(component).__name__, lambda: component, type(component), component)
        self.lifecycle.add(node)
        self.lifecycle.start(node)
        self._enter_hooks(component)

    def _enter_hooks(self, component: Component) -> None:
        for hook in component.hooks:
            self.loop.add(hook, component.loop)

    def attend(self) -> None:
        """Call the steady components, which also work while the main loop is paused."""
        for component in self.components:
            if component.steady:
                component.loop()

    @property
    def agents(self) -> tuple[Run, ...]:
        """The agents of the run."""
        return (self,)

    @property
    def firings(self) -> int:
        """The number of rule firings."""
        return 0 if self.thinking is None else self.thinking.firings

    @property
    def is_over(self) -> bool:
        """Whether the executive is over and no component has work to wait for.

        :attr:`Executive.is_over <cxbridge.executive.executive.Executive.is_over>` says when an executive is
        over. The recorded environment of a replay decides when the replay is over.
        """
        # a skill may run longer than the goal that started the skill
        is_over = self.executive.is_over and not any(component.running for component in self.components)
        return (
            is_over if self.replay is None else self.replay.is_over(self.clock.now_us(), run_is_over=is_over)
        )

    @property
    def is_quiet(self) -> bool:
        """Whether only rules can cause changes.

        All components are idle, and no replay is open.
        """
        return self.replay is None and all(component.is_quiet for component in self.components)

    @property
    def loss_reason(self) -> str:
        """The lost component that the run needs, with the reason; empty if none is lost."""
        return next((component.loss_reason for component in self.components if component.loss_reason), "")

    def interrupt(self) -> None:
        """Stop the current rule and all further rules. Callable from any thread."""
        if (thinking := self.thinking) is not None:
            thinking.executive.env.interrupt()

    def finalize(self) -> None:
        """Run the finalization rules of the executive."""
        if self.thinking is not None:
            self.thinking.finalize()

    def kill(self) -> None:
        """Stop as a killed process does: no finalization rule fires.

        The run keeps its resources until :meth:`close`.
        """
        if self.thinking is not None:
            self.thinking.skip_finalization()
        for component in self.components:
            for hook in component.hooks:
                self.loop.remove(hook, component.loop)

    def close(self) -> None:
        """Finalize the rules, stop the components and release all resources."""
        try:
            self.finalize()
            self.lifecycle.shutdown()
        finally:
            self.release()

    def release(self) -> None:
        """Close the blackboard and the shared objects."""
        self._shared.close()
        self.board.shutdown()


def _make_serial_generator(clock: Clock) -> Callable[[], UUID]:
    """Return the function that makes the serial of each interface instance."""
    if not clock.is_virtual:
        return uuid4
    # random serials would make two runs on a virtual clock differ
    numbers = count(1)
    return lambda: UUID(int=next(numbers), version=4)
