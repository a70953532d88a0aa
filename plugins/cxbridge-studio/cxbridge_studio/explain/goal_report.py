"""Reports about goals and plan-actions, as text and as JSON values."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from itertools import takewhile
from typing import Any, Final

from cxbridge.printing import format_count
from cxbridge_studio.explain.cause import Cause
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.explanation import Explanation
from cxbridge_studio.explain.goal_story import RULES_THAT_COULD, GoalStory, GoalStoryWriter

_MAX_WIDTH: Final = 90  # limit of an event's text in columns, so that the rules to its right stay on a screen
_TIME_WIDTH: Final = 11  # the columns before an event's text: 9 of the time, and 2 blanks
# The end of a cause's text that a headline omits if a deeper cause follows: the former outcomes have other
# causes, and the root cause says more than what the goal waits for.
_OMITTED_END: Final = re.compile(r"(; before that, it was [^:]*?)?(, and waits.*)?$")
_WHY_RULE: Final = " ('cxbridge why RULE' explains each)"  # a hint for people; the page has links instead
_MAX_HEADLINE_CAUSES: Final = 3  # limit of the causes after the first cause in a headline


def explain_goals(evidence: Evidence, name: str, rule_count: int) -> Explanation:
    """Explain the goals with a name, as :func:`~cxbridge.history.model.find_goals` finds them.

    :param rule_count: the number of rules to show before each step of a single goal.
    :raises CxbridgeError: if there is no such goal, or the name is only the beginning of several ids.
    """
    writer = GoalStoryWriter(evidence)
    goals = writer.goals.find_goals(name, latest_only=evidence.is_time_chosen)
    stories = [writer.write_goal_story(goal) for goal in goals]
    headline = _make_goals_headline(stories, evidence.where)
    # Of several goals, each has one line: the user can ask for the story of one goal.
    lines = (
        _format_story(stories[0], evidence.where, rule_count)
        if len(stories) == 1
        else (f"{story.label}  {story.cause.text}" for story in stories)
    )
    return Explanation(
        (headline, "", *lines),
        {
            "headline": headline,
            "where": evidence.where,
            "goals": [drop_root_marks(asdict(story)) for story in stories],
            "notes": evidence.notes,
        },
    )


def explain_actions(evidence: Evidence, name: str) -> Explanation:
    """Explain the plan-actions with a name: ``GOAL/ID`` or ``GOAL/ACTION``; without ``GOAL/``, of any goal.

    :raises CxbridgeError: if there is no such plan-action or goal, or the goal's name is only the beginning
        of several ids.
    """
    writer = GoalStoryWriter(evidence)
    stories = [writer.write_action_story(goal, action) for goal, action in writer.goals.find_actions(name)]
    # Several plan-actions may have the name, because ids are used again: the headline is about the latest.
    lines = [_make_cause_headline(stories[-1].cause), f"in {evidence.where}"]
    for story in stories:
        lines += ["", f"action {story.action} of {story.goal}", story.cause.text]
        lines += format_causes(story.cause.because, "")
        lines += [f"{moment.seconds:9.3f}  {moment.text}" for moment in story.moments]
    return Explanation(
        tuple(lines),
        {
            "headline": lines[0],
            "where": evidence.where,
            "actions": [drop_root_marks(asdict(story)) for story in stories],
            "notes": evidence.notes,
        },
    )


def drop_root_marks(value: Any) -> Any:
    """Return a JSON value without the keys ``root``: only the headline needs the mark of a root cause."""
    if isinstance(value, dict):
        return {name: drop_root_marks(member) for name, member in value.items() if name != "root"}
    return [drop_root_marks(item) for item in value] if isinstance(value, list | tuple) else value


def _make_goals_headline(stories: Sequence[GoalStory], where: str) -> str:
    """Return the report in one line.

    For a single goal, the line has the state and the root cause; for several goals, their number, and the
    same about the first goal that has not completed.
    """
    if len(stories) == 1:
        return _make_goal_headline(stories[0])
    classes = {story.goal_class for story in stories}  # an id may be used again for another class
    class_text = f" of class {stories[0].goal_class}" if len(classes) == 1 else ""
    summary = f"{format_count(len(stories), 'goal')}{class_text} in {where}"
    troubled_story = next((story for story in stories if not story.is_completed), None)
    return (
        summary
        if troubled_story is None
        else f"{summary}; {troubled_story.label}: {_make_goal_headline(troubled_story)}"
    )


def _make_goal_headline(story: GoalStory) -> str:
    """Return the state of a goal in one line; unless the goal has completed, with the root cause."""
    return story.cause.text if story.is_completed else _make_cause_headline(story.cause)


def make_blocker_headline(story: GoalStory) -> str:
    """Return the story of a goal in one line, which begins with what blocks a waiting goal.

    This is the action or sub-goal whose cause is the root cause.
    """
    path = [story.cause, *_find_cause_path(story.cause)]
    effects = [*takewhile(lambda cause: not cause.root, path)]
    is_blocked = story.waits and 1 < len(effects) < len(path)
    return _make_cause_headline(effects[-1]) if is_blocked else _make_goal_headline(story)


def _make_cause_headline(cause: Cause) -> str:
    """Return a cause in one line, with the last causes on the way to its root cause."""
    texts = [deeper_cause.text for deeper_cause in _find_cause_path(cause)]
    *effect_texts, root_text = [cause.text, *texts[-_MAX_HEADLINE_CAUSES:]]
    return ": ".join([*(_OMITTED_END.sub("", text) for text in effect_texts), root_text])


def _find_cause_path(cause: Cause) -> list[Cause]:
    """Return the causes below a cause, of each level the most certain, down to the last root cause if any."""
    deeper_cause = max(cause.because, key=lambda reason: reason.certainty, default=None)
    if deeper_cause is None or (cause.root and not deeper_cause.certainty):
        return []
    return [deeper_cause, *_find_cause_path(deeper_cause)]


def _format_story(story: GoalStory, where: str, rule_count: int) -> Iterator[str]:
    sub_type = f", {story.sub_type}" if story.sub_type else ""
    parent = f", sub-goal of {story.parent}" if story.parent else ""
    yield f"goal {story.goal} ({story.label}{sub_type}){parent}"
    yield f"in {where}"
    yield ""
    yield story.cause.text
    yield from format_causes(story.cause.because, "")
    yield ""
    width = min(_MAX_WIDTH, max((len(moment.text) for moment in story.moments), default=0))
    for moment in story.moments:
        rule_names = ", ".join(moment.rules[-rule_count:]) if rule_count else ""
        text = f"{moment.seconds:9.3f}  {moment.text}"
        yield f"{text.ljust(width + _TIME_WIDTH)}  {rule_names}".rstrip()


def format_causes(causes: tuple[Cause, ...], prefix: str) -> Iterator[str]:
    """Yield causes as a tree.

    :param prefix: the beginning of each line.
    """
    for cause in causes:
        is_last = cause is causes[-1]
        branch = f"{prefix}{'└─ ' if is_last else '├─ '}"
        yield branch + cause.text.replace(RULES_THAT_COULD, RULES_THAT_COULD + _WHY_RULE, 1)
        yield from format_causes(cause.because, prefix + ("   " if is_last else "│  "))
