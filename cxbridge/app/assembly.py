"""The parts of a run, made and joined."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from types import TracebackType
from typing import Protocol, Self
from uuid import UUID, uuid4

from cxbridge.app.options import RunOptions
from cxbridge.app.places import find_config_file, find_places
from cxbridge.app.specs import check_spec, choose_spec
from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import make_clock
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.events import EventBus, GoalTransition
from cxbridge.executive.executive import CoreFiles, Executive, action_mapping
from cxbridge.executive.features.blackboard import BlackBoardFeature
from cxbridge.executive.features.config import ConfigFeature
from cxbridge.executive.features.pddl_parser import PddlParserFeature
from cxbridge.executive.features.redefine_warning import RedefineWarningFeature
from cxbridge.executive.goals import GoalState
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.mainloop import DEFAULT_PERIOD_US, Hook, MainLoop
from cxbridge.skiller.backend import SkillerBackend
from cxbridge.skiller.mapping import ActionSkillMapping

_EVERY_TICK_RULES = ("time-retract", "blackboard-read")
_EVERY_TICK_FACTS = ("time",)


_PERIOD = "/fawkes/mainapp/desired_loop_time"
_SHORTEST_PERIOD_US = 100


def _period_us(config: Configuration) -> int:
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


class Component(Protocol):
    """A part that works once a loop."""

    def loop(self) -> object:
        """Do this loop's work."""

    def close(self) -> None:
        """Let go of everything."""


class Assembly:
    """A run: everything is there after construction, loaded after :meth:`start`. A context manager.

    :param options: what the run was told; checked.
    :raises CxbridgeError: when something that the options or the configuration name is missing or wrong.
    """

    def __init__(self, options: RunOptions) -> None:
        self.options = options
        config_file = find_config_file(options)
        self.config = Configuration.load(config_file)
        if options.config is not None:
            self.config.overlay(Configuration.load(options.config))
        self.spec = choose_spec(self.config, options.spec)
        self._warnings = [*map(str, self.config.warnings), *check_spec(self.config, self.spec)]
        self.places = find_places(options, self.config, config_file)
        self.clock = make_clock(options.clock)
        self.bus = EventBus(self.clock)
        self.registry = InterfaceRegistry(self.places.interface_dirs)
        self.board = LocalBlackBoard(self.registry, self.clock, self.bus, serials=self._serials())
        self.loop = MainLoop(self.clock, _period_us(self.config))
        self.manager = EnvironmentManager(self.bus, self._features(), self.places.library)
        self.executive = Executive(
            self.manager,
            self.config,
            ActionSkillMapping(action_mapping(self.config, self.spec)),
            CoreFiles(self.places.cx, self.places.clips_dirs, self.places.substitutions),
        )
        self.goal_history: dict[str, GoalState] = {}
        self.firings = 0
        self._components: list[Component] = []
        self._skiller: SkillerBackend | None = None
        self._started = False

    def _serials(self) -> Callable[[], UUID]:
        """Return what makes instances' serials: on a virtual clock runs repeat, so these must."""
        if not self.clock.is_virtual:
            return uuid4
        numbers = count(1)
        return lambda: UUID(int=next(numbers), version=4)

    def _features(
        self,
    ) -> list[BlackBoardFeature | ConfigFeature | PddlParserFeature | RedefineWarningFeature]:
        retract_early = self.config.get_bool("/clips/retract-early", default=False)
        return [
            BlackBoardFeature(self.board, retract_early=retract_early),
            ConfigFeature(self.config),
            RedefineWarningFeature(),
            PddlParserFeature(),
        ]

    def start(self) -> None:
        """Start skiller and executive, and join them to the main loop."""
        for warning in self._warnings:
            self.bus.logger("Config").warn(warning)
        self.executive.env.watcher.start()
        self.executive.follow_transitions()
        self.bus.subscribe(self._note_goal, GoalTransition)
        self._watch_for_recording()
        self._start_skiller()
        self._started = True
        self.executive.init()
        self.loop.add(Hook.THINK, self._think)

    def _watch_for_recording(self) -> None:
        """Watch what is to be recorded when the configuration leaves debugging off."""
        level = self.options.trace_level
        if level == "transitions" or self.config.get_bool("/clips-executive/debug/enable", default=False):
            return
        watcher = self.executive.env.watcher
        watcher.rules.set((), on=True)
        watcher.rules.set(_EVERY_TICK_RULES, on=False)
        if level == "facts":
            watcher.facts.set((), on=True)
            watcher.facts.set(_EVERY_TICK_FACTS, on=False)

    def _start_skiller(self) -> None:
        """Make the Skiller that the options ask for, and the speech that its skills need."""
        options = self.options
        if options.skiller == "none":
            return
        # Lua, speech and estimators only for those who use them: start-up time is a feature
        from cxbridge.skiller import make  # noqa: PLC0415

        if options.skiller == "simulator":
            self._skiller = make.make_simulator(self.board, self.clock, self.bus, config=self.config)
            self._add(Hook.SKILL, self._skiller)
            return
        # the skills open SpeechSynthInterface, so its writer is first; it works after them
        speech = make.make_speech(self.board, self.clock, self.bus, aloud=options.speech == "on")
        self._skiller = make.make_lua_skiller(
            self.board, self.clock, self.bus, folders=self.places.skill_dirs, config=self.config
        )
        self._add(Hook.SKILL, self._skiller)
        self._add(Hook.ACT, speech)

    def _add(self, hook: Hook, component: Component) -> None:
        self._components.append(component)
        self.loop.add(hook, component.loop)

    def _think(self) -> None:
        self.firings += self.executive.loop()

    def _note_goal(self, event: object) -> None:
        if isinstance(event, GoalTransition):
            self.goal_history[event.goal] = GoalState(
                event.goal, event.goal_class, event.parent, event.mode, event.outcome, event.error, ""
            )

    @property
    def is_over(self) -> bool:
        """Whether every root goal is retracted or gone, no skill runs and the agenda is empty."""
        return self.executive.is_over and not (self._skiller is not None and self._skiller.running)

    def interrupt(self) -> None:
        """Make the run end soon, from a signal handler: after the rule that fires now."""
        self.executive.env.interrupt()

    def stop(self) -> None:
        """Let the executive's rules say good-bye."""
        if self._started:
            self._started = False
            self.executive.finalize()

    def close(self) -> None:
        """Stop everything and let go of it."""
        self.stop()
        for component in reversed(self._components):
            component.close()
        self._components.clear()
        self.executive.close()
        self.manager.close()
        self.board.shutdown()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
