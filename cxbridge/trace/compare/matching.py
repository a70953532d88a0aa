"""Which goal of one run is which goal of the other: by structure, never by id or order alone."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from cxbridge.trace.compare.goals import Goal, GoalForest, GoalKey, Signatures, Signer
from cxbridge.trace.compare.naming import anonymous

Signings: TypeAlias = Sequence[tuple[Signatures, Signatures]]
"""Signatures of both runs, the strictest first."""

Paired: TypeAlias = tuple[list[tuple[Goal, Goal]], list[Goal], list[Goal]]
"""The pairs of siblings, and those of either run that are left."""


@dataclass(slots=True)
class Match:
    """The goals that belong together, parents before their children.

    :param pairs: goals of both runs.
    :param only_a: goals that the other run has nothing like; ``only_b``: likewise.
    :param labels_a: a name for each goal of the first run that is the same for its partner in ``labels_b``.
    """

    pairs: list[tuple[Goal, Goal]] = field(default_factory=list)
    only_a: list[Goal] = field(default_factory=list)
    only_b: list[Goal] = field(default_factory=list)
    labels_a: dict[GoalKey, str] = field(default_factory=dict)
    labels_b: dict[GoalKey, str] = field(default_factory=dict)


def match_goals(a: GoalForest, b: GoalForest) -> Match:
    """Pair the goals of two runs, from the roots down.

    Goals can only be a pair when their parents are, and when environment, class, sub-type and id without its
    gensym number are the same. Among several such siblings, those that did the same are paired first, then
    what is left in order of appearance.
    """
    match = Match()
    signings = []
    for with_parent in (True, False):
        signer = Signer(with_parent=with_parent)
        signings.append((signer.sign(a), signer.sign(b)))
    stack = [("", a.roots, b.roots)]
    while stack:
        path, siblings_a, siblings_b = stack.pop()
        labels = _Labels(path)
        paired, rest_a, rest_b = _pair(siblings_a, siblings_b, signings)
        for one, other in paired:
            label = labels.new(one)
            match.pairs.append((one, other))
            match.labels_a[one.key] = match.labels_b[other.key] = label
            stack.append((label, one.children, other.children))
        match.only_a += rest_a
        match.only_b += rest_b
        match.labels_a.update({goal.key: labels.new(goal) for goal in rest_a})
        match.labels_b.update({goal.key: labels.new(goal) for goal in rest_b})
    return match


def _pair(siblings_a: list[Goal], siblings_b: list[Goal], signings: Signings) -> Paired:
    """Pair siblings; return the pairs, and what is left of both."""
    pairs: list[tuple[Goal, Goal]] = []
    for signs_a, signs_b in signings:
        pairs += _take(siblings_a, siblings_b, signs_a, signs_b)
        taken_a, taken_b = {one.key for one, _ in pairs}, {other.key for _, other in pairs}
        siblings_a = [goal for goal in siblings_a if goal.key not in taken_a]
        siblings_b = [goal for goal in siblings_b if goal.key not in taken_b]
    left: dict[object, deque[Goal]] = defaultdict(deque)
    for goal in siblings_b:
        left[goal.kind].append(goal)
    rest_a = []
    for goal in siblings_a:
        if left[goal.kind]:
            pairs.append((goal, left[goal.kind].popleft()))
        else:
            rest_a.append(goal)
    rest_b = [goal for goals in left.values() for goal in goals]
    return pairs, rest_a, rest_b


def _take(
    siblings_a: list[Goal], siblings_b: list[Goal], signs_a: Signatures, signs_b: Signatures
) -> list[tuple[Goal, Goal]]:
    """Return the pairs of siblings with the same signature, in order of appearance."""
    left: dict[int, deque[Goal]] = defaultdict(deque)
    for goal in siblings_b:
        left[signs_b[goal.key]].append(goal)
    return [(goal, left[signs_a[goal.key]].popleft()) for goal in siblings_a if left[signs_a[goal.key]]]


class _Labels:
    """Names for siblings: the id without its number, or the class; numbered where that is not enough."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._counts: dict[str, int] = {}

    def new(self, goal: Goal) -> str:
        """Return a name that no sibling has."""
        name = anonymous(goal.key[1]).replace("gen#", "").strip("-") or goal.goal_class
        count = self._counts[name] = self._counts.get(name, 0) + 1
        return f"{self._path}/{name}" if count == 1 else f"{self._path}/{name}[{count}]"
