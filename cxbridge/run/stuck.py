"""Detection of a stuck run: a run that waits for events that cannot come.

:class:`StuckWatch` first checks cheaply whether all agents are idle: the agenda is empty, no skill and no
planner runs, and no other program can write to the agent. Time alone may still activate a rule, so an
explainer of a plug-in (:mod:`cxbridge.run.explainers`) then parses the rules. A stuck run ends before its
timeout, and its result names the missing events. Without an explainer, no run counts as stuck.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

from cxbridge.events import LogLine
from cxbridge.run.explainers import missing_events

if TYPE_CHECKING:
    from cxbridge.events import Event
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.run.agent import Run
    from cxbridge.run.team import Team

TICK_RULES: Final = frozenset({"time-retract", "blackboard-read"})
"""The rules of the core that fire in each cycle without further effect."""

# Features that assert facts only on request of a rule.
_PASSIVE_FEATURES: Final = frozenset(
    {
        "blackboard", "config", "redefine-warning", "pddl-parser", "planner", "skill-board", "navgraph",
        "motor-switch", "tf",
    }
)  # fmt: skip

RULE_ERROR_CODE: Final = "[PRCCODE4]"
"""The start of CLIPS' message that names the rule of an error; CLIPS prints the error itself before."""

_MIN_QUIET_CYCLES: Final = 15  # half a second at Fawkes' period


class StuckWatch:
    """Checks periodically whether the agents of a run can still change anything.

    :param run: the run, whose agents may change.
    """

    def __init__(self, run: Run | Team) -> None:
        self.missing_events: dict[str, str] = {}
        """The events that a stuck run waits for, by agent; empty unless the run is stuck."""
        self._run = run
        self._agents: Sequence[Run] = run.agents
        self._firings = self._quiet_cycles = 0
        self._next_check_cycle = _MIN_QUIET_CYCLES
        self._failed_rules: dict[str, None] = {}  # a set in the order of the errors
        run.bus.subscribe(self._record_error, LogLine)

    def _record_error(self, event: Event) -> None:
        text = getattr(event, "text", "")
        # e.g. [PRCCODE4] Execution halted during the actions of defrule 'NAME'.
        if text.startswith(RULE_ERROR_CODE) and "'" in text:
            self._failed_rules[text.split("'")[1]] = None

    def observe_cycle(self) -> bool:
        """Take a cycle into account; return whether the run is stuck. To be called after each cycle."""
        # a check takes milliseconds, too long for each cycle: the first check waits for some cycles in which
        # no more rules fire than TICK_RULES names, each further check for twice as many as the previous one
        agents, firings_before = self._run.agents, self._firings
        self._firings = sum(agent.firings for agent in agents)
        is_quiet_cycle = self._firings - firings_before <= len(TICK_RULES) * len(agents)
        if agents != self._agents or not is_quiet_cycle:
            self._agents = agents
            self._quiet_cycles, self._next_check_cycle = 0, _MIN_QUIET_CYCLES
        self._quiet_cycles += is_quiet_cycle
        if self._quiet_cycles < self._next_check_cycle:
            return False
        self._next_check_cycle *= 2
        self.missing_events = self._find_missing_events()
        return bool(self.missing_events)

    def _find_missing_events(self) -> dict[str, str]:
        """Return the events that each open agent waits for; empty if an agent can still change anything."""
        open_agents = [agent for agent in self._agents if not agent.is_over]
        if not all(map(_is_idle, open_agents)):
            return {}
        events_by_agent = {agent.name: missing_events(agent, self._failed_rules) for agent in open_agents}
        return events_by_agent if all(events_by_agent.values()) else {}


def _is_idle(agent: Run) -> bool:
    """Return whether only time could activate a rule of an agent."""
    env = agent.executive.env
    return (
        agent.is_quiet
        and not env.has_activations(1)
        and not agent.executive.skills.has_running_skill
        and not agent.executive.is_planning
        and _PASSIVE_FEATURES.issuperset(agent.manager.loaded_features(env.name))
        and not _has_running_timeout(agent)
        and not any(
            _has_foreign_writer(agent, type_name, id_) for type_name, id_ in find_read_interfaces(env)
        )
    )


def _has_running_timeout(agent: Run) -> bool:
    """Return whether the time of a goal with a timeout is running, so that the goal ends by itself."""
    # the rules of timeout.clp store the start time; they need the time fact of each cycle
    return agent.config.get_bool("/clips-executive/assert-time-each-loop", default=False) and any(
        mode == "DISPATCHED" and "start-time" in map(str, meta or ())
        for mode, meta in agent.executive.env.columns("goal", "mode", "meta")
    )


def find_read_interfaces(env: ClipsEnvironment) -> Iterator[tuple[str, str]]:
    """Yield type and id of the interfaces that rules read."""
    for _, _, slots in env.facts("blackboard-interface"):
        if slots.get("writing") != "TRUE":
            yield str(slots["type"]), str(slots["id"])


def _has_foreign_writer(agent: Run, type_name: str, id_: str) -> bool:
    """Return whether a program other than the rules may write an interface."""
    if type_name == "SkillerInterface":
        return False  # its Skiller is a component of this run, and idle
    return any(
        interface.has_writer and not interface.writer.startswith("CLIPS:")
        for interface in agent.board.list_all()
        if (interface.type, interface.id) == (type_name, id_)
    )
