"""The CLIPS Executive as a component, with the features that its environments may request."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from cxbridge.config import Configuration
from cxbridge.errors import ExecutiveError
from cxbridge.executive.executive import Executive, action_mapping
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import ThinkingComponent
from cxbridge.run.ending import stuck
from cxbridge.run.ending.mistakes import known_skills
from cxbridge.run.ending.places import UnexecutedActions, places_of
from cxbridge.run.features import FEATURES, run_features
from cxbridge.run.rights import data_may_be_programs
from cxbridge.run.skillers import skiller_mode
from cxbridge.run.specs import check_features, init_mentions, needs_memory
from cxbridge.skiller.mapping import ActionSkillMapping

_EVERY_TICK_RULES = ("time-retract", "blackboard-read")
_EVERY_TICK_FACTS = ("time",)


class ExecutiveComponent(ThinkingComponent):
    """Lets the rules of an agent think.

    :raises CxbridgeError: when the configuration or the library is wrong.
    """

    hooks = (Hook.THINK,)
    description = "CLIPS Executive"

    def __init__(self, context: Run) -> None:
        self.context = context
        self.firings = 0
        """How many rules have fired."""
        self._begun = False
        if needs_memory(context.config, context.spec):
            context.memory.open()
        self.manager, self.executive = make_executive(context)
        self.executive.known_skills = partial(known_skills, context)

    def watch(self) -> None:
        """Watch facts and rules for history and recording, from before the first file is loaded."""
        self.executive.env.watcher.start()
        self.executive.follow_transitions()
        UnexecutedActions(self.context, self.executive)
        _watch_for_recording(self.executive, self.context.config, self.context.options.trace_level)

    def configure(self) -> None:
        """Load the core and the agent."""
        self._begun = True
        for name in unasked_features(self.context):
            self.manager.request(self.executive.env.name, name)
        self.executive.init()
        self.context.source.start_thinking(self.context.clock, self.context.config)

    def loop(self) -> None:
        """Think, if it is time to."""
        self.firings += self.context.source.think(self.executive)

    def check(self) -> None:
        """Raise when a fault of ours came to light in the rules' work, or the agent has quit."""
        self.executive.goals.settle()  # or the goals that ended would be kept forever
        env = self.executive.env
        if env.faults:
            raise ExecutiveError(env.faults[0])
        if env.quit_requested:
            raise ExecutiveError("the agent has quit")

    def finalize(self) -> None:
        """Let the rules run their finalization; a second call does nothing."""
        begun, self._begun = self._begun, False
        if begun:
            self.executive.finalize()

    def forgo_finalization(self) -> None:
        """Let :meth:`finalize` do nothing."""
        self._begun = False

    @property
    def is_stuck(self) -> bool:
        """Whether nothing can happen to the agent any more."""
        return stuck.is_stuck(self.context)

    def waits_for(self, failed_rules: Iterable[str]) -> str:
        """Return the events that the agent waits for and that cannot come."""
        return stuck.waits_for(self.context, failed_rules)

    @property
    def is_quiet(self) -> bool:
        """Whether it changes nothing but by rules: always."""
        return True

    def close(self) -> None:
        """Finalize, and unload everything."""
        try:
            self.finalize()
        finally:
            self.abort()

    def abort(self) -> None:
        """Unload everything."""
        self.executive.close()
        self.manager.close()


def unasked_features(context: Run) -> list[str]:
    """Return the features that an agent gets though its initialisation does not name them."""
    names = [feature.name for feature in context.additions.features]
    names += [row.name for row in FEATURES.rows if row.requested(context)]
    return [name for name in names if not init_mentions(context.config, context.spec, name)]


def make_executive(
    context: Run, environment: type[ClipsEnvironment] = ClipsEnvironment
) -> tuple[EnvironmentManager, Executive]:
    """Make the executive of an agent; nothing of the agent is loaded yet.

    :param environment: the class of its environment.
    :returns: the manager of its environment, to be closed after it, and the executive.
    :raises CxbridgeError: when the configuration or the library is wrong.
    """
    config, spec = context.config, context.spec
    source = context.source
    manager = source.make_manager(context, run_features(context), environment)
    try:
        for feature in context.additions.features:
            manager.add_feature(feature)
        check_features(config, spec, manager.features)
        mode = skiller_mode(config) if data_may_be_programs(config) else "strict"
        mapping = ActionSkillMapping(action_mapping(config, spec), mode=mode)
        files = source.core_files(context.paths, config)
        executive = source.make_executive(context, manager, mapping, files)
        executive.place_of_action = lambda action: places_of(context, executive).of_action(action)
    except Exception:
        manager.close()
        raise
    return manager, executive


def _watch_for_recording(executive: Executive, config: Configuration, level: str) -> None:
    """Watch facts and rules for a recording of ``level`` when the configuration leaves debugging off."""
    if level == "transitions" or config.get_bool("/clips-executive/debug/enable", default=False):
        return
    watcher = executive.env.watcher
    watcher.rules.set((), on=True)
    watcher.rules.set(_EVERY_TICK_RULES, on=False)
    if level == "facts":
        watcher.facts.set((), on=True)
        watcher.facts.set(_EVERY_TICK_FACTS, on=False)
