"""The CLIPS Executive as Fawkes' plugin runs it: set up in stages, one run of the rules at each `think`.

Source of the order of things: compat cx-behaviour, section 1.1.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Final, Protocol

from msgspec import Struct, field

from cxbridge.clock import split_us
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError, ExecutiveError
from cxbridge.events import EventBus, Level, Logger
from cxbridge.executive.goals import GoalWatch
from cxbridge.executive.host.environment import CORE_DIR, ClipsEnvironment
from cxbridge.executive.host.facts.making import NumberFact
from cxbridge.executive.host.values import Value
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.executive.skillwatch import SkillWatch
from cxbridge.history.transitions import (
    CALL_TEMPLATES,
    FORGETFUL_TEMPLATES,
    TRACKED_TEMPLATES,
    TransitionTracker,
)

if TYPE_CHECKING:
    from cxbridge.executive.breakpoints import Stop
    from cxbridge.executive.debugger import Debugger

BUILTIN_CX = CORE_DIR / "cx"
"""Our own CX core."""

_SKILL = re.compile(r"\s*[\w-]+\s*[{(]")

ACTIONS_OVER: Final = frozenset({"FINAL", "FAILED"})
"""The states of plan-actions that are over."""

MOST_FINAL_FIRINGS = 10_000
"""Rules that may fire at the end: those of the RCLL agent `rcll` close and open a peer forever."""

ENVIRONMENT = "executive"
"""The name of the executive's environment, unless it is one of several."""


class MappedAction(Protocol):
    """What an action became."""

    @property
    def text(self) -> str:
        """The skill string; empty when the action could not be mapped."""

    @property
    def messages(self) -> Sequence[tuple[Level, str]]:
        """Its description."""


class ActionMapper(Protocol):
    """Maps actions to skill strings (:mod:`cxbridge.skiller.mapping` is one)."""

    def has(self, action: str) -> bool:
        """Whether there is a mapping for the action."""

    def map(self, action: str, params: Mapping[str, str]) -> MappedAction:
        """Map an action with the values of its parameters."""


class CoreFiles(Struct, frozen=True):
    """Where CLIPS files come from.

    :param cx: the folder of the CX core: saliences.clp, init.clp ...
    :param clips_dirs: the user's folders, searched after the core's.
    :param substitutions: what ``@BASEDIR@`` and its like stand for.
    :param before: folders whose files replace the core's.
    :param config_feature: the feature that init.clp reads its configuration with.
    :param redefine_feature: the feature that reports redefinitions.
    :param time_of: what ``(now)`` and the fact ``time`` hold, of microseconds since the epoch.
    """

    cx: Path = BUILTIN_CX
    clips_dirs: tuple[Path, ...] = ()
    substitutions: Mapping[str, str] = field(default_factory=dict)
    before: tuple[Path, ...] = ()
    config_feature: str = "config"
    redefine_feature: str = "redefine-warning"
    time_of: Callable[[int], tuple[float | int, ...]] = split_us


class Executive:
    """The executive's environment and what drives it.

    :param manager: creates the environment; it has the features.
    :param config: the configuration of the run.
    :param mapper: the action mapping.
    :param files: where the CLIPS files are.
    :param name: of the environment.
    """

    knows_goals: ClassVar[bool] = True
    """Whether facts of goals decide when a run is over; else a run lasts as long as its timeout."""

    def __init__(
        self,
        manager: EnvironmentManager,
        config: Configuration,
        mapper: ActionMapper,
        files: CoreFiles,
        name: str = ENVIRONMENT,
    ) -> None:
        self._manager = manager
        self._config = config
        self._mapper = mapper
        self._files = files
        self.bus: EventBus = manager.bus
        self.log: Logger = self.bus.logger("ClipsExecutiveThread")
        self._assert_time = config.get_bool("/clips-executive/assert-time-each-loop", default=False)
        self.env: ClipsEnvironment = manager.create(name)
        self.goals = GoalWatch(self.env if self.knows_goals else None)
        self.skills = SkillWatch(self.env)
        self.known_skills: Callable[[], Collection[str] | None] = lambda: None
        """Returns the existing skills; None when they are unknown."""
        self._initial_files: frozenset[Path] = frozenset()
        self._debugger: Debugger | None = None
        self.place_of_action: Callable[[str], str] = lambda _action: ""
        """Returns ``FILE:LINE`` where plans get an action, for messages; empty when unknown."""
        self._time = NumberFact(self.env.env, "time")
        self.env.time_of = files.time_of

    def init(self) -> None:
        """Load the core and the agent.

        :raises ExecutiveError: when the core's own files do not load, or the initialisation fails.
        """
        self.load_core()
        env = self.env
        env.watcher.start()
        env.assert_string("(executive-init)")
        env.refresh_agenda()
        self._run()
        env.emit_settings()
        self._check_stage()

    def load_core(self) -> None:
        """Load the loaders of the initialisation.

        :raises ExecutiveError: when they do not load.
        """
        env = self.env
        for pattern, by in self._files.substitutions.items():
            env.call("path-add-subst", pattern, by)
        for folder in (*self._files.before, self._files.cx, *self._files.clips_dirs):
            env.call("path-add", f"{folder}/")
        self._manager.request(env.name, self._files.config_feature)
        env.define("map-action-skill", self._map_action_skill, 3, types="*;sy;m;m")
        if self._config.get_bool("/clips-executive/request-redefine-warning-feature", default=True):
            self.log.debug("Enabling warnings for redefinitions")
            self._manager.request(env.name, self._files.redefine_feature)
        for file in ("saliences.clp", "init.clp"):
            if not env.batch(self._files.cx / file):
                raise ExecutiveError(
                    f"Failed to initialize CLIPS environment, batch file '{self._files.cx / file}' failed."
                )
        self._initial_files = frozenset(env.loader.files)

    def _check_stage(self) -> None:
        """Raise when the initialisation has failed by now."""
        for _index, _template, slots in self.env.facts("executive-init-stage"):
            if slots["implied"] == ("FAILED",):
                messages = [
                    str(text)
                    for _, _, request in self.env.facts("executive-init-request")
                    for text in request["error-msgs"]
                ]
                raise ExecutiveError(
                    "CLIPS Executive initialization failed: " + ("; ".join(messages) or "see the log"),
                    hint="a feature that a spec's init section asks for must be one of: "
                    + ", ".join(self._manager.features),
                )

    def loop(self) -> int:
        """Think once; returns how many rules fired. While the debugger is stopped none does."""
        env = self.env
        with env.lock:
            if self.within_loop:
                return self.debugger.run()
            self._manager.before_run(env.name)
            if self._assert_time:
                self._time.add(*self._files.time_of(self.bus.clock.now_us()))
            env.refresh_agenda()
            return self._run()

    @property
    def debugger(self) -> Debugger:
        """The debugger of its rules, made on request."""
        if self._debugger is None:
            from cxbridge.executive.breakpoint_names import (  # noqa: PLC0415 - start-up time is a feature
                AgentNames,
            )
            from cxbridge.executive.debugger import Debugger  # noqa: PLC0415

            names = AgentNames(self.env, self.known_skills, lambda file: file in self._initial_files)
            with self.env.lock:
                self._debugger = self._debugger or Debugger(self.env, names)
        return self._debugger

    @property
    def stopped(self) -> Stop | None:
        """Where the debugger has stopped the rules; None while it has not. Makes no debugger."""
        return None if self._debugger is None else self._debugger.stopped

    @property
    def within_loop(self) -> bool:
        """Whether the debugger has stopped the rules in the middle of a loop."""
        return self._debugger is not None and self._debugger.within_loop

    def _run(self) -> int:
        """Run the rules, with the debugger's eyes on them if there is a reason to."""
        debugger = self._debugger
        return debugger.run() if debugger is not None and debugger.active else self.env.run()

    @property
    def first_error(self) -> str:
        """The first error that an executive without goals has reported; empty: none."""
        return ""

    def follow_transitions(self) -> None:
        """Emit the transitions of goals, plan-actions and skillers from now on."""
        tracker = TransitionTracker(self.env.name)

        def follow(template: str, slots: dict[str, str]) -> None:
            event = tracker.fact(self.bus.clock.now_us(), template, slots)
            if event is not None:
                self.bus.emit(event)

        def retracted(template: str, slots: dict[str, str]) -> None:
            tracker.retracted(template, slots, gone=not self.env.maker.replaces)

        for template, slots in {**TRACKED_TEMPLATES, **CALL_TEMPLATES}.items():
            self.env.watcher.follow(template, follow, slots)
        for template, slots in FORGETFUL_TEMPLATES.items():
            self.env.watcher.follow_retractions(template, retracted, slots)

    @property
    def is_over(self) -> bool:
        """Whether there is nothing left to do: no root goal is open, no skill runs, the agenda is empty.

        MAINTAIN goals at rest are no open root goals here, once another root goal has ended. An agent with
        MAINTAIN goals alone never ends: the maintained condition may need it at any time.
        """
        self.goals.settle()
        if self.env.quit_requested:
            return True
        if not self.goals.outcomes:
            return False
        return bool(self.maintained) if self.goals.open_roots else self._is_at_rest

    @property
    def _is_at_rest(self) -> bool:
        """Whether no skill runs and the agenda is empty."""
        return not self.env.agenda_size_at_least(1) and not self.skills.running

    @property
    def maintained(self) -> list[str]:
        """The ids of the open root goals, when all of them are MAINTAIN goals at rest; else none.

        At rest: no open goal is below them but further MAINTAIN goals, no action of their plans is left, no
        planner is at work for them, no skill runs and the agenda is empty, or the agent has quit.
        """
        roots = self.goals.maintaining
        if not roots or not (self._is_at_rest or self.env.quit_requested):
            return []
        if any(slots["status"] == "RUNNING" for _, _, slots in self.env.facts("planner-call")):
            return []
        pursued = {state.goal for state in self.goals.open.values() if state.is_maintaining}
        for _, _, slots in self.env.facts("plan-action"):
            if slots["state"] not in ACTIONS_OVER and str(slots["goal-id"]) in pursued:
                return []
        return [root.goal for root in roots]

    @property
    def initialized(self) -> bool:
        """Whether all stages are done."""
        return next(self.env.facts("executive-initialized"), None) is not None

    def finalize(self) -> None:
        """Run the rules for the shutdown, and destroy the environment."""
        self.env.assert_string("(executive-finalize)")
        self.env.refresh_agenda()
        if self.env.run(MOST_FINAL_FIRINGS) >= MOST_FINAL_FIRINGS:
            self.log.warn(
                f"{MOST_FINAL_FIRINGS} rules fired after (executive-finalize): they go round in circles, "
                "the environment is destroyed"
            )
        self.env.emit_settings()
        self._time.dispose()
        self._manager.destroy(self.env.name)

    def close(self) -> None:
        """Release the environment's resources. A second call does nothing."""
        self._time.dispose()

    def _map_action_skill(self, action: str, names: tuple[Value, ...], values: tuple[Value, ...]) -> str:
        """Return the skill string of an action, "" when it has none; the reason goes to the log."""
        if action == "":
            self.log.warn("Failed to map, action name is empty")
            return ""
        if not self._mapper.has(action):
            self.log.warn(f"No mapping for action '{action}' known")
            return ""
        if len(names) != len(values):
            place = self.place_of_action(action)
            text = f"Number of parameter names and values do not match for action '{action}'"
            self.log.warn(f"{place}: {text}: {len(names)} and {len(values)}" if place else text)
            return ""
        params = {}
        for name, value in zip(names, values, strict=True):
            if not isinstance(name, str):
                self.log.error(f"Param for '{action}' is not a string or symbol")
                return ""
            if isinstance(value, str | int | float):
                params[str(name)] = _text(value)
            else:
                self.log.error(f"Param '{name}' for action '{action}' of invalid type")
        mapped = self._mapper.map(action, params)
        place = place_of_mapping(
            self._config, self._config.get_str("/clips-executive/spec", default=""), action
        )
        for level, text in mapped.messages:
            self.log.log(level, f"{place}: {text}" if place else text)
        return mapped.text


def _text(value: Value) -> str:
    """Return a parameter's value as Fawkes hands it to the mapping: floats with six decimals."""
    return f"{value:f}" if isinstance(value, float) else str(value)


def place_of_mapping(config: Configuration, spec: str, action: str) -> str:
    """Return ``FILE:LINE`` of the mapping of an action; empty when it is in no file."""
    path = f"/clips-executive/specs/{spec}/action-mapping/{action}"
    place = config.get(path) if config.exists(path) else None
    return f"{place.file}:{place.line}" if place is not None and place.file else ""


def place_of_skill(config: Configuration, spec: str, skill_string: str) -> str:
    """Return where the only action is mapped that a skill string can come from; empty when unknown."""
    name = _SKILL.match(skill_string)
    found = [
        action
        for action, template in action_mapping(config, spec).items()
        if name is not None and (match := _SKILL.match(template)) is not None and match[0] == name[0]
    ]
    return place_of_mapping(config, spec, found[0]) if len(found) == 1 else ""


def action_mapping(config: Configuration, spec: str) -> dict[str, str]:
    """Return the templates of a spec by the names of their actions.

    :raises ConfigError: when one is not a text.
    """
    prefix = f"/clips-executive/specs/{spec}/action-mapping/"
    mapping = {}
    for item in config.search(prefix):
        if item.is_list:
            raise ConfigError(
                f"the mapping of action '{item.path[len(prefix) :]}' is a list, not a text",
                file=item.file,
                line=item.line,
            )
        if "/" in item.path[len(prefix) :]:
            raise ConfigError(
                f"the mapping of action '{item.path[len(prefix) :].split('/')[0]}' is a map, not a text",
                file=item.file,
                line=item.line,
                hint="a skill string with braces must be quoted: 'say{...}'",
            )
        mapping[item.path[len(prefix) :]] = item.text
    return mapping
