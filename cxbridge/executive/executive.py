"""The CLIPS Executive: initialisation in stages, then a run of the rules at each `think` hook, as in Fawkes.

The core's file init.clp performs the stages: its rules request features, load the agent's files, and assert
``(executive-initialized)`` at the end. The executive loads init.clp, and asserts ``(executive-init)`` at the
beginning and ``(executive-finalize)`` at the end.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import ClassVar, Final, Protocol

from msgspec import Struct, field

from cxbridge.clock import split_us
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError, ExecutiveError
from cxbridge.events import EventBus, Level, Logger
from cxbridge.executive.goals import GoalWatch, SkillWatch
from cxbridge.executive.host.environment import CORE_DIR, ClipsEnvironment
from cxbridge.executive.host.values import Value
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.history.transitions import (
    CALL_TEMPLATES,
    RELEASING_TEMPLATES,
    TRACKED_TEMPLATES,
    TransitionTracker,
)

BUILTIN_CX = CORE_DIR / "cx"
"""cxbridge's CX core."""

# a skill string up to its first bracket: `goto{...}` in Lua, `goto(...)` in other notations
_SKILL_START = re.compile(r"\s*[\w-]+\s*[{(]")

FINAL_ACTION_STATES: Final = frozenset({"FINAL", "FAILED"})
"""The states of plan-actions that have ended."""

# rules may loop after (executive-finalize): those of the RCLL agent `rcll` close and open a peer forever
MAX_FINAL_FIRINGS = 10_000
"""The maximum number of firings during finalization."""

ENVIRONMENT = "executive"
"""The name of the executive's environment in a run with one agent."""


class MappedAction(Protocol):
    """The result of mapping an action to a skill string."""

    @property
    def text(self) -> str:
        """The skill string; empty if the action has no mapping."""

    @property
    def messages(self) -> Sequence[tuple[Level, str]]:
        """Log messages about the mapping."""


class ActionMapper(Protocol):
    """Maps actions to skill strings.

    The implementation is in :mod:`cxbridge.skiller.mapping`, which this package must not import.
    """

    def has_template(self, action: str) -> bool:
        """Return whether the action has a mapping."""

    def map(self, action: str, params: Mapping[str, str]) -> MappedAction:
        """Map an action with its parameter values."""


class CoreFiles(Struct, frozen=True):
    """The CLIPS files of core and agent, and the features and the form of times that the core needs.

    :param core_dir: the folder of the CX core, with saliences.clp, init.clp ...
    :param clips_dirs: the agent's folders, searched after the core's.
    :param substitutions: values of ``@BASEDIR@`` and other placeholders.
    :param override_dirs: folders that are searched before the core's folder.
    :param config_feature: the feature that provides the configuration to init.clp.
    :param redefine_feature: the feature that reports redefinitions.
    :param to_time_fields: converts microseconds since the epoch to the fields of ``(now)`` and of the fact
        ``time``.
    """

    core_dir: Path = BUILTIN_CX
    clips_dirs: tuple[Path, ...] = ()
    substitutions: Mapping[str, str] = field(default_factory=dict)
    override_dirs: tuple[Path, ...] = ()
    config_feature: str = "config"
    redefine_feature: str = "redefine-warning"
    to_time_fields: Callable[[int], tuple[float | int, ...]] = split_us


class RuleStop(Protocol):
    """A stop of the rules by a debugger."""

    @property
    def reason(self) -> str:
        """The place and the breakpoint, for users."""


class RuleControl(Protocol):
    """A debugger. While the debugger is active, it runs the rules instead of the environment."""

    @property
    def is_active(self) -> bool:
        """Whether the debugger has a reason to watch the rules."""

    @property
    def is_within_loop(self) -> bool:
        """Whether the rules are stopped within a loop."""

    @property
    def stopped(self) -> RuleStop | None:
        """The present stop of the rules, if any."""

    def run(self) -> int:
        """Fire the rules of a loop up to a breakpoint; return the number of firings."""

    def go_on(self) -> None:
        """Continue the rules if they are stopped; otherwise do nothing."""

    def move_to(self, executive: Executive) -> None:
        """Set the breakpoints in the executive that replaces the debugged executive after a reset."""


class Executive:
    """Loads and runs the rules of an agent."""

    knows_goals: ClassVar[bool] = True
    """Whether goals decide the end of a run. Otherwise a run lasts until the agent quits or
    until its timeout.

    A plug-in with environments of the CX for ROS 2, whose agents have no goals, overrides this.
    """

    def __init__(
        self,
        manager: EnvironmentManager,
        config: Configuration,
        mapper: ActionMapper,
        files: CoreFiles,
        name: str = ENVIRONMENT,
    ) -> None:
        self.manager, self._config, self._mapper, self._files = manager, config, mapper, files
        self.bus: EventBus = manager.bus
        self.log: Logger = self.bus.logger("ClipsExecutiveThread")
        self._assert_time = config.get_bool("/clips-executive/assert-time-each-loop", default=False)
        self.env: ClipsEnvironment = manager.create(name)
        self.goals = GoalWatch(self.env if self.knows_goals else None)
        self.skills = SkillWatch(self.env)
        self.known_skills: Callable[[], Collection[str] | None] = lambda: None
        """Returns the existing skills; None if the skills are unknown."""
        self.place_of_action: Callable[[str], str] = lambda _action: ""
        """Returns ``FILE:LINE`` of the place that puts an action into a plan, given the action's name.

        The text is empty if the place is unknown.
        """
        self.control: RuleControl | None = None
        """The debugger of the rules, if any."""
        self.env.to_time_fields = files.to_time_fields

    def init(self) -> None:
        """Load core and agent.

        :raises ExecutiveError: if a core file does not load or the initialisation fails.
        """
        self.load_core()
        env = self.env
        env.watcher.set_hooks()
        env.assert_string("(executive-init)")
        env.refresh_agenda()
        self._run()
        env.emit_settings()
        self._check_init_stages()

    def load_core(self) -> None:
        """Load the files that perform the initialisation.

        :raises ExecutiveError: if a file does not load.
        """
        env = self.env
        for placeholder, value in self._files.substitutions.items():
            env.call("path-add-subst", placeholder, value)
        for folder in (*self._files.override_dirs, self._files.core_dir, *self._files.clips_dirs):
            env.call("path-add", f"{folder}/")
        self.manager.request(env.name, self._files.config_feature)
        env.define("map-action-skill", self._map_action_skill, 3, types="*;sy;m;m")
        if self._config.get_bool("/clips-executive/request-redefine-warning-feature", default=True):
            self.log.debug("Enabling warnings for redefinitions")
            self.manager.request(env.name, self._files.redefine_feature)
        for file in ("saliences.clp", "init.clp"):
            path = self._files.core_dir / file
            if not env.batch(path):  # the error has the text of Fawkes
                raise ExecutiveError(f"Failed to initialize CLIPS environment, batch file '{path}' failed.")

    def _check_init_stages(self) -> None:
        """Raise `ExecutiveError` if a stage of the initialisation has failed."""
        stages = self.env.facts("executive-init-stage")
        if any(slots["implied"] == ("FAILED",) for _, _, slots in stages):
            messages = [
                str(text)
                for _, _, request in self.env.facts("executive-init-request")
                for text in request["error-msgs"]
            ]
            raise ExecutiveError(
                "CLIPS Executive initialization failed: " + ("; ".join(messages) or "see the log"),
                hint="a feature that a spec's init section requests must be one of: "
                + ", ".join(self.manager.features),
            )

    def loop(self) -> int:
        """Run the rules of one loop; return the number of firings, 0 while the debugger is stopped."""
        env = self.env
        with env.lock:
            if not self.is_within_loop:
                self.manager.before_run(env.name)
                # the rule blackboard-read, which reads the interfaces, and rules of agents wait for `time`
                if self._assert_time:
                    env.assert_ordered("time", self._files.to_time_fields(self.bus.clock.now_us()))
                env.refresh_agenda()
            return self._run()

    @property
    def is_within_loop(self) -> bool:
        """Whether the debugger has stopped the rules within a loop."""
        return self.control is not None and self.control.is_within_loop

    def _run(self) -> int:
        """Run the rules, in the debugger if it is active; return the number of firings."""
        control = self.control
        return control.run() if control is not None and control.is_active else self.env.run()

    @property
    def first_error(self) -> str:
        """The first error in the log of an agent without goals; empty without errors.

        Always empty here: subclasses for such agents override this.
        """
        return ""

    def follow_transitions(self) -> None:
        """Emit transitions of goals, plan-actions and Skillers from now on."""
        tracker = TransitionTracker(self.env.name)

        def follow_fact(template: str, slots: dict[str, str]) -> None:
            if (event := tracker.track_assertion(self.bus.clock.now_us(), template, slots)) is not None:
                self.bus.emit(event)

        def follow_retraction(template: str, slots: dict[str, str]) -> None:
            # a retraction within a `modify` is not the end of a goal, because a new fact of the goal follows
            tracker.record_retraction(template, slots, is_final=not self.env.maker.is_replacing)

        for template, slots in {**TRACKED_TEMPLATES, **CALL_TEMPLATES}.items():
            self.env.watcher.follow(template, follow_fact, slots)
        for template, slots in RELEASING_TEMPLATES.items():
            self.env.watcher.follow_retractions(template, follow_retraction, slots)

    @property
    def is_over(self) -> bool:
        """Whether the run is over: the agent has quit, or the agent has achieved or given up its goals.

        The latter means that a root goal has ended, no other root goal is open, no skill runs and the agenda
        is empty. Waiting MAINTAIN goals do not count as open. An agent with only MAINTAIN goals never ends,
        because the maintained condition may change at any time. The property records goals that have ended.
        """
        self.goals.record_ended_goals()
        return self.env.quit_requested or (
            bool(self.goals.outcome_counts)
            and (bool(self.maintaining_goals) if self.goals.open_roots else self._is_at_rest)
        )

    @property
    def _is_at_rest(self) -> bool:
        """Whether no rule can fire and no skill runs."""
        return not self.env.has_activations(1) and not self.skills.has_running_skill

    @property
    def is_planning(self) -> bool:
        """Whether a planner works for the agent."""
        return any(status == "RUNNING" for (status,) in self.env.columns("planner-call", "status"))

    @property
    def maintaining_goals(self) -> list[str]:
        """The ids of the open root goals if all of them are waiting MAINTAIN goals; else empty.

        A MAINTAIN goal waits if all open goals below it are MAINTAIN goals, their plans have no unfinished
        action and no planner runs. Moreover, no skill may run and the agenda must be empty, unless the agent
        has quit.
        """
        roots = self.goals.maintaining_roots
        if not roots or self.is_planning or not (self._is_at_rest or self.env.quit_requested):
            return []
        maintaining = {state.goal for state in self.goals.open_goals.values() if state.is_maintaining}
        has_unfinished_action = any(
            slots["state"] not in FINAL_ACTION_STATES and str(slots["goal-id"]) in maintaining
            for _, _, slots in self.env.facts("plan-action")
        )
        return [] if has_unfinished_action else [root.goal for root in roots]

    @property
    def is_initialized(self) -> bool:
        """Whether all initialisation stages are done."""
        return next(self.env.facts("executive-initialized"), None) is not None

    def finalize(self) -> None:
        """Run the finalization rules and destroy the environment."""
        self.env.assert_string("(executive-finalize)")
        self.env.refresh_agenda()
        if self.env.run(MAX_FINAL_FIRINGS) >= MAX_FINAL_FIRINGS:
            self.log.warn(
                f"{MAX_FINAL_FIRINGS} rules fired after (executive-finalize): they fire in a cycle; "
                "the environment is destroyed"
            )
        # the rules of the finalization may have changed the settings of the environment
        self.env.emit_settings()
        self.manager.destroy(self.env.name)

    def _map_action_skill(self, action: str, names: tuple[Value, ...], values: tuple[Value, ...]) -> str:
        """Return the skill string of an action; empty after a log message about an error.

        The messages have the texts of Fawkes; known places and numbers are added.
        """
        if not self._mapper.has_template(action):
            self.log.warn(f"No mapping for action '{action}' known")
            return ""
        if len(names) != len(values):
            location = self.place_of_action(action)
            warning = f"Number of parameter names and values do not match for action '{action}'"
            self.log.warn(f"{location}: {warning}: {len(names)} and {len(values)}" if location else warning)
            return ""
        params = {}
        for name, value in zip(names, values, strict=True):
            if not isinstance(name, str):
                self.log.error(f"Param for '{action}' is not a string or symbol")
                return ""
            if isinstance(value, str | int | float):
                # the text that Fawkes passes to the mapping: a float has six decimals
                params[str(name)] = f"{value:f}" if isinstance(value, float) else str(value)
            else:  # as in Fawkes, the action is mapped without this parameter
                self.log.error(f"Param '{name}' for action '{action}' of invalid type")
        mapped = self._mapper.map(action, params)
        location = find_mapping_location(
            self._config, self._config.get_str("/clips-executive/spec", default=""), action
        )
        for level, message in mapped.messages:
            self.log.log(level, f"{location}: {message}" if location else message)
        return mapped.text


def find_mapping_location(config: Configuration, spec: str, action: str) -> str:
    """Return ``FILE:LINE`` of an action's mapping; empty without a mapping in a file."""
    path = f"/clips-executive/specs/{spec}/action-mapping/{action}"
    value = config.get(path) if config.exists(path) else None
    return f"{value.file}:{value.line}" if value is not None and value.file else ""


def find_skill_location(config: Configuration, spec: str, skill_string: str) -> str:
    """Return ``FILE:LINE`` of the only mapping that calls a skill string's skill.

    The result is empty if no mapping or several mappings call the skill.
    """
    skill_start = _SKILL_START.match(skill_string)
    actions = [
        action
        for action, template in read_action_mapping(config, spec).items()
        if skill_start is not None
        and (template_start := _SKILL_START.match(template)) is not None
        and template_start[0] == skill_start[0]
    ]
    return find_mapping_location(config, spec, actions[0]) if len(actions) == 1 else ""


def read_action_mapping(config: Configuration, spec: str) -> dict[str, str]:
    """Return the mapping templates of a spec by action.

    :raises ConfigError: if a template is a map or a list.
    """
    prefix = f"/clips-executive/specs/{spec}/action-mapping/"
    mapping = {}
    for item in config.search(prefix):
        action, slash, _ = item.path.removeprefix(prefix).partition("/")
        if item.is_list or slash:  # YAML reads say{...} without quotes as a map
            raise ConfigError(
                f"the mapping of action '{action}' must be a string, not a {'map' if slash else 'list'}",
                file=item.file,
                line=item.line,
                hint="a skill string with braces must be quoted: 'say{...}'",
            )
        mapping[action] = item.text
    return mapping
