"""The story of a run in sentences: its goals, the work under way, the failures and their reasons."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

from cxbridge.history.model import GoalRecord
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.goal_report import cause_lines, goal_headline, reporter_of, without_roots
from cxbridge_studio.explain.goal_story import NOT_RECORDED, Cause

# The limit of sentences in a section. The last sentence of a longer section counts those that are left out.
MAX_SENTENCES: Final = 12

_FAILURES: Final = ("FAILED", "REJECTED")


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


# The fields of a story with sentences, and their headings in the text.
SECTIONS: Final = {
    "wanted": "Wanted",
    "now": "Now",
    "wrong": "Went wrong",
    "overcome": "Failed on the way",
}


def tell_run(evidence: Evidence) -> RunStory:
    """Return the story of a run.

    :raises CxbridgeError: if the source has no goals.
    """
    return _StoryWriter(evidence).story()


class _StoryWriter:
    def __init__(self, evidence: Evidence) -> None:
        self._evidence = evidence
        self._goals, self._reporter = reporter_of(evidence)
        self._root_goals = [goal for goal in self._goals.all if self._goals.parent(goal) is None]

    def story(self) -> RunStory:
        root_goals = self._root_goals
        failed = [goal for goal in root_goals if goal.end_change is not None and goal.outcome in _FAILURES]
        open_goals = [goal for goal in root_goals if self._reporter.waits(goal)]
        work = list(self._work_under_way())
        # A goal that waits is a problem only while nothing works for it.
        troubled = failed + ([] if work else open_goals)
        stories = [self._reporter.report(goal) for goal in troubled[:MAX_SENTENCES]]
        overcome = self._overcome_failures(failed)
        ending = [Cause(self._evidence.ending)] if self._evidence.ending else []
        return RunStory(
            goal_headline(stories[0]) if stories else self._untroubled_headline(open_goals, work),
            self._evidence.where,
            _limited([Cause(self._summary(goal)) for goal in root_goals[:MAX_SENTENCES]], len(root_goals)),
            _limited(work, len(work)),
            _limited([*ending, *(_without_missing_firings(story.cause) for story in stories)], len(troubled)),
            _limited(
                [_without_missing_firings(self._reporter.outcome(goal)) for goal in overcome[:MAX_SENTENCES]],
                len(overcome),
            ),
            tuple(self._missing_data()),
            tuple(self._evidence.notes),
        )

    def _untroubled_headline(self, open_goals: Sequence[GoalRecord], work: Sequence[Cause]) -> str:
        """Return the first sentence of a run in which no root goal has failed or waits."""
        if open_goals:
            further_count = len(open_goals) - 1
            goals = (
                f" and {further_count} more goal{'s' if further_count > 1 else ''} are"
                if further_count
                else " is"
            )
            return f"{open_goals[0].title}{goals} under way: {work[0].text}"
        if not self._root_goals:
            return "no goal has been formulated"
        if len(self._root_goals) == 1:
            return self._reporter.outcome(self._root_goals[0]).text
        return f"all {len(self._root_goals)} goals without a parent are over, and none of them has failed"

    def _summary(self, goal: GoalRecord) -> str:
        count = self._goals.count_below(goal)
        sub_goals = f", with {count} sub-goal{'s' if count > 1 else ''}" if count else ""
        outcome = "" if goal.end_change is None else f": {goal.outcome}"
        return f"{goal.title}{sub_goals}{outcome}"

    def _work_under_way(self) -> Iterator[Cause]:
        """Yield the running skills and planner calls."""
        for call, action in self._goals.open_calls():
            begin_seq, _ = call.begin
            begin_s = self._evidence.seconds(self._goals.time_us(begin_seq))
            purpose = f" for action {action.id} {action.name} of {action.goal}" if action is not None else ""
            yield Cause(f"{call.skiller} executes {call.skill_string}{purpose}, begun at {begin_s:.3f} s")
        for planner in self._goals.open_plannings():
            begin_seq, _ = planner.begin
            begin_s = self._evidence.seconds(self._goals.time_us(begin_seq))
            yield Cause(
                f"planner {planner.name} looks for a plan for {planner.goal}, begun at {begin_s:.3f} s"
            )

    def _overcome_failures(self, failed: Sequence[GoalRecord]) -> list[GoalRecord]:
        """Return the topmost failed goals of each tree whose root has not failed."""
        failed_numbers = {goal.number for goal in failed}
        overcome: list[GoalRecord] = []
        # A stack instead of recursion: goals may be nested deeper than Python's stack.
        pending = [goal for goal in reversed(self._root_goals) if goal.number not in failed_numbers]
        while pending:
            goal = pending.pop()
            if self._goals.parent(goal) is not None and _has_failed(goal):
                overcome.append(goal)
            else:
                pending += reversed(self._goals.children(goal))
        return overcome

    def _missing_data(self) -> Iterator[str]:
        """Yield the missing data, with the option that records it."""
        assert self._evidence.history is not None
        if not self._goals.all:
            yield "no transition of a goal is known up to here"
        if not self._evidence.history.rules_known:
            yield "which rules decided is not known: record with --trace-level rules"
        if not self._evidence.has_facts_of("goal"):
            yield "facts, and why rules did not fire, are not known: record with --trace-level facts"


def _has_failed(goal: GoalRecord) -> bool:
    """Whether a goal has failed, now or before it was formulated again."""
    return bool(goal.former_ends) or (goal.end_change is not None and goal.outcome in _FAILURES)


def _without_missing_firings(cause: Cause) -> Cause:
    """Return a cause without inner causes that say only that firings are missing: the story says so once."""
    inner = tuple(
        _without_missing_firings(inner_cause)
        for inner_cause in cause.because
        if inner_cause.text != NOT_RECORDED
    )
    return replace(cause, because=inner)


def _limited(sentences: Sequence[Cause], total: int) -> tuple[Cause, ...]:
    """Return the first sentences of a section, and a sentence with the number of further ones."""
    if total <= MAX_SENTENCES:
        return tuple(sentences)
    return (*sentences[: MAX_SENTENCES - 1], Cause(f"and {total - MAX_SENTENCES + 1} more"))


def plain(story: RunStory) -> dict[str, Any]:
    """Return a story as JSON values."""
    values: dict[str, Any] = without_roots(asdict(story))
    return values


def lines(story: RunStory) -> Iterator[str]:
    """Yield the text of a story."""
    yield story.headline
    yield f"in {story.where}"
    for field, heading in SECTIONS.items():
        sentences: tuple[Cause, ...] = getattr(story, field)
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
    yield from (f"note: {note}" for note in story.notes)
