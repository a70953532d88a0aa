"""Matches the goals of two runs by structure, never by id or order alone."""

from __future__ import annotations

from collections import defaultdict, deque
from dataclasses import dataclass, field
from typing import Final

from cxbridge.trace.compare.goals import Goal, GoalForest, GoalKey, Signatures, Signer
from cxbridge.trace.compare.names import anonymous

LIKE: Final = 0.5
"""Goals of different classes, or of different parents, can be the same when so much of what they did is."""

MAX_COMPARED: Final = 900
"""So many pairs of siblings are looked at for likeness; with more, their order decides."""


MAX_STRAYS: Final = 50
"""With so many goals of its kind a goal is compared that is left over."""


@dataclass(slots=True)
class GoalMatch:
    """The goals that belong together, parents before their children.

    :param pairs: goals of both runs.
    :param only_a: goals that the other run has nothing like; ``only_b``: likewise.
    :param adopted: pairs that have different parents; :param renamed: pairs of different class or id.
    :param labels_a: a name for each goal of the first run that is the same for its partner in ``labels_b``.
    """

    pairs: list[tuple[Goal, Goal]] = field(default_factory=list)
    only_a: list[Goal] = field(default_factory=list)
    only_b: list[Goal] = field(default_factory=list)
    adopted: list[tuple[Goal, Goal]] = field(default_factory=list)
    renamed: list[tuple[Goal, Goal]] = field(default_factory=list)
    labels_a: dict[GoalKey, str] = field(default_factory=dict)
    labels_b: dict[GoalKey, str] = field(default_factory=dict)


def match_goals(a: GoalForest, b: GoalForest) -> GoalMatch:
    """Pair the goals of two runs, from the roots down.

    Goals are a pair when their parents are, and environment, class, sub-type and id without its gensym number
    are the same. Among several such siblings, those that did the same are paired first, then those that did
    most alike. What is left over then is paired with what did much the same below another parent, or as a
    goal of another class; such pairs are differences.
    """
    matcher = _Matcher(a, b)
    matcher.descend("", a.roots, b.roots)
    matcher.adopt()
    return matcher.match


class _Matcher:
    """Pairs the goals of two runs."""

    def __init__(self, a: GoalForest, b: GoalForest) -> None:
        self.match = GoalMatch()
        self._signings: list[tuple[Signatures, Signatures]] = []
        self._labels: dict[str, _Labels] = {}
        for with_parent in (True, False):
            signer = Signer(with_parent=with_parent)
            self._signings.append((signer.sign(a), signer.sign(b)))

    def descend(self, path: str, siblings_a: list[Goal], siblings_b: list[Goal]) -> None:
        """Pair siblings and all below them."""
        stack = [(path, siblings_a, siblings_b)]
        while stack:
            path, siblings_a, siblings_b = stack.pop()
            siblings = _Siblings(siblings_a, siblings_b)
            for signs in self._signings:
                siblings.pair_equal(*signs)
            siblings.pair_alike()
            renamed = siblings.pair_renamed()
            self.match.renamed += renamed
            for one, other in [*siblings.pairs, *renamed]:
                self._take(path, one, other)
                stack.append((self.match.labels_a[one.key], one.children, other.children))
            for left, only, labels in (
                (siblings.a, self.match.only_a, self.match.labels_a),
                (siblings.b, self.match.only_b, self.match.labels_b),
            ):
                only.extend(left)
                labels.update({goal.key: self._label(path, goal) for goal in left})

    def adopt(self) -> None:
        """Pair what is left with what did much the same below another parent."""
        by_kind: dict[object, list[Goal]] = defaultdict(list)
        for goal in self.match.only_b:
            by_kind[goal.kind].append(goal)
        for one in list(self.match.only_a):
            others = by_kind.get(one.kind, [])[:MAX_STRAYS]
            best = max(others, key=one.likeness, default=None)
            if best is None or one.likeness(best) < LIKE:
                continue
            by_kind[one.kind].remove(best)
            self.match.only_a.remove(one)
            self.match.only_b.remove(best)
            self.match.adopted.append((one, best))
            self.match.pairs.append((one, best))
            label = self.match.labels_b[best.key] = self.match.labels_a[one.key]
            self.descend(label, one.children, best.children)

    def _take(self, path: str, one: Goal, other: Goal) -> None:
        """Note a pair."""
        self.match.pairs.append((one, other))
        self.match.labels_a[one.key] = self.match.labels_b[other.key] = self._label(path, one)

    def _label(self, path: str, goal: Goal) -> str:
        """Return a name for a goal that none of its siblings has."""
        labels = self._labels.get(path)
        if labels is None:
            labels = self._labels[path] = _Labels(path)
        return labels.new(goal)


class _Siblings:
    """The children of one goal in two runs, or the roots; those that have no partner yet.

    :param a: those of the first run; ``b``: those of the second.
    """

    def __init__(self, a: list[Goal], b: list[Goal]) -> None:
        self.a, self.b = a, b
        self.pairs: list[tuple[Goal, Goal]] = []

    def pair_equal(self, signs_a: Signatures, signs_b: Signatures) -> None:
        """Pair those that did the same: first those of the same place, then in order of appearance."""
        if len(self.a) == len(self.b):
            same = [
                (one, other)
                for one, other in zip(self.a, self.b, strict=True)
                if signs_a[one.key] == signs_b[other.key]
            ]
            self._take(same)
        left: dict[int, deque[Goal]] = defaultdict(deque)
        for goal in self.b:
            left[signs_b[goal.key]].append(goal)
        self._take([(goal, left[signs_a[goal.key]].popleft()) for goal in self.a if left[signs_a[goal.key]]])

    def pair_alike(self) -> None:
        """Pair what is left of one kind: those that did most alike first."""
        kinds: dict[object, tuple[list[Goal], list[Goal]]] = defaultdict(lambda: ([], []))
        for side, goals in enumerate((self.a, self.b)):
            for goal in goals:
                kinds[goal.kind][side].append(goal)
        for ours, theirs in kinds.values():
            if len(ours) == len(theirs) == 1 or len(ours) * len(theirs) > MAX_COMPARED:
                self._take(list(zip(ours, theirs, strict=False)))
            else:
                self._take(_most_alike(ours, theirs, 0.0))

    def pair_renamed(self) -> list[tuple[Goal, Goal]]:
        """Pair goals of different kind that did much the same; return them."""
        if len(self.a) * len(self.b) > MAX_COMPARED:
            return []
        found = [pair for pair in _most_alike(self.a, self.b, LIKE) if pair[0].key[0] == pair[1].key[0]]
        known = len(self.pairs)
        self._take(found)
        del self.pairs[known:]
        return found

    def _take(self, pairs: list[tuple[Goal, Goal]]) -> None:
        """Note pairs."""
        self.pairs += pairs
        taken_a, taken_b = {one.key for one, _ in pairs}, {other.key for _, other in pairs}
        self.a = [goal for goal in self.a if goal.key not in taken_a]
        self.b = [goal for goal in self.b if goal.key not in taken_b]


def _most_alike(ours: list[Goal], theirs: list[Goal], least: float) -> list[tuple[Goal, Goal]]:
    """Return pairs of goals, those most alike first; of those equally alike, the ones at the same place."""
    scored = sorted(
        (
            (-one.likeness(other), abs(i - k), i, k)
            for i, one in enumerate(ours)
            for k, other in enumerate(theirs)
        ),
    )
    pairs = []
    free_a, free_b = set(range(len(ours))), set(range(len(theirs)))
    for unlike, _, i, k in scored:
        if -unlike >= least and i in free_a and k in free_b:
            free_a.remove(i)
            free_b.remove(k)
            pairs.append((ours[i], theirs[k]))
    return sorted(pairs, key=lambda pair: pair[0].start)


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
