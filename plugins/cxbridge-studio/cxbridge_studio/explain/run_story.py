"""The story of a run in sentences: its goals, the work under way, the failures and their reasons."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from typing import Any, Final

from cxbridge.history.model import GoalRecord, PlannerExecution, SkillExecution
from cxbridge.printing import format_count
from cxbridge_studio.explain.cause import CERTAIN_ROOT, Cause
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.explanation import Explanation
from cxbridge_studio.explain.goal_report import drop_root_marks, format_causes, make_blocker_headline
from cxbridge_studio.explain.goal_story import NOT_RECORDED, GoalStoryWriter

# The limit of sentences in a section. The last sentence of a longer section counts those that are left out.
MAX_SENTENCES: Final = 12

_FAILURE_OUTCOMES: Final = ("FAILED", "REJECTED")


# The sections of sentences in a story, by their keys in the JSON values, with their headings in the text.
SECTIONS: Final = {
    "wanted": "Wanted",  # the goals without a parent
    "now": "Now",  # the skills and planners that are under way
    "wrong": "Went wrong",  # the failures and waits, each with its reasons
    "overcome": "Failed on the way",  # failures below a goal that has completed, or may still complete
}


def explain_run(evidence: Evidence) -> Explanation:
    """Explain a run up to one moment: its outcome, the work under way, or the reason of its wait."""
    writer = _RunStoryWriter(evidence)
    headline, sections = writer.write_story()
    missing_data = list(writer.describe_missing_data())
    lines = [headline, f"in {evidence.where}"]
    for key, heading in SECTIONS.items():
        lines += ["", heading] if sections[key] else []
        for sentence in sections[key]:
            lines += [f"  {sentence.text}", *format_causes(sentence.because, "  ")]
    if missing_data:
        lines += ["", "Not known", *(f"  {text}" for text in missing_data)]
    json_report: dict[str, Any] = {"headline": headline, "where": evidence.where}
    json_report |= {
        key: [drop_root_marks(asdict(cause)) for cause in causes] for key, causes in sections.items()
    }
    return Explanation(tuple(lines), json_report | {"unknown": missing_data, "notes": evidence.notes})


class _RunStoryWriter:
    """Writes the story of one run. A root goal is a goal without a parent."""

    def __init__(self, evidence: Evidence) -> None:
        self._evidence = evidence
        self._story_writer = GoalStoryWriter(evidence)
        self._goals = self._story_writer.goals
        self._root_goals = [goal for goal in self._goals.records if self._goals.parent(goal) is None]

    def write_story(self) -> tuple[str, dict[str, tuple[Cause, ...]]]:
        """Return the headline, and the sentences of each section by its key in :data:`SECTIONS`."""
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
        headline = (
            make_blocker_headline(stories[0]) if stories else self._make_untroubled_headline(open_goals, work)
        )
        overcome_goals = self._find_overcome_failures(failed_goals)
        # The reason why the run ended comes first.
        ending = [Cause(self._evidence.ending)] if self._evidence.ending else []
        return headline, {
            "wanted": _limit_sentences(
                [Cause(self._summarize_goal(goal)) for goal in root_goals[:MAX_SENTENCES]], len(root_goals)
            ),
            "now": _limit_sentences(work, len(work)),
            "wrong": _limit_sentences(
                [*ending, *(_drop_missing_firings(story.cause) for story in stories)],
                len(ending) + len(troubled_goals),
            ),
            "overcome": _limit_sentences(
                [
                    _drop_missing_firings(self._story_writer.find_outcome_cause(goal))
                    for goal in overcome_goals[:MAX_SENTENCES]
                ],
                len(overcome_goals),
            ),
        }

    def _make_untroubled_headline(self, open_goals: Sequence[GoalRecord], work: Sequence[Cause]) -> str:
        """Return the headline of a run in which no root goal has failed, and work continues if any is open.

        :param work: the sentences about the work.
        """
        if open_goals:
            further_count = len(open_goals) - 1
            further_goals = f" and {further_count} more {'goals' if further_count > 1 else 'goal'} are"
            subject = open_goals[0].title + (further_goals if further_count else " is")
            return f"{subject} under way: {work[0].text}"
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
        sub_goals = f", with {format_count(count, 'sub-goal')}" if count else ""
        outcome = "" if goal.end_change is None else f": {goal.outcome}"
        return f"{goal.title}{sub_goals}{outcome}"

    def _describe_work(self) -> Iterator[Cause]:
        """Yield a sentence about each running skill and planner call."""
        for call, action in self._goals.find_open_skill_calls():
            purpose = f" for action {action.id} {action.name} of {action.goal}" if action is not None else ""
            yield self._describe_begun(call, f"{call.skiller} executes {call.skill_string}{purpose}")
        for planner_call in self._goals.find_open_planner_calls():
            yield self._describe_begun(
                planner_call, f"planner {planner_call.name} looks for a plan for {planner_call.goal}"
            )

    def _describe_begun(self, call: SkillExecution | PlannerExecution, text: str) -> Cause:
        """Return a sentence about a running call, with the time of its begin."""
        return Cause(f"{text}, begun at {self._story_writer.format_time(call.begin.seq)}")

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

    def describe_missing_data(self) -> Iterator[str]:
        """Yield a sentence about each kind of missing data, with the option that records it, if any."""
        if not self._evidence.has_executive:
            yield "goals and rules: record a run or a daemon with --trace; 'trace record' records interfaces"
            return
        if not self._goals.records:
            yield "no transition of a goal is known before this moment"
        if not self._evidence.history.has_firings:
            yield "the rules that decided are unknown: record with --trace-level rules"
        if not self._evidence.has_facts("goal"):
            yield "facts, and why rules did not fire, are unknown: record with --trace-level facts"


def _has_failed(goal: GoalRecord) -> bool:
    """Return whether a goal has failed, now or before it was formulated again."""
    return any(change.outcome in _FAILURE_OUTCOMES for change in goal.former_end_changes) or (
        goal.end_change is not None and goal.outcome in _FAILURE_OUTCOMES
    )


def _drop_missing_firings(cause: Cause) -> Cause:
    """Return a cause without the inner causes :data:`NOT_RECORDED`: the story says this once."""
    return replace(
        cause,
        because=tuple(
            _drop_missing_firings(inner_cause)
            for inner_cause in cause.because
            if inner_cause.text != NOT_RECORDED
        ),
    )


def _limit_sentences(sentences: Sequence[Cause], total: int) -> tuple[Cause, ...]:
    """Return the first sentences of a section, and a sentence with the number of the further sentences.

    :param total: the number of all sentences; ``sentences`` may lack those beyond the limit.
    """
    if total <= MAX_SENTENCES:
        return tuple(sentences)
    return (*sentences[: MAX_SENTENCES - 1], Cause(f"and {total - MAX_SENTENCES + 1} more"))
