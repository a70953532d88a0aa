"""Goals explained, as text for people and as values for programs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from cxbridge.errors import CxbridgeError
from cxbridge.explain.evidence import Evidence
from cxbridge.explain.goal_story import FACT_TEMPLATES, Cause, GoalStory, Storyteller
from cxbridge.explain.goals import Goals
from cxbridge.history.orders import PLAN_ACTION, order_of

_WIDEST = 90


def explain_goals(evidence: Evidence, name: str) -> tuple[GoalStory, ...]:
    """Tell of the goals that a name stands for.

    :raises CxbridgeError: when there is none, or the source knows no goals.
    """
    if evidence.history is None:
        raise CxbridgeError("goals are not known here")
    facts = {template: evidence.slots_of(template) for template in FACT_TEMPLATES}
    orders = dict(order_of(slots) for slots in facts[PLAN_ACTION])
    goals = Goals(evidence.history, orders)
    chosen = goals.find(name)
    teller = Storyteller(evidence, goals, facts)
    return tuple(teller.tell(goal) for goal in chosen)


def plain(stories: Sequence[GoalStory], evidence: Evidence) -> dict[str, Any]:
    """Return the stories as values that JSON knows."""
    return {"where": evidence.where, "goals": [asdict(story) for story in stories], "notes": evidence.notes}


def lines(stories: Sequence[GoalStory], evidence: Evidence, rules: int = 1) -> Iterator[str]:
    """Yield the report for people.

    :param rules: how many rules are shown of those that fired just before each step.
    """
    if len(stories) > 1:
        yield f"{len(stories)} goals of class {stories[0].goal_class} in {evidence.where}"
        yield ""
        for story in stories:
            yield f"{story.goal_class}#{story.number}  {story.cause.text}"
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
    yield from _causes(story.cause.because, "")
    yield ""
    width = min(_WIDEST, max((len(moment.text) for moment in story.moments), default=0))
    for moment in story.moments:
        fired = ", ".join(moment.rules[-rules:]) if rules else ""
        text = f"{moment.seconds:9.3f}  {moment.text}"
        yield f"{text.ljust(width + 11)}  {fired}".rstrip()


def _causes(causes: tuple[Cause, ...], stem: str) -> Iterator[str]:
    for cause in causes:
        last = cause is causes[-1]
        yield f"{stem}{'└─ ' if last else '├─ '}{cause.text}"
        yield from _causes(cause.because, stem + ("   " if last else "│  "))
