"""The evidence about a run at one moment, from a scenario, a recording or a daemon."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from cxbridge.clipstext.facts import FactSyntaxError, parse_fact
from cxbridge.clock import MICROSECONDS
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
from cxbridge.history.orders import PLAN_ACTION, ActionKey
from cxbridge.history.transitions import unquote
from cxbridge_studio.explain.action_look import ActionLook, look_at_action
from cxbridge_studio.explain.preconditions import FactsOf
from cxbridge_studio.explain.rules.snapshot import Rulebook, Snapshot

STORY_TYPES: Final = (
    GoalTransition,
    PlanActionTransition,
    PlannerCall,
    SkillStatus,
    RuleFired,
    InterfaceWrite,
    InterfaceMessage,
)
"""The events that show how goals came about."""

MOST_FIRINGS: Final = 200_000
"""Firings that are remembered, the last ones."""

MOST_STEPS: Final = 500_000
"""Transitions that are remembered, the last ones."""

RULES_BEFORE: Final = 3
"""Firings that are remembered of those just before a transition."""

MOST_LOOKS: Final = 100
"""Actions that are looked at when they fail; each look goes through the facts of the domain."""

_SKILLER = "SkillerInterface"
_FEEDBACK = "FeedbackMessage"
_FAILED_STATES: Final = ("EXECUTION-FAILED", "FAILED")


@dataclass(frozen=True, slots=True)
class EvidenceStep:
    """A transition, a planner's call, the fact of a plan-action, or another error of a Skiller than before.

    :param rules: the rules that fired just before it, the last one last: that one made it.
    :param look: of a plan-action that fails: what facts say about it then; they may be gone later.
    """

    event: Event
    rules: tuple[str, ...]
    look: ActionLook | None = None


class History:
    """What happened up to the moment. A sink for an event bus.

    :param env: the environment it is about.
    :param most_steps: transitions that are remembered.
    :param most_firings: firings that are remembered.
    :param facts_of: reads the present facts of the environment while an event is taken; None: impossible.
    :ivar rules_known: whether firings were recorded at all.
    """

    def __init__(
        self,
        env: str,
        most_steps: int = MOST_STEPS,
        most_firings: int = MOST_FIRINGS,
        facts_of: FactsOf | None = None,
    ) -> None:
        self.env = env
        self._failed: set[ActionKey] = set()
        self._looks_left = MOST_LOOKS
        self._facts_of = facts_of
        self.steps: deque[EvidenceStep] = deque(maxlen=most_steps)
        self.firings: deque[RuleFired] = deque(maxlen=most_firings)
        self.rules_known = False
        self._errors: dict[str, str] = {}
        self._rules: deque[str] = deque(maxlen=RULES_BEFORE)

    def take(self, event: Event) -> None:
        """Remember an event, if it says how goals came about."""
        if isinstance(event, InterfaceWrite):
            kind, _, skiller = event.uid.partition("::")
            if kind == _SKILLER:
                self._skill_error(event, skiller, str(event.values.get("error", "")))
        elif isinstance(event, InterfaceMessage):
            # an execution reports its progress many times, and that explains nothing
            if is_exchanged(event) and event.message != _FEEDBACK and agent_of(event) in ("", self.env):
                self.steps.append(EvidenceStep(event, ()))
        elif isinstance(event, _OF_ENVIRONMENT) and event.env == self.env:
            self._take_own(event)

    def _take_own(self, event: Event) -> None:
        if isinstance(event, RuleFired):
            self.rules_known = True
            self.firings.append(event)
            self._rules.append(event.rule)
        elif isinstance(event, FactChange):
            if event.template == _SKILLER and event.asserted:
                with suppress(FactSyntaxError):
                    _, slots = parse_fact(event.text)
                    error, skiller = unquote(slots.get("error", "")), unquote(slots.get("id", ""))
                    self._skill_error(event, skiller, error)
            elif event.template == PLAN_ACTION and event.asserted:
                self.steps.append(
                    EvidenceStep(event, ())
                )  # it has who is to execute the action, and with what
        else:
            look = self._look(event) if isinstance(event, PlanActionTransition) else None
            self.steps.append(EvidenceStep(event, tuple(self._rules), look))

    def _look(self, event: PlanActionTransition) -> ActionLook | None:
        """Look at an action that fails, once: later changes are its consequences."""
        key = event.goal, event.plan, event.action_id
        if event.state not in _FAILED_STATES:
            self._failed.discard(key)
        elif key not in self._failed and self._facts_of is not None and self._looks_left > 0:
            self._looks_left -= 1
            self._failed.add(key)
            return look_at_action(self._facts_of, key)
        return None

    def _skill_error(self, event: Event, skiller: str, text: str) -> None:
        before, self._errors[skiller] = self._errors.get(skiller, ""), text
        if text != before:
            self.steps.append(EvidenceStep(event, ()))


_OF_ENVIRONMENT = (RuleFired, FactChange, GoalTransition, PlanActionTransition, PlannerCall, SkillStatus)


class Evidence(ABC):
    """The evidence about a moment.

    :param where: its source and time, for people: ``test-scenario at 3.0 s``.
    :param start_us: when the run began.
    :param now_us: the moment.
    :param history: the events before it; None without a record.
    :ivar is_moment: whether the user asked for a time: of several lives of a goal's id
        the one at that time counts.
    """

    is_moment = False

    def __init__(self, where: str, start_us: int, now_us: int, history: History | None) -> None:
        self.where = where
        self.start_us = start_us
        self.now_us = now_us
        self.history = history
        self.notes: list[str] = []

    @abstractmethod
    def rulebook(self) -> Rulebook:
        """Return which rules there are.

        :raises CxbridgeError: when that is not known, with what to do about it.
        """

    @abstractmethod
    def snapshot(self, rule: str) -> Snapshot:
        """Return the snapshot of a rule.

        :raises CxbridgeError: when there is no such rule, or facts are not known.
        """

    @abstractmethod
    def slots_of(self, template: str) -> list[Mapping[str, str]]:
        """Return the facts of a deftemplate: slots, as CLIPS prints their values. None when not known."""

    def has_facts_of(self, template: str) -> bool:  # noqa: ARG002 - of an environment all facts are known
        """Whether :meth:`slots_of` is all there is of a deftemplate."""
        return True

    def rule_texts(self) -> Mapping[str, str]:
        """Return all defrules by name; nothing where they are not known."""
        return {}

    def seconds(self, time_us: int) -> float:
        """Return a time as seconds since the start of the run."""
        return (time_us - self.start_us) / MICROSECONDS

    def firings(self, rule: str) -> Sequence[RuleFired] | None:
        """Return the firings of a rule before the moment; None when firings are not known."""
        if self.history is None or not self.history.rules_known:
            return None
        return [event for event in self.history.firings if event.rule == rule]
