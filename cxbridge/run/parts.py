"""The parts of a run or of a daemon, each made from what the configuration and the options say."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Protocol, cast, get_args

from cxbridge.blackboard import BlackBoard
from cxbridge.clock import Clock
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.events import EventBus
from cxbridge.executive.robmem.memory import RobotMemory
from cxbridge.mainloop import DEFAULT_PERIOD_US
from cxbridge.run.paths import Places
from cxbridge.run.shared_navgraph import SharedNavGraph
from cxbridge.run.specs import check_features
from cxbridge.skiller.backend import Mode

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from cxbridge.executive.executive import CoreFiles, Executive
    from cxbridge.executive.features.pddl_parser import PddlParserFeature
    from cxbridge.executive.manager import EnvironmentManager, Feature, LazyFeature
    from cxbridge.executive.planning.service import PlanningService
    from cxbridge.ros2cx.checkout import Ros2CxCheckout
    from cxbridge.ros2cx.refresh import RefreshTimer
    from cxbridge.ros2cx.skills import Ros2CxSkills
    from cxbridge.skiller.board.desk import SkillDesk
    from cxbridge.skiller.board.settings import BoardSettings
    from cxbridge.skiller.board.station import SkillStation
    from cxbridge.skiller.speech import SpeechSynthWriter

DEFAULT_SKILLER = "Skiller"
"""Id of the SkillerInterface that a Skiller serves unless it is told otherwise."""

SKILL_BOARD = "/skill-board"
"""The part of the configuration that is about the skill board."""

_EVERY_TICK_RULES = ("time-retract", "blackboard-read")
_EVERY_TICK_FACTS = ("time",)
_PERIOD = "/fawkes/mainapp/desired_loop_time"
_SHORTEST_PERIOD_US = 100


class Component(Protocol):
    """A part that works once a loop."""

    def loop(self) -> object:
        """Do this loop's work."""

    def close(self) -> None:
        """Let go of everything."""


@dataclass(slots=True)
class SkillBoardPlace:
    """Where the skill board of a run or a daemon is, as long as there is one."""

    station: SkillStation | None = None
    ros2cx: Ros2CxSkills | None = None


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What every part needs.

    :param board: the blackboard that the parts meet on.
    :param places: where the files are.
    :param memory: the robot memory; opened by the first that asks for its store.
    :param skills: where the skill board is.
    :param navgraph: the navigation graph, one for skills and rules.
    :param make_planning: makes what plans for the environment of that name; None: planners.
    :param refresh: when the executive thinks; None: in each loop.
    """

    config: Configuration
    clock: Clock
    bus: EventBus
    board: BlackBoard
    places: Places
    memory: RobotMemory
    skills: SkillBoardPlace = field(default_factory=SkillBoardPlace)
    navgraph: SharedNavGraph = field(default_factory=SharedNavGraph)
    make_planning: Callable[[str], PlanningService] | None = None
    refresh: RefreshTimer | None = None


def loop_period_us(config: Configuration) -> int:
    """Return the desired time of a loop.

    :raises ConfigError: when it is so short that a virtual clock would hardly move, or not at all.
    """
    period_us = config.get_uint(_PERIOD, default=DEFAULT_PERIOD_US)
    if period_us >= _SHORTEST_PERIOD_US:
        return period_us
    place = config.get(_PERIOD)
    raise ConfigError(
        f"{_PERIOD} cannot be {period_us}",
        file=place.file,
        line=place.line,
        hint=f"microseconds, {_SHORTEST_PERIOD_US} at least; Fawkes has {DEFAULT_PERIOD_US}",
    )


def make_executive(around: Surroundings, spec: str, name: str = "") -> tuple[EnvironmentManager, Executive]:
    """Make the executive and the manager of its environment; it is not initialised yet.

    :param name: of the environment; "executive" when it is empty.
    :raises CxbridgeError: when the configuration or the library is wrong.
    """
    # not for those who do without: start-up time is a feature
    from cxbridge.executive.executive import (  # noqa: PLC0415
        ENVIRONMENT,
        Executive,
        action_mapping,
    )
    from cxbridge.executive.manager import EnvironmentManager  # noqa: PLC0415
    from cxbridge.skiller.mapping import ActionSkillMapping  # noqa: PLC0415

    if needs_memory(around.config, spec):
        around.memory.open()
    places = around.places
    manager = EnvironmentManager(around.bus, _features(around), places.library)
    _offer_plugins(around, manager)
    try:
        check_features(around.config, spec, manager.features)
        executive = Executive(
            manager,
            around.config,
            ActionSkillMapping(action_mapping(around.config, spec), mode=skiller_mode(around.config)),
            _core_files(around),
            name or ENVIRONMENT,
        )
    except Exception:
        manager.close()
        raise
    return manager, executive


def _core_files(around: Surroundings) -> CoreFiles:
    """Return where the executive finds its files, and what the features are called that it begins with."""
    from cxbridge.executive.executive import CoreFiles  # noqa: PLC0415

    places = around.places
    files = CoreFiles(places.cx, places.clips_dirs, places.substitutions)
    if places.ros2cx is None:
        return files
    files = replace(files, before=places.before)
    if places.builtin:
        return files
    from cxbridge.ros2cx.features import CONFIG_FEATURE, REDEFINE_FEATURE  # noqa: PLC0415
    from cxbridge.ros2cx.refresh import nanoseconds_too  # noqa: PLC0415
    from cxbridge.ros2cx.settings import Ros2CxSettings  # noqa: PLC0415

    time_of = nanoseconds_too if Ros2CxSettings.of(around.config).original else files.time_of
    return replace(files, config_feature=CONFIG_FEATURE, redefine_feature=REDEFINE_FEATURE, time_of=time_of)


def _offer_plugins(around: Surroundings, manager: EnvironmentManager) -> None:
    """Offer what installed packages bring along."""
    from cxbridge.executive.plugins import FeatureContext, find_plugins  # noqa: PLC0415

    folder = around.places.config_file.parent
    context = FeatureContext(around.config, around.board, around.bus, around.places.substitutions, folder)
    for plugin in find_plugins(context):
        manager.add_plugin(plugin)


def needs_memory(config: Configuration, spec: str) -> bool:
    """Whether the spec's initialisation asks for the robot memory, or waits for it."""
    return _init_names(config, spec, "robot_memory") or _init_names(config, spec, "robmem-wait-init")


def needs_planning(config: Configuration, spec: str) -> bool:
    """Whether the spec's initialisation waits for Fawkes' planning plugins."""
    return _init_names(config, spec, "pddl-init")


def _init_names(config: Configuration, spec: str, what: str) -> bool:
    """Whether a feature or file of the spec's initialisation has this in its name."""
    init = f"/clips-executive/specs/{spec}/init/"
    return any(what in text for item in config.search(init) for text in (item.text, *item.items))


def _features(around: Surroundings) -> list[Feature | LazyFeature]:
    """Return the features of this package; those that not every agent asks for are imported when one does."""
    from cxbridge.executive.features.blackboard import BlackBoardFeature  # noqa: PLC0415
    from cxbridge.executive.features.config import ConfigFeature  # noqa: PLC0415
    from cxbridge.executive.features.pddl_parser import PddlParserFeature  # noqa: PLC0415
    from cxbridge.executive.features.redefine_warning import RedefineWarningFeature  # noqa: PLC0415
    from cxbridge.executive.manager import LazyFeature  # noqa: PLC0415

    if around.places.ros2cx is not None:
        return _ros2cx_features(around, around.places.ros2cx)
    pddl_parser = PddlParserFeature()
    retract_early = around.config.get_bool("/clips/retract-early", default=False)
    features: list[Feature | LazyFeature] = [
        BlackBoardFeature(around.board, retract_early=retract_early),
        ConfigFeature(around.config),
        RedefineWarningFeature(),
        pddl_parser,
        LazyFeature("robot_memory", partial(_robot_memory, around)),
        LazyFeature("tf", partial(_tf, around)),
        LazyFeature("navgraph", partial(_navgraph, around)),
    ]
    for name, section, make in (
        ("planner", "/planner", partial(_planner, around, pddl_parser)),
        ("protobuf", "/clips-protobuf", partial(_protobuf, around)),
        ("motor-switch", "/clips-motor-switch", partial(_motor_switch, around)),
    ):
        # what is configured is made now: a mistake in it is told before anything runs
        features.append(make() if around.config.keys(section) else LazyFeature(name, make))
    if around.config.keys(SKILL_BOARD):
        from cxbridge.executive.features.skill_board import SkillBoardFeature  # noqa: PLC0415

        features.append(SkillBoardFeature(partial(_desk, around.skills)))
    return features


def _ros2cx_features(around: Surroundings, checkout: Ros2CxCheckout) -> list[Feature | LazyFeature]:
    """Return the features of the executive for ROS 2."""
    from cxbridge.ros2cx.features import FeatureContext, make_features  # noqa: PLC0415
    from cxbridge.ros2cx.parameters import load_features  # noqa: PLC0415
    from cxbridge.ros2cx.settings import Ros2CxSettings  # noqa: PLC0415

    folder = checkout.parameters
    settings = Ros2CxSettings.of(around.config)
    blocks = iter(settings.removal_blocks)

    def on_removal() -> None:
        if around.refresh is not None:
            around.refresh.block(next(blocks, 0.0))

    skills = partial(ros2cx_skills, around)
    context = FeatureContext(
        around.config, folder, around.board, skills, on_removal, around.make_planning, settings.original
    )
    features = make_features(context, load_features(folder))
    if not around.places.builtin:
        return [*features]
    from cxbridge.executive.features.blackboard import BlackBoardFeature  # noqa: PLC0415
    from cxbridge.executive.features.config import ConfigFeature  # noqa: PLC0415
    from cxbridge.executive.features.redefine_warning import RedefineWarningFeature  # noqa: PLC0415

    ours = [BlackBoardFeature(around.board), ConfigFeature(around.config), RedefineWarningFeature()]
    named = {feature.name for feature in features}
    return [*(feature for feature in ours if feature.name not in named), *features]


def ros2cx_skills(around: Surroundings) -> Ros2CxSkills | None:
    """Return the skill board of the executive for ROS 2; None while there is none."""
    from cxbridge.ros2cx.settings import Ros2CxSettings  # noqa: PLC0415
    from cxbridge.ros2cx.skills import Ros2CxSkills  # noqa: PLC0415

    station = around.skills.station
    if station is None:
        return None
    skills = around.skills.ros2cx
    if skills is None:
        settings = skill_board_settings(around.config, around.places)
        assert settings is not None  # --ros2cx always has a skill board
        ros2cx = Ros2CxSettings.of(around.config)
        skills = Ros2CxSkills(
            station,
            around.board,
            around.clock,
            around.bus,
            settings,
            original=ros2cx.original,
            unsensed=ros2cx.unsensed,
        )
        around.skills.ros2cx = skills
    return skills


def _planner(around: Surroundings, pddl_parser: PddlParserFeature) -> Feature:
    from cxbridge.executive.features.planner import PlannerFeature  # noqa: PLC0415
    from cxbridge.executive.planning.settings import PlannerSettings  # noqa: PLC0415

    settings = PlannerSettings.from_config(around.config)
    return PlannerFeature(settings, pddl_parser.domain_of, around.make_planning)


def _robot_memory(around: Surroundings) -> Feature:
    from cxbridge.executive.features.robot_memory import LIBRARY, RobotMemoryFeature  # noqa: PLC0415

    return RobotMemoryFeature(around.memory, around.places.robot_memory or LIBRARY, _placeholders(around))


def _protobuf(around: Surroundings) -> Feature:
    from cxbridge.executive.features.protobuf import ProtobufFeature, ProtobufSettings  # noqa: PLC0415

    folder = around.places.config_file.parent
    return ProtobufFeature(ProtobufSettings.from_config(around.config, _placeholders(around), folder))


def _tf(around: Surroundings) -> Feature:
    from cxbridge.executive.features.tf import TfFeature  # noqa: PLC0415

    return TfFeature(around.board)


def _navgraph(around: Surroundings) -> Feature:
    from cxbridge.executive.features.navgraph import NavGraphFeature  # noqa: PLC0415

    return NavGraphFeature(partial(around.navgraph.get, around.config, around.places))


def _motor_switch(around: Surroundings) -> Feature:
    from cxbridge.executive.features.motor_switch import MotorSwitchFeature  # noqa: PLC0415

    motor = around.config.get_str("/clips-motor-switch/interface-id", default="Robotino")
    return MotorSwitchFeature(around.board, motor)


def _placeholders(around: Surroundings) -> dict[str, str]:
    """Return what placeholders stand for, without the ``@`` around their names."""
    return {name.strip("@"): folder for name, folder in around.places.substitutions.items()}


def _desk(place: SkillBoardPlace) -> SkillDesk | None:
    return None if place.station is None else place.station.desk


def skill_board_settings(config: Configuration, places: Places) -> BoardSettings | None:
    """Return what the configuration says of a skill board; None when it has none.

    :raises ConfigError: when that makes no sense.
    """
    if not config.keys(SKILL_BOARD) and places.ros2cx is None:
        return None
    from cxbridge.skiller.board.settings import BoardSettings  # noqa: PLC0415 - start-up time is a feature

    settings = BoardSettings.of(config, places.config_file.parent) or BoardSettings()
    if places.ros2cx is None:
        return settings
    from cxbridge.ros2cx.original_board import with_idle_time  # noqa: PLC0415

    return with_idle_time(settings, config)


class SkillBoardPart:
    """The skill board as a component: masters, executors of this process, Skillers of the agents.

    :param executors: more executors, as ``--executor`` has them: with the executive for ROS 2 only.
    :raises CxbridgeError: when an executor cannot be made, or somebody else writes an interface.
    """

    def __init__(self, around: Surroundings, settings: BoardSettings, executors: Iterable[str] = ()) -> None:
        from cxbridge.skiller.board.station import SkillStation  # noqa: PLC0415 - start-up time is a feature

        manners = None
        if around.places.ros2cx is not None:
            from cxbridge.ros2cx.original_board import manners_of  # noqa: PLC0415

            manners = manners_of(around.config)
        self.station = SkillStation(around.board, around.clock, around.bus, settings, manners)
        self.loop = self.station.loop
        self._place = around.skills
        around.skills.station = self.station
        try:
            self._add(around, executors)
        except Exception:
            self.close()
            raise

    @staticmethod
    def _add(around: Surroundings, executors: Iterable[str]) -> None:
        for text in executors:
            skills = ros2cx_skills(around)
            assert skills is not None  # there is a station now
            skills.add_executor(text)

    def close(self) -> None:
        """End all skills."""
        self._place.station = self._place.ros2cx = None
        self.station.close()


def make_planning_plugins(around: Surroundings, spec: str) -> list[Component]:
    """Make what agents plan with that do so by the blackboard, for the hook :attr:`Hook.ACT_EXEC`.

    They are there for specs that wait for them (``pddl-init.clp``).

    :raises CxbridgeError: when the configuration lacks something, or somebody else writes their interfaces.
    """
    if around.places.ros2cx is not None or not needs_planning(around.config, spec):
        return []
    from cxbridge.executive.planning.plugins import (  # noqa: PLC0415
        PddlPlanner,
        PddlRobotMemory,
        ProblemFiles,
    )

    places, config, store = around.places, around.config, around.memory.store
    on_disk = config.get_bool("/planner/write-problem", default=False)
    files = ProblemFiles(places.substitutions, places.config_file.parent, on_disk=on_disk)
    generator = PddlRobotMemory(around.board, around.bus, config, store, files)
    try:
        return [generator, PddlPlanner(around.board, around.clock, around.bus, config, store, files)]
    except BaseException:
        generator.close()
        raise


class PlanningPart:
    """The planning plugins as one component.

    :raises CxbridgeError: as :func:`make_planning_plugins`.
    """

    def __init__(self, around: Surroundings, spec: str) -> None:
        if needs_memory(around.config, spec):
            around.memory.open()
        self._plugins = make_planning_plugins(around, spec)

    def loop(self) -> None:
        """Let them work."""
        for plugin in self._plugins:
            plugin.loop()

    def close(self) -> None:
        """Close them."""
        for plugin in reversed(self._plugins):
            plugin.close()


def watch_for_recording(executive: Executive, config: Configuration, level: str) -> None:
    """Watch what is to be recorded at ``level`` when the configuration leaves debugging off."""
    if level == "transitions" or config.get_bool("/clips-executive/debug/enable", default=False):
        return
    watcher = executive.env.watcher
    watcher.rules.set((), on=True)
    watcher.rules.set(_EVERY_TICK_RULES, on=False)
    if level == "facts":
        watcher.facts.set((), on=True)
        watcher.facts.set(_EVERY_TICK_FACTS, on=False)


def skiller_mode(config: Configuration, path: str = "/skiller/mode", default: Mode = "strict") -> Mode:
    """Return what to do where Fawkes is odd, in Skillers and in action mappings.

    :raises ConfigError: when it is none of the modes.
    """
    value = config.get_str(path, default=default)
    for mode in get_args(Mode):
        if value == mode:
            return cast("Mode", mode)
    place = config.get(path)
    raise ConfigError(
        f"{path} cannot be '{value}'",
        file=place.file or None,
        line=place.line or None,
        hint=f"one of: {', '.join(get_args(Mode))}",
    )


def make_speech(around: Surroundings, speech: str) -> SpeechSynthWriter:
    """Make the speech synthesis that Lua skills need, for the hook :attr:`Hook.ACT`.

    The skills open its interface, so it is made before the Skiller; it works after them.

    :param speech: ``off``, ``on``, a wav file or a folder.
    :raises CxbridgeError: when it cannot speak, or somebody else writes its interface.
    """
    from cxbridge.skiller import make  # noqa: PLC0415

    return make.make_speech(around.board, around.clock, around.bus, speech=speech)
