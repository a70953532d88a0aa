"""The story of a run in sentences: its goals, the work under way, the failures and their reasons."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

from cxbridge.history.model import GoalRecord
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.goal_report import cause_lines, goal_headline, reporter_of, without_roots
from cxbridge_studio.explain.goal_story import NOT_RECORDED, Cause

# Sentences of a part; the last one says how many are left out.
MOST_SENTENCES: Final = 12

_BAD: Final = ("FAILED", "REJECTED")


@dataclass(frozen=True, slots=True)
class RunStory:
    """The story of a run up to a moment.

    :param headline: the outcome and its reason, the work under way, or the reason of the wait.
    :param wanted: the goals without a parent.
    :param now: the skills and actions that are under way.
    :param wrong: the failures and waits, each with its reasons.
    :param overcome: failures below a goal that has completed, or may still complete.
    :param unknown: the missing data, each with the option that records it.
    """

    headline: str
    where: str
    wanted: tuple[Cause, ...]
    now: tuple[Cause, ...]
    wrong: tuple[Cause, ...]
    overcome: tuple[Cause, ...]
    unknown: tuple[str, ...]
    notes: tuple[str, ...]


# The parts of a story with sentences, and their headings.
PARTS: Final = {
    "wanted": "Wanted",
    "now": "Now",
    "wrong": "Went wrong",
    "overcome": "Failed on the way",
}


def tell_run(evidence: Evidence) -> RunStory:
    """Tell the story of a run.

    :raises CxbridgeError: when the source knows no goals.
    """
    return _Teller(evidence).story()


class _Teller:
    """Finds the sentences of a story."""

    def __init__(self, evidence: Evidence) -> None:
        self._evidence = evidence
        self._goals, self._reporter = reporter_of(evidence)
        self._roots = [goal for goal in self._goals.all if self._goals.parent(goal) is None]

    def story(self) -> RunStory:
        failed = [goal for goal in self._roots if goal.ended is not None and goal.outcome in _BAD]
        open_roots = [goal for goal in self._roots if self._reporter.waits(goal)]
        now = list(self._now())
        wrong = failed + ([] if now else open_roots)
        chosen = wrong[:MOST_SENTENCES]
        stories = [self._reporter.report(goal) for goal in chosen]
        overcome = self._overcome(failed)
        return RunStory(
            goal_headline(stories[0]) if stories else self._good_headline(open_roots, now),
            self._evidence.where,
            _at_most([Cause(self._wanted(goal)) for goal in self._roots[: MOST_SENTENCES + 1]], self._roots),
            _at_most(now, now),
            _at_most([*self._ending(), *(_known(story.cause) for story in stories)], wrong),
            _at_most([_known(self._reporter.outcome(goal)) for goal in overcome[:MOST_SENTENCES]], overcome),
            tuple(self._unknown()),
            tuple(self._evidence.notes),
        )

    def _good_headline(self, open_roots: Sequence[GoalRecord], now: Sequence[Cause]) -> str:
        """Return the first sentence of a run in which no goal without a parent has failed or waits."""
        if open_roots:
            further_goals = f", and {len(open_roots) - 1} more goals" if len(open_roots) > 1 else ""
            return f"{open_roots[0].title}{further_goals} is under way: {now[0].text}"
        if not self._roots:
            return "no goal has been formulated"
        if len(self._roots) == 1:
            return self._reporter.outcome(self._roots[0]).text
        return f"all {len(self._roots)} goals without a parent are over, and none of them has failed"

    def _ending(self) -> Iterator[Cause]:
        """Yield how the run ended, if it did not end by its goals."""
        if self._evidence.ending:
            yield Cause(self._evidence.ending)

    def _wanted(self, goal: GoalRecord) -> str:
        below = self._below(goal)
        count = f", with {below} sub-goal{'s' if below > 1 else ''}" if below else ""
        outcome = "" if goal.ended is None else f": {goal.outcome}"
        return f"{goal.title}{count}{outcome}"

    def _below(self, goal: GoalRecord) -> int:
        return sum(1 + self._below(child) for child in self._goals.children(goal))

    def _now(self) -> Iterator[Cause]:
        """Yield the skills and planner calls under way."""
        for call, action in self._goals.open_calls():
            begin = self._evidence.seconds(self._goals.time_us(call.begin[0]))
            of = f" for action {action.id} {action.name} of {action.goal}" if action is not None else ""
            yield Cause(f"{call.skiller} executes {call.skill_string}{of} since {begin:.3f} s")
        for planner in self._goals.open_plannings():
            begin = self._evidence.seconds(self._goals.time_us(planner.begin[0]))
            yield Cause(f"planner {planner.name} looks for a plan for {planner.goal} since {begin:.3f} s")

    def _overcome(self, failed: Sequence[GoalRecord]) -> list[GoalRecord]:
        """Return the goals that failed although no goal above them has failed."""
        ended_badly = {goal.number for goal in failed}
        overcome_goals: list[GoalRecord] = []
        for root in self._roots:
            if root.number not in ended_badly:
                overcome_goals += self._first_failures(root)
        return overcome_goals

    def _first_failures(self, goal: GoalRecord) -> Iterator[GoalRecord]:
        for child in self._goals.children(goal):
            if child.former_ends or (child.ended is not None and child.outcome in _BAD):
                yield child
            else:
                yield from self._first_failures(child)

    def _unknown(self) -> Iterator[str]:
        """Yield the missing data, with the option that records it."""
        assert self._evidence.history is not None
        if not self._goals.all:
            yield "no transition of a goal is known up to here"
        if not self._evidence.history.rules_known:
            yield "which rules decided is not known: record with --trace-level rules"
        if not self._evidence.has_facts_of("goal"):
            yield "facts, and why rules did not fire, are not known: record with --trace-level facts"


def _known(cause: Cause) -> Cause:
    """Return a cause without those that say only that firings are missing: the story says that once."""
    inner = tuple(_known(each) for each in cause.because if each.text != NOT_RECORDED)
    return replace(cause, because=inner)


def _at_most(sentences: Sequence[Cause], all_of_them: Sequence[object]) -> tuple[Cause, ...]:
    """Return the first sentences of a part, and a sentence about the number of further ones."""
    if len(all_of_them) <= MOST_SENTENCES:
        return tuple(sentences)
    left = len(all_of_them) - MOST_SENTENCES + 1
    return (*sentences[: MOST_SENTENCES - 1], Cause(f"and {left} more"))


def plain(story: RunStory) -> dict[str, Any]:
    """Return a story as values that JSON knows."""
    values: dict[str, Any] = without_roots(asdict(story))
    return values


def lines(story: RunStory) -> Iterator[str]:
    """Yield a story for people."""
    yield story.headline
    yield f"in {story.where}"
    for part, heading in PARTS.items():
        sentences: tuple[Cause, ...] = getattr(story, part)
        if sentences:
            yield ""
            yield heading
        for sentence in sentences:
            yield f"  {sentence.text}"
            yield from cause_lines(sentence.because, "  ")
    if story.unknown:
        yield ""
        yield "Not known"
        yield from (f"  {text}" for text in story.unknown)
    for note in story.notes:
        yield f"note: {note}"
