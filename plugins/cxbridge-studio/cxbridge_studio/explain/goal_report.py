"""Reports about goals and plan-actions, as text and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from cxbridge.errors import CxbridgeError
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.goal_story import FACT_TEMPLATES, ActionStory, Cause, GoalReporter, GoalStory
from cxbridge_studio.explain.goals import Goals

_MAX_WIDTH = 90  # the columns of an event's text: the rules to its right stay on a usual screen
_TIME_WIDTH = 11  # the columns before an event's text: the time with 9 digits, and 2 blanks
_COMPLETED = "COMPLETED"
_WAITS = (
    ", and waits"  # from here on, a cause names only the kind of the missing rule: the root cause says more
)
_MAX_STEPS = 3  # the number of causes in the first line, counted from the root cause


def explain_goals(evidence: Evidence, name: str) -> tuple[GoalStory, ...]:
    """Return the stories of the goals with a name.

    :raises CxbridgeError: if there is no such goal, or the source has no goals.
    """
    goals, reporter = reporter_of(evidence)
    return tuple(reporter.report(goal) for goal in goals.find(name, now=evidence.is_moment))


def explain_actions(evidence: Evidence, name: str) -> tuple[ActionStory, ...]:
    """Return the stories of the plan-actions with a name: ``GOAL/ID``, or ``GOAL/ACTION``.

    :raises CxbridgeError: if there is no such plan-action, or the source has no goals.
    """
    goals, reporter = reporter_of(evidence)
    return tuple(reporter.report_action(*goal_and_action) for goal_and_action in goals.actions_named(name))


def reporter_of(evidence: Evidence) -> tuple[Goals, GoalReporter]:
    """Return the goals of a run, and the reporter for them.

    :raises CxbridgeError: if the source has no goals.
    """
    if evidence.history is None:
        raise CxbridgeError("goals are not known here")
    facts = {template: evidence.slots_of(template) for template in FACT_TEMPLATES}
    goals = Goals(evidence.history)
    return goals, GoalReporter(evidence, goals, facts)


def plain_actions(stories: Sequence[ActionStory], evidence: Evidence) -> dict[str, Any]:
    """Return the stories of plan-actions as JSON values."""
    return {
        # An id may be used again, so several plan-actions may have the name: the latest is the headline.
        "headline": cause_headline(stories[-1].cause),
        "where": evidence.where,
        "actions": [without_roots(asdict(story)) for story in stories],
        "notes": evidence.notes,
    }


def action_lines(stories: Sequence[ActionStory], evidence: Evidence) -> Iterator[str]:
    """Yield the text of the report about plan-actions."""
    yield cause_headline(stories[-1].cause)
    yield f"in {evidence.where}"
    for story in stories:
        yield ""
        yield f"action {story.action} of {story.goal}"
        yield story.cause.text
        yield from cause_lines(story.cause.because, "")
        yield from (f"{moment.seconds:9.3f}  {moment.text}" for moment in story.moments)


def plain(stories: Sequence[GoalStory], evidence: Evidence) -> dict[str, Any]:
    return {
        "headline": headline(stories, evidence),
        "where": evidence.where,
        "goals": [without_roots(asdict(story)) for story in stories],
        "notes": evidence.notes,
    }


def without_roots(value: Any) -> Any:
    """Return a JSON value without the key ``root``."""
    if isinstance(value, dict):
        return {name: without_roots(inner) for name, inner in value.items() if name != "root"}
    return [without_roots(inner) for inner in value] if isinstance(value, list | tuple) else value


def headline(stories: Sequence[GoalStory], evidence: Evidence) -> str:
    """Return the report in one line: the state of the goal and the root cause."""
    if len(stories) == 1:
        return goal_headline(stories[0])
    summary = f"{len(stories)} goals of class {stories[0].goal_class} in {evidence.where}"
    troubled = next((story for story in stories if story.waits or story.outcome != _COMPLETED), None)
    return summary if troubled is None else f"{summary}; {troubled.label}: {goal_headline(troubled)}"


def goal_headline(story: GoalStory) -> str:
    """Return the state of a goal and the root cause in one line."""
    if story.outcome == _COMPLETED and not story.waits:
        return story.cause.text
    return cause_headline(story.cause)


def cause_headline(top: Cause) -> str:
    """Return a cause in one line, with the causes that lead to its root."""
    path = _path_to_root(top) or _path_of_first(top)
    return ": ".join([top.text.partition(_WAITS)[0] if path else top.text, *path[-_MAX_STEPS:]])


def _path_to_root(cause: Cause) -> list[str]:
    """Return the texts of the causes up to the first root cause; empty if there is no root cause."""
    for inner in cause.because:
        below = _path_to_root(inner)
        if below or inner.root:
            return [inner.text, *below]
    return []


def _path_of_first(cause: Cause) -> list[str]:
    """Return the texts of the first cause of each level."""
    return [cause.because[0].text, *_path_of_first(cause.because[0])] if cause.because else []


def lines(stories: Sequence[GoalStory], evidence: Evidence, rules: int = 1) -> Iterator[str]:
    """Yield the text of the report.

    :param rules: the number of rules to show before each step.
    """
    yield headline(stories, evidence)
    yield ""
    if len(stories) > 1:
        yield from (f"{story.label}  {story.cause.text}" for story in stories)
        return
    yield from _story_lines(stories[0], evidence, rules)
    yield from (f"note: {note}" for note in evidence.notes)


def _story_lines(story: GoalStory, evidence: Evidence, rules: int) -> Iterator[str]:
    kind = f", {story.sub_type}" if story.sub_type else ""
    parent = f", sub-goal of {story.parent}" if story.parent else ""
    yield f"goal {story.goal} ({story.label}{kind}){parent}"
    yield f"in {evidence.where}"
    yield ""
    yield story.cause.text
    yield from cause_lines(story.cause.because, "")
    yield ""
    width = min(_MAX_WIDTH, max((len(moment.text) for moment in story.moments), default=0))
    for moment in story.moments:
        fired = ", ".join(moment.rules[-rules:]) if rules else ""
        text = f"{moment.seconds:9.3f}  {moment.text}"
        yield f"{text.ljust(width + _TIME_WIDTH)}  {fired}".rstrip()


def cause_lines(causes: tuple[Cause, ...], stem: str) -> Iterator[str]:
    """Yield causes as a tree.

    :param stem: the beginning of each line.
    """
    for cause in causes:
        is_last = cause is causes[-1]
        yield f"{stem}{'└─ ' if is_last else '├─ '}{cause.text}"
        yield from cause_lines(cause.because, stem + ("   " if is_last else "│  "))
