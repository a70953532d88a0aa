"""The context that the components of a run share, made from its configuration and options."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import count
from typing import TYPE_CHECKING, Any, Self, TypeVar
from uuid import UUID, uuid4

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import Clock
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.events import EventBus
from cxbridge.executive.features.pddl_parser import PddlParserFeature, reads_as_fawkes
from cxbridge.executive.robmem.memory import RobotMemory
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.mainloop import Hook, MainLoop
from cxbridge.plugins import installed_plugins, sections_without_package
from cxbridge.rights import Rights
from cxbridge.run.agent_context import AgentContext
from cxbridge.run.options import RunOptions
from cxbridge.run.paths import RunPaths, find_missing
from cxbridge.run.program.additions import NOTHING, Additions
from cxbridge.run.rights import read_rights
from cxbridge.run.shared import SharedNavGraph, SharedSkillBoard
from cxbridge.run.source import Source, source_of
from cxbridge.run.specs import check_spec, choose_spec, mistaken_keys
from cxbridge.skiller.backend import DEFAULT_SKILLER, INSTANCES
from cxbridge.trace.sourcing import EarlySources

if TYPE_CHECKING:
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.planning.service import PlanningService
    from cxbridge.run.plugin_settings import PluginSettings
    from cxbridge.skiller.board.executor import SkillExecutor
    from cxbridge.skiller.board.settings import BoardSettings

T = TypeVar("T")

_SKILL_BOARD = "/skill-board"


@dataclass(kw_only=True)
class RunContext:
    """What every component needs.

    :param name: of the executive's CLIPS environment.
    :param spec: the executive's spec; empty without an executive.
    :param options: who executes skills, what is spoken and what is recorded.
    :param paths: where the files are.
    :param board: the blackboard that the components meet on.
    :param memory: the robot memory; opened by the first that asks for its store.
    :param warnings: what is strange about configuration and files.
    :param missing: for each file that the spec loads and that is not there, where it names it.
    :param known_skills: the skills of each Skiller of this process, by its name; None: it has any.
    :param early: what was read before the recording began; None when nobody wants it.
    :param skill_board: the settings of the skill board; None without one.
    :param skills: the skill board itself.
    :param navgraph: the navigation graph, one for skills and rules.
    :param made: the objects of :meth:`one_of`.
    :param pddl_parser: the PDDL domains of the environments, one for rules and planners.
    :param make_planning: makes what plans for the environment of that name; None: planners.
    :param source: where the files of the agent come from, and how its executive differs.
    :param is_look: whether the agent is only looked at: no module that its configuration names is imported.
    :param waits_for_skiller: whether a Skiller elsewhere must be there from the start to the end.
    :param additions: what a program adds to the run.
    :param executive: the executive, once the agent is loaded; None before, and after it was closed.
    """

    name: str
    spec: str
    config: Configuration
    options: RunOptions
    paths: RunPaths
    source: Source
    clock: Clock
    bus: EventBus
    loop: MainLoop
    registry: InterfaceRegistry
    board: LocalBlackBoard
    memory: RobotMemory
    warnings: list[str]
    missing: list[ConfigError] = field(default_factory=list)
    known_skills: dict[str, frozenset[str] | None] = field(default_factory=dict)
    early: EarlySources | None = None
    skill_board: BoardSettings | None = None
    skills: SharedSkillBoard = field(default_factory=SharedSkillBoard)
    navgraph: SharedNavGraph = field(default_factory=SharedNavGraph)
    made: dict[Callable[[RunContext], Any], Any] = field(default_factory=dict)
    pddl_parser: PddlParserFeature = field(default_factory=PddlParserFeature)
    make_planning: Callable[[str], PlanningService] | None = None
    is_look: bool = False
    waits_for_skiller: bool = True
    additions: Additions = NOTHING
    executive: Executive | None = None

    @property
    def has_clients(self) -> bool:
        """Whether clients may ask questions while the rules are at work, e.g. on the page of a run."""
        return any(group.is_interactive for group in self.options.more)

    def one_of(self, make: Callable[[RunContext], T]) -> T:
        """Return an object that the parts of a plug-in share; the first call makes the object.

        :param make: makes the object of a run from its context.
        """
        if make not in self.made:
            self.made[make] = make(self)
        found: T = self.made[make]
        return found

    def section(self, name: str) -> PluginSettings | None:  # noqa: ARG002 - only a daemon has them
        """Return the settings of a daemon for a plug-in; None in a run."""
        return None

    @property
    def rights(self) -> Rights:
        """What clients may do."""
        return read_rights(self.config, self.options.skiller)

    @classmethod
    def make(
        cls,
        agent: AgentContext,
        options: RunOptions,
        *,
        executive: bool = True,
        board_class: type[LocalBlackBoard] = LocalBlackBoard,
        additions: Additions = NOTHING,
        **more: Any,
    ) -> Self:
        """Choose the spec, find the files, and make the blackboard and the robot memory.

        :param executive: whether there shall be one.
        :param more: fields of the class.
        :raises CxbridgeError: when something that the options or the configuration name is missing or wrong.
        """
        config, clock, bus = agent.config, agent.clock, agent.bus
        source = source_of(options)
        if not source.needs_skiller:
            options = replace(options, skiller="none")
        spec = choose_spec(config, options.spec, agent.config_file) if executive else ""
        mistaken = mistaken_keys(config, spec) if spec else []
        if mistaken and not source.is_lenient:
            raise mistaken[0]
        broken = [str(plugin.error) for plugin in installed_plugins() if plugin.error is not None]
        unused = sections_without_package(config.keys)
        warnings = [*broken, *unused, *map(str, config.warnings), *(check_spec(config, spec) if spec else ())]
        known = "\n".join(warnings)
        warnings += [str(each) for each in mistaken if each.location not in known]
        paths = source.find_paths(config, agent.config_file)
        warnings += source.find_oddities(config, spec) if spec else ()
        skill_board = source.board_settings(skill_board_settings(config, paths, additions.executors), config)
        registry = InterfaceRegistry(paths.interface_dirs)
        board = board_class(registry, clock, bus, serials=_serials(clock))
        memory = RobotMemory(config, clock, bus, board, embedded=agent.embedded)
        agent.loop.add(Hook.WORLDSTATE, memory.attend)
        return cls(
            name=agent.name,
            spec=spec,
            config=config,
            options=options,
            paths=paths,
            source=source,
            clock=clock,
            bus=bus,
            loop=agent.loop,
            registry=registry,
            board=board,
            memory=memory,
            warnings=warnings,
            missing=find_missing(config, spec, paths) if spec else [],
            early=agent.early,
            skill_board=skill_board,
            additions=additions,
            pddl_parser=PddlParserFeature(as_fawkes=reads_as_fawkes(config)),
            **more,
        )

    def close(self) -> None:
        """Close what the components share, after them."""
        self.memory.close()
        self.board.shutdown()


def _serials(clock: Clock) -> Callable[[], UUID]:
    """Return what makes instances' serials: on a virtual clock runs repeat, so these must."""
    if not clock.is_virtual:
        return uuid4
    numbers = count(1)
    return lambda: UUID(int=next(numbers), version=4)


def skill_board_settings(
    config: Configuration, paths: RunPaths, executors: tuple[type[SkillExecutor], ...] = ()
) -> BoardSettings | None:
    """Return what the configuration says about a skill board; None when it has none.

    :param executors: those that a program adds; with them there is a skill board in any case.
    :raises ConfigError: when that makes no sense.
    """
    if not config.keys(_SKILL_BOARD) and not executors:
        return None
    from cxbridge.skiller.board.settings import BoardSettings  # noqa: PLC0415 - start-up time is a feature

    settings = BoardSettings.of(config, paths.confdir) or BoardSettings()
    if executors:
        settings = settings.with_executors(executors, config.keys(INSTANCES) or [DEFAULT_SKILLER])
    return settings


def init_mentions(config: Configuration, spec: str, *names: str) -> bool:
    """Whether a feature or file of the spec's initialisation has one of these in its name."""
    init = f"/clips-executive/specs/{spec}/init/"
    texts = [text for item in config.search(init) for text in (item.text, *item.items)]
    return any(name in text for name in names for text in texts)


def needs_memory(config: Configuration, spec: str) -> bool:
    """Whether the spec's initialisation asks for the robot memory, or waits for it."""
    return init_mentions(config, spec, "robot_memory", "robmem-wait-init")
