"""The evidence for explanations: the events, rules and facts of a run, up to one moment.

A scenario, a recording and a daemon each have a subclass of :class:`Evidence`. Each fills a :class:`History`
with the events from the event bus or from the file.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from cxbridge.clipstext.facts import FactSyntaxError, parse_fact
from cxbridge.clock import MICROSECONDS
from cxbridge.errors import TraceError
from cxbridge.events import (
    Event,
    FactChange,
    GoalTransition,
    InterfaceMessage,
    InterfaceWrite,
    PlanActionTransition,
    PlannerCall,
    RuleFired,
    SkillStatus,
)
from cxbridge.history.exchange import is_board_message, message_agent
from cxbridge.history.model import PLAN_ACTION, ActionKey
from cxbridge.history.transitions import unquote
from cxbridge_studio.explain.action_diagnosis import FAILED_STATES, ActionDiagnosis, diagnose_action
from cxbridge_studio.explain.preconditions import FactLookup
from cxbridge_studio.explain.rules.snapshot import Rulebook, Snapshot

# The classes of events that the history of a scenario keeps to explain goals. It keeps no FactChange: the
# facts themselves are in the environment.
EVIDENCE_EVENT_TYPES: Final = (
    GoalTransition,
    PlanActionTransition,
    PlannerCall,
    SkillStatus,
    RuleFired,
    InterfaceWrite,
    InterfaceMessage,
)

# The limits keep the memory of a long run bounded; the oldest entries are dropped.
MAX_FIRINGS: Final = 200_000
MAX_STEPS: Final = 500_000
MAX_FACT_LIVES: Final = 200_000

MAX_RULES_BEFORE: Final = 3  # the number of rules kept with each transition: `why --rules` shows up to 3

# The limit of diagnosed actions in a run: each diagnosis searches all facts of the domain.
MAX_ACTION_DIAGNOSES: Final = 100

# The classes of events that belong to one CLIPS environment.
ENVIRONMENT_EVENT_TYPES: Final = (
    RuleFired,
    FactChange,
    GoalTransition,
    PlanActionTransition,
    PlannerCall,
    SkillStatus,
)

_SKILLER_TYPE: Final = "SkillerInterface"


class NoFactsError(TraceError):
    """The error about a recording without facts."""


@dataclass(frozen=True, slots=True)
class EvidenceStep:
    """An event that explains goals.

    It is a transition, a planner call, a skill's status, the fact of a plan-action, a message on the
    blackboard, or a change of a Skiller's error.

    :param rules: the rules that fired before a transition, a planner call or a skill's status; the last rule
        caused a transition. Empty for the other events.
    :param diagnosis: the diagnosis of a failed plan-action, made at the time of the failure: the facts may be
        retracted later.
    """

    event: Event
    rules: tuple[str, ...]
    diagnosis: ActionDiagnosis | None = None


@dataclass(slots=True)
class FactLife:
    """A fact from its assertion to its retraction.

    :param begin_rule: the rule that fired just before the assertion; empty if unknown.
    :param replaced_index: the index of the fact that the same firing retracted last before the assertion, if
        that fact has the same template; else -1.
    :param end_us: the time of the retraction; None while the fact exists.
    :param end_rule: the rule that fired just before the retraction; empty if unknown.
    """

    index: int
    template: str
    text: str
    begin_us: int
    begin_rule: str
    replaced_index: int = -1
    end_us: int | None = None
    end_rule: str = ""


class History:
    """The events of an environment up to one moment.

    An event bus, or the reader of a recording, calls :meth:`add_event`.

    :param env: the environment whose events are kept.
    :param max_steps: the number of steps to keep.
    :param max_firings: the number of firings to keep.
    :param find_facts: finds the facts at the time of the event; None if facts are unavailable.
    :ivar has_firings: whether firings are recorded.
    :ivar steps: the transitions and the other events that explain goals.
    :ivar fact_lives: the facts by index, with the retracted facts; empty if facts are not recorded.
    """

    def __init__(
        self,
        env: str,
        max_steps: int = MAX_STEPS,
        max_firings: int = MAX_FIRINGS,
        find_facts: FactLookup | None = None,
    ) -> None:
        self.env = env
        self._failed_actions: set[ActionKey] = set()
        self._remaining_diagnosis_count = MAX_ACTION_DIAGNOSES
        self._find_facts = find_facts
        self.steps: deque[EvidenceStep] = deque(maxlen=max_steps)
        self.firings: deque[RuleFired] = deque(maxlen=max_firings)
        self.has_firings = False
        self._skiller_errors: dict[str, str] = {}
        self._recent_rules: deque[str] = deque(maxlen=MAX_RULES_BEFORE)
        self.fact_lives: dict[int, FactLife] = {}
        self._last_retracted: FactLife | None = None  # the fact that the last firing retracted last

    def add_event(self, event: Event) -> None:
        """Keep an event if it explains goals, rules or facts."""
        if isinstance(event, InterfaceWrite):
            type_name, _, skiller = event.uid.partition("::")
            if type_name == _SKILLER_TYPE:
                self._record_skill_error(event, skiller, str(event.values.get("error", "")))
        elif isinstance(event, InterfaceMessage):
            # An execution reports its progress many times, which explains nothing.
            if (
                is_board_message(event)
                and event.message != "FeedbackMessage"
                and message_agent(event) in ("", self.env)
            ):
                self.steps.append(EvidenceStep(event, ()))
        elif isinstance(event, ENVIRONMENT_EVENT_TYPES) and event.env == self.env:
            self._add_environment_event(event)

    def _add_environment_event(self, event: Event) -> None:
        if isinstance(event, RuleFired):
            self.has_firings = True
            self.firings.append(event)
            self._recent_rules.append(event.rule)
            self._last_retracted = None
        elif isinstance(event, FactChange):
            self._record_fact_life(event)
            # A Fawkes log has no writes of interfaces, so the errors of skills come from the facts.
            if event.template == _SKILLER_TYPE and event.asserted:
                # A log may cut a fact short; then the fact shows no error.
                with suppress(FactSyntaxError):
                    _, slots = parse_fact(event.text)
                    self._record_skill_error(
                        event, unquote(slots.get("id", "")), unquote(slots.get("error", ""))
                    )
            elif event.template == PLAN_ACTION and event.asserted:
                # The transitions lack the Skiller and the arguments of the action, which the fact has.
                self.steps.append(EvidenceStep(event, ()))
        else:
            diagnosis = self._diagnose_failure(event) if isinstance(event, PlanActionTransition) else None
            self.steps.append(EvidenceStep(event, tuple(self._recent_rules), diagnosis))

    def _record_fact_life(self, event: FactChange) -> None:
        """Record which rule asserted or retracted a fact."""
        rule = self._recent_rules[-1] if self._recent_rules else ""
        if event.asserted:
            life = FactLife(event.index, event.template, event.text, event.time_us, rule)
            # CLIPS' modify retracts the fact and asserts the changed one, in the same firing.
            if self._last_retracted is not None and self._last_retracted.template == event.template:
                life.replaced_index = self._last_retracted.index
            self.fact_lives[event.index] = life
            if len(self.fact_lives) > MAX_FACT_LIVES:
                del self.fact_lives[next(iter(self.fact_lives))]
        elif (known_life := self.fact_lives.get(event.index)) is not None:
            known_life.end_us, known_life.end_rule = event.time_us, rule
            self._last_retracted = known_life

    def _diagnose_failure(self, event: PlanActionTransition) -> ActionDiagnosis | None:
        """Return the diagnosis of an action in its first failed state; None for other states.

        The changes after the first failed state are consequences of the failure. Without facts, and after
        :data:`MAX_ACTION_DIAGNOSES`, there is no diagnosis.
        """
        key = event.goal, event.plan, event.action_id
        if event.state not in FAILED_STATES:
            self._failed_actions.discard(key)
        elif (
            key not in self._failed_actions
            and self._find_facts is not None
            and self._remaining_diagnosis_count > 0
        ):
            self._remaining_diagnosis_count -= 1
            self._failed_actions.add(key)
            return diagnose_action(self._find_facts, key)
        return None

    def _record_skill_error(self, event: Event, skiller: str, text: str) -> None:
        """Keep an event that changes the error of a Skiller: most writes repeat the error."""
        previous_text, self._skiller_errors[skiller] = self._skiller_errors.get(skiller, ""), text
        if text != previous_text:
            self.steps.append(EvidenceStep(event, ()))


class Evidence(ABC):
    """The events, rules and facts that explain the state of a run at one moment.

    :param where: the source and the moment in words: ``test-scenario at 3.0 s``.
    :param start_us: the start of the run.
    :param now_us: the time of the moment.
    :param history: the events up to the moment.
    :ivar ending: how the run ended, in a sentence; empty while it continues, and if unknown.
    :ivar has_executive: whether events of an executive are known, or may come after the moment.
    :ivar is_time_chosen: whether the user chose the time, so that a reused goal id means the goal at that
        time.
    :ivar notes: remarks about missing or doubtful data, for the user.
    """

    has_executive = True
    is_time_chosen = False
    ending = ""

    def __init__(self, where: str, start_us: int, now_us: int, history: History) -> None:
        self.where = where
        self.start_us = start_us
        self.now_us = now_us
        self.history = history
        self.notes: list[str] = []

    @abstractmethod
    def read_rulebook(self) -> Rulebook:
        """Return the rules of the environment.

        :raises CxbridgeError: if the rules are unknown; the hint says how to provide them.
        """

    @abstractmethod
    def take_snapshot(self, rule: str) -> Snapshot:
        """Return a rule with its facts.

        :raises CxbridgeError: if there is no such rule, or the rules or the facts are unknown.
        """

    @abstractmethod
    def read_fact_slots(self, template: str) -> list[Mapping[str, str]]:
        """Return the slots of a deftemplate's facts, as CLIPS prints the values; empty if unknown."""

    def has_facts(self, template: str) -> bool:  # noqa: ARG002 - all facts of an environment are known
        """Return whether the facts of a deftemplate are known."""
        return True

    def read_rule_texts(self) -> Mapping[str, str]:
        """Return the text of all defrules by name; empty if they are unknown."""
        return {}

    def compute_seconds(self, time_us: int) -> float:
        """Return the seconds from the start of the run to a time."""
        return (time_us - self.start_us) / MICROSECONDS

    def find_rule_firings(self, rule: str) -> Sequence[RuleFired] | None:
        """Return the firings of a rule up to the moment; None if firings are unknown."""
        firings = [event for event in self.history.firings if event.rule == rule]
        return firings if self.history.has_firings else None
