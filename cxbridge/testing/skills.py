"""Skills that end as a test says."""

from __future__ import annotations

import re
import sys
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import Any, Final, Protocol, Self

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.skiller.simulation.deciders import FOREVER, Decider, Effect, Outcome
from cxbridge.skiller.simulation.estimators import as_text
from cxbridge.skiller.skillstring import SkillStringCall
from cxbridge.skiller.status import Status
from cxbridge.suggestions import nearest

_PATTERN: Final = re.compile(r"[*?[]")
_MOST_SHOWN: Final = 3  # different calls, in a complaint


@dataclass(frozen=True, slots=True)
class Call:
    """A call of a skill that began.

    :param seconds: when, since the run began.
    :param name: the skill.
    :param args: its arguments by name; those without one by their position, from 1.
    :param skiller: who was to execute it: a Skiller, or an agent of the skill board.
    """

    seconds: float
    name: str
    args: dict[str | int, Any]
    skiller: str

    def __str__(self) -> str:
        """Return the skill with its arguments, as Python would call it."""
        args = (
            repr(value) if isinstance(key, int) else f"{key}={value!r}" for key, value in self.args.items()
        )
        return f"{self.name}({', '.join(args)})"


class SkillAnswer(Protocol):
    """Says how a call ends."""

    def __call__(self, call: Call) -> Outcome | None:
        """Return how a call that begins will end; None: as usual.

        Usual is what an executor of the skill board does, and elsewhere success after a second.
        """


@dataclass(slots=True)
class _Behaviour:
    """The outcome of a number of calls.

    :param times: None: forever.
    """

    answer: SkillAnswer
    times: int | None
    then: Effect | None


@dataclass
class SkillRule:
    """The outcomes of calls of a skill, in the order of the script.

    :param name: the skill; ``*`` for all.
    :param args: the arguments that they have; texts may have the shell's patterns.
    """

    name: str
    args: dict[str, Any] = field(default_factory=dict)
    calls: list[Call] = field(default_factory=list)
    _behaviours: list[_Behaviour] = field(default_factory=list)
    _scripted: bool = False
    _optional: bool = False

    def optional(self) -> Self:
        """Allow that no call comes; otherwise a test fails when a scripted skill is never called."""
        self._optional = True
        return self

    def succeeds(self, *, after: float = 1.0, times: int | None = None, then: Effect | None = None) -> Self:
        """Let the calls succeed after this many seconds."""
        return self._say(_always(Outcome(after)), times, then)

    def fails(
        self, error: str = "", *, after: float = 1.0, times: int | None = None, then: Effect | None = None
    ) -> Self:
        """Let the calls fail with this error after this many seconds."""
        return self._say(_always(Outcome(after, Status.S_FAILED, error)), times, then)

    def hangs(self, *, times: int | None = None) -> Self:
        """They never end."""
        return self._say(_always(Outcome(FOREVER)), times, None)

    def does(self, answer: SkillAnswer, *, times: int | None = None, then: Effect | None = None) -> Self:
        """They end as a function says, which is called when one begins."""
        return self._say(answer, times, then)

    def _say(self, answer: SkillAnswer, times: int | None, then: Effect | None) -> Self:
        if times is not None and times < 1:
            raise ValueError(f"times={times}: at least once")
        self._scripted = True
        self._behaviours.append(_Behaviour(answer, times, then))
        return self

    def matches(self, call: SkillStringCall) -> bool:
        """Whether this is said of the call."""
        return fnmatchcase(call.name, self.name) and all(
            key in call.args and _is_like(call.args[key], wanted) for key, wanted in self.args.items()
        )

    def __str__(self) -> str:
        """Return it as a test wrote it."""
        return f"run.skills({', '.join([repr(self.name), *(f'{k}={v!r}' for k, v in self.args.items())])})"

    def complaint(self, known: Collection[str], calls: Iterable[Call] = ()) -> str:
        """Return the mistake at the end of the run: no call came; empty when there is none.

        :param calls: those of the run.
        :param known: the names of the skills that were called, or that actions are mapped to.
        """
        if self.calls or self._optional:
            return ""
        others = f": skills here are {', '.join(sorted(known))}" if known else ""
        if self.name not in known:
            near = nearest(self.name, known)
            hint = f"; did you mean '{near[0]}'?" if near else others
            is_typo = self._scripted or (known and not _PATTERN.search(self.name))
            return f"{self} has met no call, there is no skill '{self.name}'{hint}" if is_typo else ""
        had = dict.fromkeys(str(call) for call in calls if fnmatchcase(call.name, self.name))
        seen = f", calls were {', '.join(list(had)[:_MOST_SHOWN])}" if had else ""
        return f"{self} has met no call{seen}; say .optional() if it need not" if self._scripted else ""

    @property
    def says_something(self) -> bool:
        """Whether calls can be answered."""
        return bool(self._behaviours)

    def take(self) -> _Behaviour:
        """Return the outcome of the call that begins now."""
        first = self._behaviours[0]
        if first.times is not None:
            first.times -= 1
            if first.times == 0:
                del self._behaviours[0]
        return first


def _always(outcome: Outcome) -> SkillAnswer:
    def answer(call: Call) -> Outcome:  # noqa: ARG001  all calls alike
        return outcome

    return answer


def _is_like(value: object, wanted: object) -> bool:
    if isinstance(wanted, str):
        return fnmatchcase(as_text(value), wanted)
    return value == wanted


class SkillScript:
    """How the skills of a run end.

    :param clock: the run's.
    """

    def __init__(self, clock: Clock) -> None:
        self.calls: list[Call] = []
        self.otherwise = SkillRule("*")
        self._clock = clock
        self._start_us = clock.now_us()
        self._rules: list[SkillRule] = []

    def __call__(self, name: str, **args: object) -> SkillRule:
        """Return the calls of a skill whose arguments have these values, to say something of them."""
        for rule in self._rules:
            if (rule.name, rule.args) == (name, args):
                return rule
        rule = SkillRule(name, dict(args), [call for call in self.calls if self._is_of(call, name, args)])
        self._rules.append(rule)
        return rule

    @staticmethod
    def _is_of(call: Call, name: str, args: dict[str, Any]) -> bool:
        return SkillRule(name, args).matches(SkillStringCall(call.name, call.args))

    def complaints(self, mapped: Collection[str] = ()) -> list[str]:
        """Return the mistakes of the script at the end of the run: entries without a call.

        :param mapped: the names of the skills that actions are mapped to.
        """
        known = {*mapped, *(call.name for call in self.calls)}
        return [text for rule in self._rules if (text := rule.complaint(known, self.calls))]

    def begin(self, skiller: str, call: SkillStringCall) -> Outcome | None:
        """Note that a call begins; return how it ends, None when nothing is said of it."""
        noted = Call(
            (self._clock.now_us() - self._start_us) / MICROSECONDS, call.name, dict(call.args), skiller
        )
        self.calls.append(noted)
        for rule in self._rules:
            if rule.matches(call):
                rule.calls.append(noted)
        for rule in self._candidates(call):
            behaviour = rule.take()
            outcome = behaviour.answer(noted)
            return outcome if behaviour.then is None else replace(outcome or Outcome(), then=behaviour.then)
        return None

    def _candidates(self, call: SkillStringCall) -> Iterator[SkillRule]:
        """Yield the entries for a call, the last entry first."""
        for rule in reversed(self._rules):
            if rule.says_something and rule.matches(call):
                yield rule
        if self.otherwise.says_something:
            yield self.otherwise

    def decider(self, skiller: str) -> ScriptedDecider:
        """Return the decider of a Skiller, or of an agent on the skill board."""
        return ScriptedDecider(self, skiller)


class ScriptedDecider(Decider):
    """Lets the skills of a Skiller, or of an agent on the skill board, end as the script says."""

    priority = sys.maxsize

    def __init__(self, script: SkillScript, skiller: str) -> None:
        self._script = script
        self._skiller = skiller

    def decide(self, call: SkillStringCall) -> Outcome | None:
        """Return the script's outcome of a call that begins; None: no entry."""
        return self._script.begin(self._skiller, call)
