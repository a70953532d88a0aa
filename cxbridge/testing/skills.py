"""The script of skills: a test determines the outcomes of skill calls, and looks up the calls.

``run.skills("drive", to="kitchen").fails("blocked", times=1).succeeds()`` makes a :class:`SkillRule` for the
calls of ``drive`` with this argument: the first call fails, and all further calls succeed.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import Any, Final, Protocol, Self

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.skiller.simulation.deciders import FOREVER_S, Decider, Effect, Outcome
from cxbridge.skiller.simulation.estimators import argument_text
from cxbridge.skiller.skillstring import SkillStringCall
from cxbridge.skiller.status import Status
from cxbridge.suggestions import bracketed_suggestion

_PATTERN_CHARACTER: Final = re.compile(r"[*?[]")  # a character with a meaning in shell patterns
_MAX_EXAMPLES: Final = 3  # the maximum number of different calls in a complaint


@dataclass(frozen=True, slots=True)
class Call:
    """A started call of a skill.

    :param seconds: the seconds since the start of the run.
    :param name: the name of the skill.
    :param args: the arguments by name, or by position from 1.
    :param skiller: the Skiller that executes the skill, or the agent on the skill board.
    """

    seconds: float
    name: str
    args: dict[str | int, Any]
    skiller: str

    def __str__(self) -> str:
        """Return the call in Python's notation."""
        args = (
            repr(value) if isinstance(key, int) else f"{key}={value!r}" for key, value in self.args.items()
        )
        return f"{self.name}({', '.join(args)})"


class SkillAnswer(Protocol):
    """Determines the outcome of a call."""

    def __call__(self, call: Call) -> Outcome | None:
        """Return the outcome of a started call, or None for the usual outcome.

        The skill board's executor determines the usual outcome; without an executor the call succeeds after
        a second.
        """


@dataclass(slots=True)
class _Behaviour:
    """The outcome of a number of calls.

    :param answer: determines the outcome of each call.
    :param times: the number of remaining calls; None for all further calls.
    :param then: the effect of each call on the world, if any.
    """

    answer: SkillAnswer
    times: int | None
    then: Effect | None


@dataclass
class SkillRule:
    """The behaviours of the calls that match a skill's name and arguments, in order.

    :param name: the name of the skill; ``*`` for all skills.
    :param args: the arguments to match; texts may be shell patterns.
    :param calls: the matching calls so far.
    """

    name: str
    args: dict[str, Any] = field(default_factory=dict)
    calls: list[Call] = field(default_factory=list)
    _behaviours: list[_Behaviour] = field(default_factory=list)
    _has_script: bool = False
    _is_optional: bool = False

    def optional(self) -> Self:
        """Accept a run without a matching call, which otherwise fails the test."""
        self._is_optional = True
        return self

    def succeeds(self, *, after: float = 1.0, times: int | None = None, then: Effect | None = None) -> Self:
        """Let the calls succeed.

        :param after: the duration of each call in seconds.
        :param times: the number of calls; None: all further calls.
        :param then: changes the world at the end of each call.
        :raises ValueError: if ``after`` is negative or ``times`` is less than 1.
        """
        return self._add_behaviour(_make_constant_answer(Outcome(after)), times, then)

    def fails(
        self, error: str = "", *, after: float = 1.0, times: int | None = None, then: Effect | None = None
    ) -> Self:
        """Let the calls fail with an error.

        The other parameters and the exception are those of :meth:`succeeds`.
        """
        return self._add_behaviour(_make_constant_answer(Outcome(after, Status.S_FAILED, error)), times, then)

    def hangs(self, *, times: int | None = None) -> Self:
        """Let the calls never end.

        :raises ValueError: if ``times`` is less than 1.
        """
        return self._add_behaviour(_make_constant_answer(Outcome(FOREVER_S)), times, None)

    def does(self, answer: SkillAnswer, *, times: int | None = None, then: Effect | None = None) -> Self:
        """Let a function determine the outcome at the start of each call.

        :raises TypeError: if ``answer`` is not a function.
        :raises ValueError: if ``times`` is less than 1.
        """
        return self._add_behaviour(answer, times, then)

    def _add_behaviour(self, answer: SkillAnswer, times: int | None, then: Effect | None) -> Self:
        check_number("times", 1 if times is None else times, 1)
        if not callable(answer):
            raise TypeError(f"does({answer!r}): a function of the call that returns an Outcome is required")
        self._has_script = True
        self._behaviours.append(_Behaviour(answer, times, then))
        return self

    def matches(self, call: SkillStringCall) -> bool:
        """Return whether the rule applies to a call."""
        return fnmatchcase(call.name, self.name) and all(
            key in call.args and _matches_pattern(call.args[key], pattern)
            for key, pattern in self.args.items()
        )

    def __str__(self) -> str:
        """Return the rule in the notation of tests."""
        return (
            "run.skills("
            + ", ".join([repr(self.name), *(f"{key}={value!r}" for key, value in self.args.items())])
            + ")"
        )

    def make_complaint(self, skills: Collection[str], calls: Iterable[Call] = ()) -> str:
        """Return the complaint that no call matches the rule; empty if a call matches or none is needed.

        :param skills: the names of skills that were called, or to which actions are mapped.
        :param calls: the calls of the run.
        """
        if self.calls or self._is_optional:
            return ""
        if not any(fnmatchcase(skill, self.name) for skill in skills):
            skills_text = f": the skills are {', '.join(sorted(skills))}" if skills else ""
            hint = bracketed_suggestion(self.name, skills) or skills_text
            # a rule without outcomes only looks calls up, often to check that there are none: its name is a
            # typo only if it is a plain name, and the names of the skills are known
            is_typo = self._has_script or (skills and not _PATTERN_CHARACTER.search(self.name))
            return f"{self} matches no call: there is no skill '{self.name}'{hint}" if is_typo else ""
        skill_calls = [call for call in calls if fnmatchcase(call.name, self.name)]
        call_texts = dict.fromkeys(map(str, skill_calls))
        examples = f", calls were {', '.join(list(call_texts)[:_MAX_EXAMPLES])}" if call_texts else ""
        return (
            f"{self} matches no call{examples}; say .optional() if it need not match"
            if self._has_script
            else ""
        )

    def use_next_behaviour(self) -> _Behaviour | None:
        """Return the behaviour of the next call, and count the call; None without a further behaviour."""
        behaviour = next(iter(self._behaviours), None)
        if behaviour is not None and behaviour.times is not None:
            behaviour.times -= 1
            if behaviour.times == 0:
                del self._behaviours[0]
        return behaviour


def check_number(name: str, value: object, minimum: int = 0) -> None:
    """Check an argument of a test, whose later use would fail far from the test, or wait forever.

    :raises ValueError: if the value is not a number, or less than the minimum.
    """
    if not isinstance(value, int | float) or value < minimum:
        raise ValueError(f"{name}={value!r} must be a number of at least {minimum}")


def _make_constant_answer(outcome: Outcome) -> SkillAnswer:
    """Return an answer with the same outcome for all calls."""
    check_number("after", outcome.seconds)

    def answer(call: Call) -> Outcome:  # noqa: ARG001 - all calls have the same outcome
        return outcome

    return answer


def _matches_pattern(value: object, pattern: object) -> bool:
    return fnmatchcase(argument_text(value), pattern) if isinstance(pattern, str) else value == pattern


class SkillScript:
    """The script of a run's skills.

    :param clock: the clock of the run.
    """

    def __init__(self, clock: Clock) -> None:
        self.calls: list[Call] = []
        """All started calls, in order."""
        self.otherwise = SkillRule("*")
        """The rule for calls without another behaviour."""
        self._clock = clock
        self._start_us = clock.now_us()
        self._rules: list[SkillRule] = []

    def __call__(self, name: str, **args: object) -> SkillRule:
        """Return the rule for calls of a skill with these arguments; the first call creates the rule."""
        rule = next((rule for rule in self._rules if (rule.name, rule.args) == (name, args)), None)
        if rule is None:
            rule = SkillRule(name, args)
            rule.calls += [call for call in self.calls if rule.matches(SkillStringCall(call.name, call.args))]
            self._rules.append(rule)
        return rule

    def list_complaints(self, mapped_skills: Collection[str] = ()) -> list[str]:
        """Return the complaints about rules that no call matched, at the end of the run."""
        skills = {*mapped_skills, *(call.name for call in self.calls)}
        return [complaint for rule in self._rules if (complaint := rule.make_complaint(skills, self.calls))]

    def begin(self, skiller: str, call: SkillStringCall) -> Outcome | None:
        """Record the start of a call; return its outcome, or None if the script has none."""
        seconds = (self._clock.now_us() - self._start_us) / MICROSECONDS
        started_call = Call(seconds, call.name, dict(call.args), skiller)
        self.calls.append(started_call)
        matching_rules = [rule for rule in self._rules if rule.matches(call)]
        for rule in matching_rules:
            rule.calls.append(started_call)
        # the last rule wins, as a test may refine the rules of its fixture
        for rule in (*reversed(matching_rules), self.otherwise):
            if (behaviour := rule.use_next_behaviour()) is not None:
                outcome = behaviour.answer(started_call)
                return (
                    outcome if behaviour.then is None else replace(outcome or Outcome(), then=behaviour.then)
                )
        return None

    def decider(self, skiller: str) -> ScriptedDecider:
        """Return the decider of a Skiller, or of an agent on the skill board."""
        return ScriptedDecider(self, skiller)


class ScriptedDecider(Decider):
    """Decides outcomes by the script, for a Skiller or an agent on the skill board."""

    priority = sys.maxsize  # before the deciders of plug-ins and of the configuration

    def __init__(self, script: SkillScript, skiller: str) -> None:
        self._script, self._skiller = script, skiller

    def decide(self, call: SkillStringCall) -> Outcome | None:
        """Return the outcome of a started call, or None if the script has none."""
        return self._script.begin(self._skiller, call)
