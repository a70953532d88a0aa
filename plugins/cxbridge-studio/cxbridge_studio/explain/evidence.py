"""The evidence for explanations: the events, rules and facts of a run, up to one moment.

A scenario, a recording and a daemon each have a subclass of :class:`Evidence`. All of them fill a
:class:`History` from the event bus or from the file.
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
from cxbridge.history.exchange import agent_of, is_exchanged
from cxbridge.history.model import PLAN_ACTION, ActionKey
from cxbridge.history.transitions import unquote
from cxbridge_studio.explain.action_diagnosis import FAILED_STATES, ActionDiagnosis, diagnose_action
from cxbridge_studio.explain.preconditions import FactsOf
from cxbridge_studio.explain.rules.snapshot import Rulebook, Snapshot

# The events that explain goals.
STORY_TYPES: Final = (
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
MAX_LIVES: Final = 200_000

RULES_BEFORE: Final = 3  # the number of firings kept before each transition: `why --rules` shows up to 3

# Each diagnosis of a failed action searches all facts of the domain.
MAX_ACTION_DIAGNOSES: Final = 100

_SKILLER = "SkillerInterface"
_FEEDBACK = "FeedbackMessage"


class NoFactsError(TraceError):
    """A recording without facts."""


@dataclass(frozen=True, slots=True)
class EvidenceStep:
    """A transition, a planner call, the fact of a plan-action, or a new error of a Skiller.

    :param rules: the rules that fired just before; the last rule caused the step.
    :param diagnosis: the diagnosis of a failed plan-action, made at that time: its facts may be
        retracted later.
    """

    event: Event
    rules: tuple[str, ...]
    diagnosis: ActionDiagnosis | None = None


@dataclass(slots=True)
class FactLife:
    """A fact from its assertion to its retraction.

    :param rule: the rule that fired just before the assertion; empty if unknown.
    :param instead_of: the index of the fact of the same template that the same firing retracted; -1 if there
        is none.
    :param end_rule: the rule that fired just before the retraction; empty if unknown.
    """

    index: int
    template: str
    text: str
    begin_us: int
    rule: str
    instead_of: int = -1
    end_us: int | None = None
    end_rule: str = ""


class History:
    """The events of an environment up to the moment. :meth:`take` subscribes to an event bus.

    :param env: the environment whose events are kept.
    :param max_steps: the number of transitions to keep.
    :param max_firings: the number of firings to keep.
    :param facts_of: returns the current facts while an event is taken; None if facts are unavailable.
    :ivar rules_known: whether firings are recorded.
    :ivar lives: the facts by index, with the retracted facts; empty if facts are not recorded.
    """

    def __init__(
        self,
        env: str,
        max_steps: int = MAX_STEPS,
        max_firings: int = MAX_FIRINGS,
        facts_of: FactsOf | None = None,
    ) -> None:
        self.env = env
        self._failed: set[ActionKey] = set()
        self._diagnoses_left = MAX_ACTION_DIAGNOSES
        self._facts_of = facts_of
        self.steps: deque[EvidenceStep] = deque(maxlen=max_steps)
        self.firings: deque[RuleFired] = deque(maxlen=max_firings)
        self.rules_known = False
        self._errors: dict[str, str] = {}
        self._recent_rules: deque[str] = deque(maxlen=RULES_BEFORE)
        self.lives: dict[int, FactLife] = {}
        self._retracted: FactLife | None = None  # the fact that the last firing retracted

    def take(self, event: Event) -> None:
        """Keep an event if it explains goals."""
        if isinstance(event, InterfaceWrite):
            kind, _, skiller = event.uid.partition("::")
            if kind == _SKILLER:
                self._record_skill_error(event, skiller, str(event.values.get("error", "")))
        elif isinstance(event, InterfaceMessage):
            # An execution reports its progress many times, which explains nothing.
            if is_exchanged(event) and event.message != _FEEDBACK and agent_of(event) in ("", self.env):
                self.steps.append(EvidenceStep(event, ()))
        elif isinstance(event, _ENVIRONMENT_TYPES) and event.env == self.env:
            self._take_from_environment(event)

    def _take_from_environment(self, event: Event) -> None:
        if isinstance(event, RuleFired):
            self.rules_known = True
            self.firings.append(event)
            self._recent_rules.append(event.rule)
            self._retracted = None
        elif isinstance(event, FactChange):
            self._record_life(event)
            # A Fawkes log has no writes of interfaces: there, the errors of skills are in the facts.
            if event.template == _SKILLER and event.asserted:
                with suppress(FactSyntaxError):
                    _, slots = parse_fact(event.text)
                    error, skiller = unquote(slots.get("error", "")), unquote(slots.get("id", ""))
                    self._record_skill_error(event, skiller, error)
            elif event.template == PLAN_ACTION and event.asserted:
                self.steps.append(EvidenceStep(event, ()))  # names the Skiller and the arguments
        else:
            diagnosis = self._diagnose(event) if isinstance(event, PlanActionTransition) else None
            self.steps.append(EvidenceStep(event, tuple(self._recent_rules), diagnosis))

    def _record_life(self, event: FactChange) -> None:
        """Record which rule asserted or retracted a fact."""
        rule = self._recent_rules[-1] if self._recent_rules else ""
        if event.asserted:
            retracted = self._retracted
            # CLIPS' modify retracts the fact and asserts the changed one, in the same firing.
            is_modified = retracted is not None and retracted.template == event.template
            replaced = retracted.index if retracted is not None and is_modified else -1
            self.lives[event.index] = FactLife(
                event.index, event.template, event.text, event.time_us, rule, replaced
            )
            if len(self.lives) > MAX_LIVES:
                del self.lives[next(iter(self.lives))]
        elif (life := self.lives.get(event.index)) is not None:
            life.end_us, life.end_rule, self._retracted = event.time_us, rule, life

    def _diagnose(self, event: PlanActionTransition) -> ActionDiagnosis | None:
        """Diagnose an action at its first failed state: later changes are consequences."""
        key = event.goal, event.plan, event.action_id
        if event.state not in FAILED_STATES:
            self._failed.discard(key)
        elif key not in self._failed and self._facts_of is not None and self._diagnoses_left > 0:
            self._diagnoses_left -= 1
            self._failed.add(key)
            return diagnose_action(self._facts_of, key)
        return None

    def _record_skill_error(self, event: Event, skiller: str, text: str) -> None:
        previous, self._errors[skiller] = self._errors.get(skiller, ""), text
        if text != previous:
            self.steps.append(EvidenceStep(event, ()))


_ENVIRONMENT_TYPES = (RuleFired, FactChange, GoalTransition, PlanActionTransition, PlannerCall, SkillStatus)


class Evidence(ABC):
    """The evidence about a moment.

    :param where: source and time in words: ``test-scenario at 3.0 s``.
    :param start_us: the start of the run.
    :param now_us: the time of the moment.
    :param history: the events before the moment; None without a recording.
    :ivar ending: how the run ended, in a sentence; empty while it continues, and if unknown.
    :ivar is_moment: whether the user asked for a time, so that a reused goal id means the goal at that time.
    """

    is_moment = False
    ending = ""

    def __init__(self, where: str, start_us: int, now_us: int, history: History | None) -> None:
        self.where = where
        self.start_us = start_us
        self.now_us = now_us
        self.history = history
        self.notes: list[str] = []

    @abstractmethod
    def rulebook(self) -> Rulebook:
        """Return the rules of the environment.

        :raises CxbridgeError: if the rules are unknown; the hint says how to provide them.
        """

    @abstractmethod
    def snapshot(self, rule: str) -> Snapshot:
        """Return a rule with its facts.

        :raises CxbridgeError: if there is no such rule, or facts are unknown.
        """

    @abstractmethod
    def slots_of(self, template: str) -> list[Mapping[str, str]]:
        """Return the slots of a deftemplate's facts, as CLIPS prints the values; empty if unknown."""

    def has_facts_of(self, template: str) -> bool:  # noqa: ARG002 - all facts of an environment are known
        return True

    def rule_texts(self) -> Mapping[str, str]:
        """Return the text of all defrules by name; empty if they are unknown."""
        return {}

    def seconds(self, time_us: int) -> float:
        """Return the seconds from the start of the run to a time."""
        return (time_us - self.start_us) / MICROSECONDS

    def firings(self, rule: str) -> Sequence[RuleFired] | None:
        """Return the firings of a rule before the moment; None if firings are unknown."""
        if self.history is None or not self.history.rules_known:
            return None
        return [event for event in self.history.firings if event.rule == rule]
