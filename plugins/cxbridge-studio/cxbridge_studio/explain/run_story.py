"""The story of a run in sentences: its goals, the work under way, the failures and their reasons."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

from cxbridge.history.model import GoalRecord
from cxbridge_studio.explain.cause import CERTAIN_ROOT, Cause
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.goal_report import (
    drop_root_marks,
    format_causes,
    make_blocker_headline,
    make_story_writer,
)
from cxbridge_studio.explain.goal_story import NOT_RECORDED

# The limit of sentences in a section. The last sentence of a longer section counts those that are left out.
MAX_SENTENCES: Final = 12

_FAILURE_OUTCOMES: Final = ("FAILED", "REJECTED")


@dataclass(frozen=True, slots=True)
class RunStory:
    """The story of a run up to one moment.

    Each field of causes is a section of sentences.

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
    return _RunStoryWriter(evidence).write_story()


class _RunStoryWriter:
    """Writes the story of one run. A root goal is a goal without a parent."""

    def __init__(self, evidence: Evidence) -> None:
        self._evidence = evidence
        self._goals, self._story_writer = make_story_writer(evidence)
        self._root_goals = [goal for goal in self._goals.all if self._goals.parent(goal) is None]

    def write_story(self) -> RunStory:
        root_goals = self._root_goals
        failed_goals = [
            goal for goal in root_goals if goal.end_change is not None and goal.outcome in _FAILURE_OUTCOMES
        ]
        open_goals = [goal for goal in root_goals if self._story_writer.is_waiting(goal)]
        work = list(self._describe_work())
        # A waiting goal is a problem only if no skill and no planner works.
        troubled_goals = failed_goals + ([] if work else open_goals)
        # Failed goals come first, then the waiting goals, the most certain blocker first.
        stories = sorted(
            (self._story_writer.write_goal_story(goal) for goal in troubled_goals[:MAX_SENTENCES]),
            key=lambda story: -story.cause.certainty if story.waits else -CERTAIN_ROOT - 1,
        )
        overcome_goals = self._find_overcome_failures(failed_goals)
        # The reason why the run ended comes first, and does not count as a goal.
        ending = [Cause(self._evidence.ending)] if self._evidence.ending else []
        return RunStory(
            make_blocker_headline(stories[0])
            if stories
            else self._make_untroubled_headline(open_goals, work),
            self._evidence.where,
            _limit_sentences(
                [Cause(self._summarize_goal(goal)) for goal in root_goals[:MAX_SENTENCES]], len(root_goals)
            ),
            _limit_sentences(work, len(work)),
            _limit_sentences(
                [*ending, *(_drop_missing_firings(story.cause) for story in stories)], len(troubled_goals)
            ),
            _limit_sentences(
                [
                    _drop_missing_firings(self._story_writer.find_outcome_cause(goal))
                    for goal in overcome_goals[:MAX_SENTENCES]
                ],
                len(overcome_goals),
            ),
            tuple(self._describe_missing_data()),
            tuple(self._evidence.notes),
        )

    def _make_untroubled_headline(self, open_goals: Sequence[GoalRecord], work: Sequence[Cause]) -> str:
        """Return the headline of a run without a failed goal, and without a goal that waits for no work."""
        if open_goals:
            further_count = len(open_goals) - 1
            goals = (
                f" and {further_count} more goal{'s' if further_count > 1 else ''} are"
                if further_count
                else " is"
            )
            return f"{open_goals[0].title}{goals} under way: {work[0].text}"
        if not self._root_goals:
            return (
                "no goal has been formulated"
                if self._evidence.has_executive
                else "nothing is known about goals: the recording has no events of an executive"
            )
        if len(self._root_goals) == 1:
            return self._story_writer.find_outcome_cause(self._root_goals[0]).text
        return f"all {len(self._root_goals)} goals without a parent are over, and none of them has failed"

    def _summarize_goal(self, goal: GoalRecord) -> str:
        """Return a goal, the number of its sub-goals, and its outcome."""
        count = self._goals.count_sub_goals(goal)
        sub_goals = f", with {count} sub-goal{'s' if count > 1 else ''}" if count else ""
        outcome = "" if goal.end_change is None else f": {goal.outcome}"
        return f"{goal.title}{sub_goals}{outcome}"

    def _describe_work(self) -> Iterator[Cause]:
        """Yield a sentence about each running skill and planner call."""
        for call, action in self._goals.find_open_skill_calls():
            begin_seq, _ = call.begin
            begin_s = self._evidence.compute_seconds(self._goals.time_us(begin_seq))
            purpose = f" for action {action.id} {action.name} of {action.goal}" if action is not None else ""
            yield Cause(f"{call.skiller} executes {call.skill_string}{purpose}, begun at {begin_s:.3f} s")
        for planner_call in self._goals.find_open_planner_calls():
            begin_seq, _ = planner_call.begin
            begin_s = self._evidence.compute_seconds(self._goals.time_us(begin_seq))
            yield Cause(
                f"planner {planner_call.name} looks for a plan for {planner_call.goal}, "
                f"begun at {begin_s:.3f} s"
            )

    def _find_overcome_failures(self, failed_goals: Sequence[GoalRecord]) -> list[GoalRecord]:
        """Return the topmost failed goals in each tree whose root has not failed."""
        failed_numbers = {goal.number for goal in failed_goals}
        overcome_goals: list[GoalRecord] = []
        # A stack instead of recursion: goals may be nested deeper than Python's stack.
        pending_goals = [goal for goal in reversed(self._root_goals) if goal.number not in failed_numbers]
        while pending_goals:
            goal = pending_goals.pop()
            if self._goals.parent(goal) is not None and _has_failed(goal):
                overcome_goals.append(goal)
            else:
                pending_goals += reversed(self._goals.children(goal))
        return overcome_goals

    def _describe_missing_data(self) -> Iterator[str]:
        """Yield a sentence about each kind of missing data, with the option that records it."""
        assert self._evidence.history is not None
        if not self._evidence.has_executive:
            yield "goals and rules: record a run or a daemon with --trace; 'trace record' records interfaces"
            return
        if not self._goals.all:
            yield "no transition of a goal is known before this moment"
        if not self._evidence.history.rules_known:
            yield "the rules that decided are unknown: record with --trace-level rules"
        if not self._evidence.has_facts("goal"):
            yield "facts, and why rules did not fire, are unknown: record with --trace-level facts"


def _has_failed(goal: GoalRecord) -> bool:
    """Return whether a goal has failed, now or before it was formulated again."""
    return bool(goal.former_end_changes) or (
        goal.end_change is not None and goal.outcome in _FAILURE_OUTCOMES
    )


def _drop_missing_firings(cause: Cause) -> Cause:
    """Return a cause without the inner causes :data:`NOT_RECORDED`: the story says this once."""
    inner = tuple(
        _drop_missing_firings(inner_cause)
        for inner_cause in cause.because
        if inner_cause.text != NOT_RECORDED
    )
    return replace(cause, because=inner)


def _limit_sentences(sentences: Sequence[Cause], total: int) -> tuple[Cause, ...]:
    """Return the first sentences of a section, and a sentence with the number of the further sentences.

    :param total: the number of all sentences; ``sentences`` may lack those beyond the limit.
    """
    if total <= MAX_SENTENCES:
        return tuple(sentences)
    return (*sentences[: MAX_SENTENCES - 1], Cause(f"and {total - MAX_SENTENCES + 1} more"))


def to_json(story: RunStory) -> dict[str, Any]:
    """Return a story as JSON values."""
    values: dict[str, Any] = drop_root_marks(asdict(story))
    return values


def format_report(story: RunStory) -> Iterator[str]:
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
            yield from format_causes(sentence.because, "  ")
    if story.unknown:
        yield ""
        yield "Not known"
        yield from (f"  {text}" for text in story.unknown)
    yield from (f"note: {note}" for note in story.notes)
