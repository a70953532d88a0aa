"""The CLIPS Executive as a component."""

from __future__ import annotations

from functools import partial

from cxbridge.config import Configuration
from cxbridge.errors import ExecutiveError
from cxbridge.executive.executive import Executive, read_action_mapping
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import BaseExecutiveComponent
from cxbridge.run.explainers import place_of_action
from cxbridge.run.features import FEATURES, run_features
from cxbridge.run.mistakes import UnexecutedActions, known_skills, own_files
from cxbridge.run.rights import permits_remote_programs
from cxbridge.run.skillers import skiller_mode
from cxbridge.run.specs import check_features, init_mentions
from cxbridge.skiller.mapping import ActionSkillMapping

# The rules and facts of each cycle, which would fill most of a recording.
_CYCLE_RULES = ("time-retract", "blackboard-read")
_CYCLE_FACTS = ("time",)


class ExecutiveComponent(BaseExecutiveComponent):
    """Runs the rules of an agent.

    :raises CxbridgeError: if the configuration or the CLIPS library is wrong.
    """

    hooks = (Hook.THINK,)
    description = "CLIPS Executive"

    def __init__(self, context: Run) -> None:
        self.context = context
        self.firings = 0
        self._has_begun = False  # whether the finalization rules are due: loading has begun
        self.manager, self.executive = make_executive(context)
        self.executive.known_skills = partial(known_skills, context)

    def watch(self) -> None:
        self.executive.env.watcher.set_hooks()
        self.executive.follow_transitions()
        UnexecutedActions(self.context, self.executive)  # the environment's watcher keeps the object
        _watch_for_recording(self.executive, self.context.config, self.context.watch_level)

    def configure(self) -> None:
        """Load the core and the agent."""
        self._has_begun = True
        for name in unasked_features(self.context):
            self.manager.request(self.executive.env.name, name)
        self.executive.init()
        self.context.source.start_thinking(self.context.clock, self.context.config)

    def loop(self) -> None:
        """Run the rules if a tick is due."""
        self.firings += self.context.source.think(self.executive)

    def check(self) -> None:
        """Raise an error if the executive cannot continue.

        :raises ExecutiveError: if a Python function called by rules failed unexpectedly, or the agent has
            quit.
        """
        self.executive.goals.record_ended_goals()  # frees the memory of ended goals
        env = self.executive.env
        if env.faults:
            raise ExecutiveError(env.faults[0])
        if env.quit_requested:
            raise ExecutiveError("the agent has quit")

    def finalize(self) -> None:
        has_begun, self._has_begun = self._has_begun, False
        if has_begun:
            self.executive.finalize()

    def skip_finalization(self) -> None:
        self._has_begun = False

    @property
    def is_quiet(self) -> bool:
        return True

    def close(self) -> None:
        try:
            self.finalize()
        finally:
            self.abort()

    def abort(self) -> None:
        self.manager.close()


def unasked_features(context: Run) -> list[str]:
    """Return the names of the features that plug-ins and programs add without a request of the agent."""
    names = [feature.name for feature in context.additions.features]
    names += [row.name for row in FEATURES.rows if row.requested(context)]
    return [name for name in names if not init_mentions(context.config, context.spec, name)]


def make_executive(
    context: Run, environment: type[ClipsEnvironment] = ClipsEnvironment
) -> tuple[EnvironmentManager, Executive]:
    """Make the executive of an agent without loading any file.

    :returns: the manager and the executive.
    :raises CxbridgeError: if the configuration or the CLIPS library is wrong.
    """
    config, spec, source = context.config, context.spec, context.source
    manager = source.make_manager(context, run_features(context), environment)
    try:
        for feature in context.additions.features:
            manager.add_feature(feature)
        check_features(config, spec, manager.features)
        # in the mode `fawkes`, values of plan-actions are pasted into Lua, and could be programs
        mode = skiller_mode(config) if permits_remote_programs(config) else "strict"
        mapping = ActionSkillMapping(read_action_mapping(config, spec), mode=mode)
        executive = source.make_executive(context, manager, mapping, source.core_files(context.paths, config))
        executive.place_of_action = lambda action: place_of_action(own_files(context, executive), action)
    except Exception:
        manager.close()
        raise
    return manager, executive


def _watch_for_recording(executive: Executive, config: Configuration, level: str) -> None:
    """Watch the rules and facts of a recording's level, except those of each cycle."""
    # with debugging on, the core's own configuration has chosen the watches
    if level == "transitions" or config.get_bool("/clips-executive/debug/enable", default=False):
        return
    watcher = executive.env.watcher
    watcher.rules.set((), on=True)  # no names: all rules
    watcher.rules.set(_CYCLE_RULES, on=False)
    if level == "facts":
        watcher.facts.set((), on=True)
        watcher.facts.set(_CYCLE_FACTS, on=False)
