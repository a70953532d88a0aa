"""Explanations of goals, as text and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from cxbridge.errors import CxbridgeError
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.goal_story import FACT_TEMPLATES, ActionStory, Cause, GoalReporter, GoalStory
from cxbridge_studio.explain.goals import Goals

_WIDEST = 90
_COMPLETED = "COMPLETED"
_WAITS = ", and waits"
_MOST_STEPS = 3  # number of causes in the first line, the last of the chain


def explain_goals(evidence: Evidence, name: str) -> tuple[GoalStory, ...]:
    """Return the stories of the goals with a name.

    :raises CxbridgeError: if there is no such goal, or the source has no goals.
    """
    goals, reporter = reporter_of(evidence)
    return tuple(reporter.report(goal) for goal in goals.find(name, now=evidence.is_moment))


def explain_actions(evidence: Evidence, name: str) -> tuple[ActionStory, ...]:
    """Report the plan-actions that a name stands for: ``GOAL/ID``.

    :raises CxbridgeError: when there is none, or the source knows no goals.
    """
    goals, reporter = reporter_of(evidence)
    return tuple(reporter.report_action(*goal_and_action) for goal_and_action in goals.actions_named(name))


def reporter_of(evidence: Evidence) -> tuple[Goals, GoalReporter]:
    """Return the goals of a run, and what reports them.

    :raises CxbridgeError: when the source knows no goals.
    """
    if evidence.history is None:
        raise CxbridgeError("goals are not known here")
    facts = {template: evidence.slots_of(template) for template in FACT_TEMPLATES}
    goals = Goals(evidence.history)
    return goals, GoalReporter(evidence, goals, facts)


def plain_actions(stories: Sequence[ActionStory], evidence: Evidence) -> dict[str, Any]:
    """Return the stories of plan-actions as values that JSON knows."""
    return {
        "headline": cause_headline(stories[-1].cause),
        "where": evidence.where,
        "actions": [without_roots(asdict(story)) for story in stories],
        "notes": evidence.notes,
    }


def action_lines(stories: Sequence[ActionStory], evidence: Evidence) -> Iterator[str]:
    """Yield the report of plan-actions for people."""
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
    """Return the answer in one line: the state of the goal and the root cause."""
    if len(stories) == 1:
        return goal_headline(stories[0])
    count = f"{len(stories)} goals of class {stories[0].goal_class} in {evidence.where}"
    bad = next((story for story in stories if story.waits or story.outcome != _COMPLETED), None)
    return count if bad is None else f"{count}; {story_name(bad)}: {goal_headline(bad)}"


def story_name(story: GoalStory) -> str:
    """Return the class of a goal and its number within the class."""
    return f"{story.goal_class}#{story.number}"


def goal_headline(story: GoalStory) -> str:
    """Return in one line how it stands with a goal, and the true cause."""
    if story.outcome == _COMPLETED and not story.waits:
        return story.cause.text
    return cause_headline(story.cause)


def cause_headline(top: Cause) -> str:
    """Return a cause in one line, with the causes that lead to its root."""
    path = _to_root(top) or _first(top)
    return ": ".join([top.text.partition(_WAITS)[0] if path else top.text, *path[-_MOST_STEPS:]])


def _to_root(cause: Cause) -> list[str]:
    """Return the causes up to the first root cause; empty if there is none."""
    for inner in cause.because:
        rest = _to_root(inner)
        if rest or inner.root:
            return [inner.text, *rest]
    return []


def _first(cause: Cause) -> list[str]:
    return [cause.because[0].text, *_first(cause.because[0])] if cause.because else []


def lines(stories: Sequence[GoalStory], evidence: Evidence, rules: int = 1) -> Iterator[str]:
    """Yield the text of the report.

    :param rules: the number of rules to show before each step.
    """
    yield headline(stories, evidence)
    yield ""
    if len(stories) > 1:
        for story in stories:
            yield f"{story_name(story)}  {story.cause.text}"
        return
    for story in stories:
        yield from _story(story, evidence, rules)
    for note in evidence.notes:
        yield f"note: {note}"


def _story(story: GoalStory, evidence: Evidence, rules: int) -> Iterator[str]:
    kind = f", {story.sub_type}" if story.sub_type else ""
    parent = f", sub-goal of {story.parent}" if story.parent else ""
    yield f"goal {story.goal} ({story.goal_class}#{story.number}{kind}){parent}"
    yield f"in {evidence.where}"
    yield ""
    yield f"{story.cause.text}"
    yield from cause_lines(story.cause.because, "")
    yield ""
    width = min(_WIDEST, max((len(moment.text) for moment in story.moments), default=0))
    for moment in story.moments:
        fired = ", ".join(moment.rules[-rules:]) if rules else ""
        text = f"{moment.seconds:9.3f}  {moment.text}"
        yield f"{text.ljust(width + 11)}  {fired}".rstrip()


def cause_lines(causes: tuple[Cause, ...], stem: str) -> Iterator[str]:
    """Yield causes as a tree.

    :param stem: the beginning of each line.
    """
    for cause in causes:
        last = cause is causes[-1]
        yield f"{stem}{'└─ ' if last else '├─ '}{cause.text}"
        yield from cause_lines(cause.because, stem + ("   " if last else "│  "))
