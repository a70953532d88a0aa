"""A run: an agent with its configuration, clock, blackboard and components."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeVar
from uuid import UUID, uuid4

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import Clock
from cxbridge.closing import Closing
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.events import EventBus
from cxbridge.executive.executive import ENVIRONMENT
from cxbridge.executive.features.pddl_parser import PddlParserFeature, reads_as_fawkes
from cxbridge.executive.robmem.memory import RobotMemory
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.mainloop import Hook, MainLoop
from cxbridge.plugins import installed_plugins, sections_without_package
from cxbridge.rights import Rights
from cxbridge.run.agents import agent_names, choose_agent, clock_of, make_main_loop
from cxbridge.run.components.component import Component, ThinkingComponent
from cxbridge.run.components.manager import ComponentManager, ManagedNode, Policy
from cxbridge.run.components.table import COMPONENTS, EXECUTIVE, needed_components
from cxbridge.run.options import RunOptions
from cxbridge.run.paths import RunPaths, find_missing
from cxbridge.run.program.additions import NOTHING, Additions
from cxbridge.run.rights import read_rights
from cxbridge.run.source import skill_board_settings, source_of
from cxbridge.run.specs import check_spec, choose_spec, mistaken_keys
from cxbridge.trace.sourcing import EarlySources

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cxbridge.executive.executive import Executive
    from cxbridge.executive.manager import EnvironmentManager
    from cxbridge.executive.robmem.settings import Settings
    from cxbridge.executive.robmem.store import Store
    from cxbridge.run.plugin_settings import PluginSettings
    from cxbridge.skiller.board.executor import Execution
    from cxbridge.skiller.board.service import SkillBoardService
    from cxbridge.skiller.board.settings import BoardSettings
    from cxbridge.space.navgraph import NavGraph

T = TypeVar("T")

MakeComponent = Callable[["Run"], Component]
"""Makes a component of a run."""


@dataclass(frozen=True, slots=True)
class RunBase:
    """Configuration, clock, bus and loop of a run; the runs of a team share most of them.

    :param name: of the CLIPS environment.
    :param early: the files that were read before the recording begins; None when they are not recorded.
    :param embedded: makes the embedded robot memory of an agent of a team.
    """

    name: str
    config: Configuration
    config_file: Path
    clock: Clock
    bus: EventBus
    loop: MainLoop
    early: EarlySources | None = None
    embedded: Callable[[Settings], Store] | None = None


def make_base(options: RunOptions, clock: Clock | None = None, *, recorded: bool = False) -> RunBase:
    """Read the configuration that the options name, and make a clock, a bus and a main loop.

    :param clock: None: the clock of the options.
    :param recorded: whether a program records the run, besides the recordings of the options.
    :raises CxbridgeError: when a file is missing or wrong, or the scenario has no agent of that name.
    """
    source = source_of(options)
    config, config_file = source.load_configuration()
    name = options.agent or ENVIRONMENT
    if options.agent is not None:
        config = choose_agent(config, options.agent)
    clock = clock or clock_of(options.clock_name, config, config_file.parent)
    bus = EventBus(clock)
    early = EarlySources(bus) if (options.trace or recorded) and options.trace_files else None
    loop = make_main_loop(source.loop_period_us(config), bus)
    return RunBase(name, config, config_file, clock, bus, loop, early)


def make_only_base(options: RunOptions) -> RunBase:
    """As :func:`make_base`, for a run of one agent.

    :raises CxbridgeError: when the scenario has several agents, and the options choose none.
    """
    base = make_base(options)
    names = [] if options.agent else agent_names(base.config)
    if names:
        known = ", ".join(names)
        hint = f"choose one with --agent, or ask a recording of all, with --env; there are: {known}"
        raise ConfigError("this scenario has several agents", file=base.config_file, hint=hint)
    return base


class Player(Protocol):
    """Plays the environment of a recorded run: :class:`~cxbridge.run.replay.replay.Replay`."""

    @property
    def board_class(self) -> type[LocalBlackBoard]:
        """The class of the run's blackboard."""

    def of_agent(self, name: str) -> Player:
        """Return the player of one agent of several."""

    def make_planning(self, env: str) -> Any:
        """Make the PlanningService of an environment."""

    def components(self, run: Run) -> Iterator[Component]:
        """Make the players of Skillers, executors and sensors."""

    def is_over(self, now_us: int, *, run_is_over: bool) -> bool:
        """Return whether the recorded run has been played."""


class Run(Closing):
    """An agent that runs: made by its construction, loaded by :meth:`start`. A context manager.

    :param options: checked.
    :param base: configuration, clock, bus and loop; None: those that the options name.
    :param replay: plays the environment, in place of Skillers and of executors of this process.
    :param additions: the features, skills and writers of a program.
    :param components: make components that no configuration names; these start first.
    :param is_look: whether the agent is only looked at: it has no components, and no module that its
        configuration names is imported.
    :raises CxbridgeError: when something that the options or the configuration name is missing or wrong.
    """

    has_executive = True
    """Whether an executive is wanted."""

    waits_for_skiller = True
    """Whether a Skiller elsewhere must exist from the start to the end."""

    def __init__(
        self,
        options: RunOptions,
        base: RunBase | None = None,
        replay: Player | None = None,
        additions: Additions = NOTHING,
        components: Sequence[MakeComponent] = (),
        *,
        is_look: bool = False,
    ) -> None:
        base = base or make_only_base(options)
        self.name, self.config, self.early = base.name, base.config, base.early
        self.clock, self.bus, self.loop = base.clock, base.bus, base.loop
        self.source = source_of(options)
        self.options = options if self.source.needs_skiller else replace(options, skiller="none")
        self.additions, self.is_look, self._replay, self._more = additions, is_look, replay, components
        self.warnings = [str(each.error) for each in installed_plugins() if each.error is not None]
        self.warnings += [*sections_without_package(self.config.keys), *map(str, self.config.warnings)]
        self.spec = self._choose_spec(base) if self.has_executive else ""
        self.paths: RunPaths = self.source.find_paths(self.config, base.config_file)
        self.warnings += self.source.find_oddities(self.config, self.spec) if self.spec else ()
        self.missing: list[ConfigError] = (
            find_missing(self.config, self.spec, self.paths) if self.spec else []
        )
        """For each file that the spec loads and that does not exist, where the configuration names it."""
        self.skill_board: BoardSettings | None = self.source.board_settings(
            skill_board_settings(self.config, self.paths, additions.executors), self.config
        )
        self.skill_service: SkillBoardService | None = None
        """The skill board, while its component is at work."""
        self.execution: Execution | None = None
        """How executors of the skill board execute calls; None: as the configuration says."""
        self.known_skills: dict[str, frozenset[str] | None] = {}
        """The skills of each Skiller of this process, by its name; None: the Skiller has any."""
        self.make_planning = additions.planning if replay is None else replay.make_planning
        """Makes what plans for the environment of that name; None: planners."""
        self.pddl_parser = PddlParserFeature(as_fawkes=reads_as_fawkes(self.config))
        self.registry = InterfaceRegistry(self.paths.interface_dirs)
        board_class = LocalBlackBoard if replay is None else replay.board_class
        self.board = board_class(self.registry, self.clock, self.bus, serials=_serials(self.clock))
        self.memory = RobotMemory(self.config, self.clock, self.bus, self.board, embedded=base.embedded)
        self.loop.add(Hook.WORLDSTATE, self.memory.attend)
        self.thinking_node: ManagedNode[ThinkingComponent] | None = None
        self.lifecycle = ComponentManager((), self.clock, policy=Policy.RAISE)
        self._made: dict[Callable[[Self], Any], Any] = {}
        self._graph: NavGraph | None = None
        if not is_look:
            self._make_nodes()

    def _choose_spec(self, base: RunBase) -> str:
        """Return the spec; note oddities of the configuration.

        :raises CxbridgeError: when there is no such spec, or a key is misspelt.
        """
        config, source = self.config, self.source
        spec = choose_spec(config, self.options.spec, base.config_file)
        mistaken = mistaken_keys(config, spec)
        if mistaken and not source.is_lenient:
            raise mistaken[0]
        self.warnings += map(str, check_spec(config, spec))
        known = "\n".join(self.warnings)
        self.warnings += [str(each) for each in mistaken if each.location not in known]
        return spec

    def _make_nodes(self) -> None:
        """Make the executive: recorders and servers watch it before it loads the agent."""
        made: ThinkingComponent = COMPONENTS.load(COMPONENTS.find(EXECUTIVE))(self)
        self.thinking_node = ManagedNode(EXECUTIVE, lambda: made, type(made), made)
        self.lifecycle.add(self.thinking_node)

    # -- what its parts share

    @property
    def thinking(self) -> ThinkingComponent | None:
        """The component of the executive; None while it does not exist."""
        return None if self.thinking_node is None else self.thinking_node.component

    @property
    def executive(self) -> Executive:
        """The executive."""
        assert self.thinking is not None
        return self.thinking.executive

    @property
    def manager(self) -> EnvironmentManager:
        """The CLIPS environments of the executive."""
        assert self.thinking is not None
        return self.thinking.manager

    @property
    def components(self) -> list[Component]:
        """The components that exist."""
        return [node.component for node in self.lifecycle.nodes if node.component is not None]

    @property
    def navgraph(self) -> NavGraph:
        """The navigation graph, one for skills and rules: an edge that is blocked is blocked for both.

        :raises CxbridgeError: when the configuration names no graph, or the graph cannot be read.
        """
        if self._graph is None:
            from cxbridge.skiller.make import load_configured_navgraph  # noqa: PLC0415
            from cxbridge.space.navgraph import emit_navgraph  # noqa: PLC0415 - start-up time is a feature

            self._graph = load_configured_navgraph(self.config, self.paths.confdir)
            emit_navgraph(self.bus, self._graph)
        return self._graph

    def one_of(self, make: Callable[[Self], T]) -> T:
        """Return an object that the parts of a plug-in share; the first call makes the object.

        :param make: makes the object of a run.
        """
        if make not in self._made:
            self._made[make] = make(self)
        found: T = self._made[make]
        return found

    def section(self, name: str) -> PluginSettings | None:  # noqa: ARG002 - only a daemon has them
        """Return the settings of a daemon for a plug-in; None in a run."""
        return None

    @property
    def rights(self) -> Rights:
        """What clients may do."""
        return read_rights(self.config, self.options.skiller)

    @property
    def has_clients(self) -> bool:
        """Whether clients may ask questions while the rules are at work, e.g. on the page of a run."""
        return any(group.is_interactive for group in self.options.more)

    # -- its life

    def start(self) -> None:
        """Start the components, and join them to the main loop; the executive is the last."""
        node, thinking = self.thinking_node, self.thinking
        assert node is not None
        assert thinking is not None
        for warning in self.warnings:
            self.bus.logger("Config").warn(warning)
        if not self.executive.env.loader.quiet:
            for missing in self.missing:
                self.bus.logger("Config").warn(f"{missing.location}: {missing.message}")
        thinking.watch()
        if self._replay is not None:
            for component in self._replay.components(self):
                self._start(component)
        for make in self._more:
            self._start(make(self))
        for row in needed_components(self, replayed=self._replay is not None):
            if row.name != EXECUTIVE:
                self._start(COMPONENTS.load(row)(self), row.name)
        self.lifecycle.start(node)
        self._join(thinking)

    def _start(self, component: Component, name: str = "") -> None:
        node = ManagedNode(name or type(component).__name__, lambda: component, type(component), component)
        self.lifecycle.add(node)
        self.lifecycle.start(node)
        self._join(component)

    def _join(self, component: Component) -> None:
        for hook in component.hooks:
            self.loop.add(hook, component.loop)

    def attend(self) -> None:
        """Let the steady components work while the main loop rests."""
        for component in self.components:
            if component.steady:
                component.loop()

    def leave_loop(self) -> None:
        """Take no steps in the main loop until :meth:`enter_loop`."""
        for component in self.components:
            for hook in component.hooks:
                self.loop.remove(hook, component.loop)
        self.loop.remove(Hook.WORLDSTATE, self.memory.attend)

    def enter_loop(self) -> None:
        """Take steps in the main loop again, after those of all other agents."""
        self.loop.add(Hook.WORLDSTATE, self.memory.attend)
        for component in self.components:
            self._join(component)

    @property
    def agents(self) -> tuple[Run, ...]:
        """The agents of the run: this one."""
        return (self,)

    @property
    def firings(self) -> int:
        """How many rules have fired."""
        return 0 if self.thinking is None else self.thinking.firings

    @property
    def is_over(self) -> bool:
        """Whether every root goal is retracted or gone or maintains, no skill runs and the agenda is empty.

        Of a replay: whether the recorded run has been played.
        """
        over = self.executive.is_over and not any(component.running for component in self.components)
        if self._replay is None:
            return over
        return self._replay.is_over(self.clock.now_us(), run_is_over=over)

    @property
    def is_quiet(self) -> bool:
        """Whether nothing happens by itself, but by rules: no component works, nothing comes from outside."""
        return (
            self._replay is None
            and not self.memory.is_open
            and all(component.is_quiet for component in self.components)
        )

    @property
    def is_stuck(self) -> bool:
        """Whether nothing can happen any more."""
        return self.thinking is not None and self.thinking.is_stuck

    @property
    def loss(self) -> str:
        """Why the run cannot come to its end: a component of it is gone; empty while all exist."""
        return next((component.loss for component in self.components if component.loss), "")

    def interrupt(self) -> None:
        """End the rule that fires now, and let no rule fire any more. From any thread, at any time."""
        if (thinking := self.thinking) is not None:
            thinking.executive.env.interrupt()

    def finalize(self) -> None:
        """Let the executive's rules run their finalization."""
        if self.thinking is not None:
            self.thinking.finalize()

    def kill(self) -> None:
        """Do nothing any more, as a process that was killed: no rule fires for the shutdown.

        The run keeps its resources until :meth:`close`.
        """
        if self.thinking is not None:
            self.thinking.forgo_finalization()
        self.leave_loop()

    def close(self) -> None:
        """Stop everything and release it."""
        try:
            self.finalize()
            self.lifecycle.shutdown()
        finally:
            self.release()

    def release(self) -> None:
        """Close blackboard and robot memory, after the components."""
        self.memory.close()
        self.board.shutdown()


def _serials(clock: Clock) -> Callable[[], UUID]:
    """Return what makes instances' serials: on a virtual clock runs repeat, so these must."""
    if not clock.is_virtual:
        return uuid4
    numbers = count(1)
    return lambda: UUID(int=next(numbers), version=4)
