"""Settings of the skill board, ``skill-board:`` in the configuration (docs/skill-board.md)."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from cxbridge.config import Configuration, ConfigValue
from cxbridge.config.scalars import to_bool, to_float, to_int, to_uint
from cxbridge.errors import ConfigError, CxbridgeError, SkillError
from cxbridge.plugins import is_installed
from cxbridge.skiller.board.executor import ExecutorContext, SkillExecutor, check_executor, load_executor
from cxbridge.skiller.board.host import ExecutorHost, make_host
from cxbridge.skiller.board.master import Timeouts
from cxbridge.skiller.board.protocol import DEFAULT_BOARD, check_name

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.clock import Clock
    from cxbridge.events import EventBus

TREE = "/skill-board"
_BOARD_KEYS = ("name", "in-process", "timeouts", "agents")
_DEFAULT_TIMEOUTS = asdict(Timeouts())
_AGENT_KEYS = ("skiller", "executors")


@dataclass(frozen=True, slots=True)
class ExecutorSettings:
    """The settings of an executor.

    :param name: the id of the executor's interface.
    :param target: ``MODULE:CLASS``, ``FILE.py:CLASS``, or the class.
    :param settings: the settings that the class gets.
    :param folder: the base of relative files.
    :param place: the place in the configuration, for errors; None for a class that a program gives.
    """

    name: str
    target: str | type[SkillExecutor]
    settings: Mapping[str, Any] = field(default_factory=dict)
    folder: Path = field(default_factory=Path)
    place: ConfigValue | None = None

    def load(self) -> type[SkillExecutor]:
        """Return the class of the executor.

        :raises SkillError: if the class is missing or not an executor.
        """
        if isinstance(self.target, str):
            return load_executor(self.target, self.folder)
        return check_executor(self.target)

    def skills(self) -> tuple[str, ...]:
        """Return the skills that the executor executes.

        :raises CxbridgeError: as :meth:`load`, or if the settings are invalid.
        """
        with self.locate_errors():
            return self.load().skills_with(self.settings)

    def mistakes(self) -> Iterable[CxbridgeError]:
        """Return the mistakes in the settings, found by the class; empty for a class outside of packages.

        :raises CxbridgeError: as :meth:`load`.
        """
        # checks must not import a user's file
        if isinstance(self.target, str) and not is_installed(self.target):
            return ()
        with self.locate_errors():
            return tuple(self.load().mistakes(self.settings, self.folder))

    def make_host(
        self, agent: str, board: BlackBoard, clock: Clock, bus: EventBus, *, verbatim: bool = False
    ) -> ExecutorHost:
        """Make the executor and its host.

        :param verbatim: see :class:`~cxbridge.skiller.board.host.ExecutorHost`.
        :raises CxbridgeError: if the class cannot be loaded, or refuses the settings.
        """
        with self.locate_errors():
            executor_class = self.load()
            return make_host(
                executor_class,
                ExecutorContext(agent, board, clock, bus.logger(self.name), self.settings, self.folder),
                self.name,
                verbatim=verbatim,
            )

    @contextmanager
    def locate_errors(self) -> Iterator[None]:
        """Add the executor's place in the configuration to errors without a place."""
        try:
            yield
        except CxbridgeError as error:
            if self.place is not None and error.file is None:
                error.file, error.line = self.place.file, self.place.line
            raise

    def is_replaced_by(self, skills: Collection[str]) -> bool:
        """Return whether executors of a program replace this executor.

        :param skills: the skills of the program's executors.
        :raises SkillError: if the program's executors replace only some skills of this executor.
        :raises CxbridgeError: as :meth:`skills`.
        """
        own_skills = self.skills()
        replaced_skills = [skill for skill in own_skills if skill in skills]
        if replaced_skills and len(replaced_skills) < len(own_skills):
            # an executor executes one skill at a time, but two executors with half of its skills would
            # execute two skills at once
            names, replaced_names = ", ".join(own_skills), ", ".join(replaced_skills)
            raise SkillError(
                f"{self.name} executes {names}: {replaced_names} alone cannot be replaced",
                hint="replace all of its skills",
            )
        return bool(replaced_skills)


@dataclass(frozen=True, slots=True)
class AgentSettings:
    """The settings of an agent of the skill board.

    :param skiller: the id of the agent's SkillerInterface.
    """

    name: str
    skiller: str
    executors: tuple[ExecutorSettings, ...] = ()


@dataclass(frozen=True, slots=True)
class BoardSettings:
    """The settings of a skill board.

    :param name: the id of the SkillBoardInterface.
    :param in_process: whether this process makes the executors.
    """

    name: str = DEFAULT_BOARD
    in_process: bool = True
    timeouts: Timeouts = field(default_factory=Timeouts)
    agents: tuple[AgentSettings, ...] = ()

    @classmethod
    def from_config(cls, config: Configuration, folder: Path) -> BoardSettings | None:
        """Return the settings in a configuration; None without a skill board.

        :param folder: the base of relative files.
        :raises ConfigError: if a key or value is unknown, missing or invalid, with file and line.
        """
        if not config.keys(TREE):
            return None
        _refuse_unknown_keys(config, TREE, _BOARD_KEYS)
        _refuse_unknown_keys(config, f"{TREE}/timeouts", tuple(_DEFAULT_TIMEOUTS))
        agents = tuple(_read_agent(config, name, folder) for name in config.keys(f"{TREE}/agents"))
        if not agents:
            raise config.error(TREE, "the skill board has no agents", "name an agent: agents: {robot1: {}}")
        return cls(
            name=config.get_str(f"{TREE}/name", default=DEFAULT_BOARD),
            in_process=config.get_bool(f"{TREE}/in-process", default=True),
            timeouts=_read_timeouts(config),
            agents=agents,
        )

    def replace_executors(
        self, executor_classes: Sequence[type[SkillExecutor]], skillers: Sequence[str]
    ) -> Self:
        """Return the settings with additional executor classes for each agent.

        The classes replace configured executors of the same skills.

        :param executor_classes: the additional classes.
        :param skillers: the ids of the SkillerInterfaces. Without configured agents, each becomes an agent.
        :raises SkillError: if the classes replace only some skills of a configured executor.
        :raises CxbridgeError: if a configured executor cannot tell its skills.
        """
        skills = {skill for executor_class in executor_classes for skill in executor_class.skills}
        return replace(
            self,
            in_process=True,
            agents=tuple(
                replace(
                    agent,
                    executors=(
                        *(
                            executor
                            for executor in agent.executors
                            # without in_process, another process makes the configured executors
                            if self.in_process and not executor.is_replaced_by(skills)
                        ),
                        *(
                            ExecutorSettings(f"{agent.name}-{executor_class.__name__}", executor_class)
                            for executor_class in executor_classes
                        ),
                    ),
                )
                for agent in self.agents or tuple(AgentSettings(name, name) for name in skillers)
            ),
        )

    @property
    def skillers(self) -> frozenset[str]:
        """The ids of the SkillerInterfaces that the board serves."""
        return frozenset(agent.skiller for agent in self.agents)


def _read_timeouts(config: Configuration) -> Timeouts:
    tree = f"{TREE}/timeouts"
    timeouts = {
        name: config.get_float(f"{tree}/{name}", default=default)
        for name, default in _DEFAULT_TIMEOUTS.items()
    }
    try:
        return Timeouts(**timeouts)
    except ConfigError as error:
        raise config.error(tree, error.message) from None


def _read_agent(config: Configuration, name: str, folder: Path) -> AgentSettings:
    tree = f"{TREE}/agents/{name}"
    try:
        check_name("an agent", name)
    except SkillError as error:
        raise config.error(tree, error.message, error.hint) from None
    _refuse_unknown_keys(config, tree, _AGENT_KEYS)
    return AgentSettings(
        name,
        config.get_str(f"{tree}/skiller", default=name),
        tuple(_read_executor(config, name, key, folder) for key in config.keys(f"{tree}/executors")),
    )


def _read_executor(config: Configuration, agent: str, key: str, folder: Path) -> ExecutorSettings:
    tree = f"{TREE}/agents/{agent}/executors/{key}"
    target = config.get_str(f"{tree}/class")
    settings = {}
    for item in config.search(f"{tree}/"):
        name = item.path.removeprefix(f"{tree}/")
        if name != "class":
            settings[name] = (
                [parse_value(text) for text in item.items] if item.is_list else parse_value(item.text)
            )
    return ExecutorSettings(f"{agent}-{key}", target, settings, folder, config.get(f"{tree}/class"))


def parse_value(text: str) -> bool | float | str:
    """Return the value of a configured text or of ``--set``: a number, a boolean, or the text."""
    # in the order in which Fawkes' YAML reader tries the types
    for convert in (to_uint, to_int, to_float, to_bool):
        value = convert(text)
        if value is not None:
            return value
    return text


def _refuse_unknown_keys(config: Configuration, tree: str, allowed_keys: tuple[str, ...]) -> None:
    """Refuse unknown keys, because a misspelt setting would silently have no effect."""
    for name in config.keys(tree):
        if name not in allowed_keys:
            raise config.error(
                f"{tree}/{name}",
                f"{tree}/{name} is not a setting of the skill board",
                f"the settings are: {', '.join(allowed_keys)}",
            )
