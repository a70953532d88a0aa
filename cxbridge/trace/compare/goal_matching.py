"""Matching of the goals of two runs by structure instead of ids or order alone."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, TypeAlias

from cxbridge.trace.compare.align import drop_pairs, take_equal
from cxbridge.trace.compare.goals import Goal, GoalForest, sign
from cxbridge.trace.compare.names import anonymous

LIKE: Final = 0.5
"""The minimal similarity of paired goals whose classes or parents differ."""

# limits the quadratic time
MAX_COMPARED: Final = 900
"""The maximal number of pairs of siblings whose similarity is computed; above it the order decides."""

MAX_STRAYS: Final = 50
"""The maximal number of unpaired goals of the same kind to which a goal is compared."""

Pair: TypeAlias = tuple[Goal, Goal]


@dataclass(slots=True)
class GoalMatch:
    """The paired goals, parents before their children.

    :param pairs: goals of both runs.
    :param only: the goals of each run without a partner.
    :param adopted: pairs with different parents; :param renamed: pairs of different class or id.
    :param labels: a name per goal, equal for both goals of a pair.
    """

    pairs: list[Pair] = field(default_factory=list)
    only: tuple[list[Goal], list[Goal]] = field(default_factory=lambda: ([], []))
    adopted: list[Pair] = field(default_factory=list)
    renamed: list[Pair] = field(default_factory=list)
    labels: dict[Goal, str] = field(default_factory=dict)


def match_goals(a: GoalForest, b: GoalForest) -> GoalMatch:
    """Pair the goals of two runs, from the roots down.

    Goals form a pair if their parents do, and environment, class, sub-type and id without gensym number are
    equal. Among several such siblings, those with equal behaviour are paired first, then the most similar
    ones. The remaining goals are paired with similar goals of another parent or class, and such pairs are
    differences.
    """
    matcher = _Matcher(a, b)
    matcher.descend("", a.roots, b.roots)
    matcher.adopt()
    return matcher.match


class _Matcher:
    """Pairs the goals of two runs."""

    def __init__(self, a: GoalForest, b: GoalForest) -> None:
        self.match = GoalMatch()
        self._signatures: list[dict[Goal, int]] = []
        self._counts: Counter[str] = Counter()
        for with_parent in (True, False):
            numbers: dict[object, int] = {}
            signed = [sign(forest, numbers, with_parent=with_parent) for forest in (a, b)]
            self._signatures.append(signed[0] | signed[1])

    def descend(self, path: str, siblings_a: list[Goal], siblings_b: list[Goal]) -> None:
        """Pair siblings and their descendants."""
        stack = [(path, siblings_a, siblings_b)]
        while stack:
            path, ours, theirs = stack.pop()
            ours, theirs = list(ours), list(theirs)
            places = {goal: place for siblings in (ours, theirs) for place, goal in enumerate(siblings)}
            pairs: list[Pair] = []
            for signed in self._signatures:
                there = {goal: (signed[goal], place) for goal, place in places.items()}
                pairs += take_equal(ours, theirs, there.__getitem__)
                pairs += take_equal(ours, theirs, signed.__getitem__)
            pairs += _take_alike(ours, theirs)
            renamed = _take_renamed(ours, theirs)
            self.match.renamed += renamed
            stack += [
                (self._add_pair(path, pair), pair[0].children, pair[1].children)
                for pair in (*pairs, *renamed)
            ]
            for only, left in zip(self.match.only, (ours, theirs), strict=True):
                only.extend(left)
                self.match.labels.update({goal: self._label(path, goal) for goal in left})

    def adopt(self) -> None:
        """Pair the remaining goals with similar goals of other parents."""
        by_kind: dict[object, list[Goal]] = defaultdict(list)
        only_a, only_b = self.match.only
        for goal in only_b:
            by_kind[goal.kind].append(goal)
        for one in list(only_a):
            best = max(by_kind[one.kind][:MAX_STRAYS], key=one.likeness, default=None)
            if best is None or one.likeness(best) < LIKE:
                continue
            by_kind[one.kind].remove(best)
            only_a.remove(one)
            only_b.remove(best)
            self.match.adopted.append((one, best))
            self.match.pairs.append((one, best))
            label = self.match.labels[best] = self.match.labels[one]
            self.descend(label, one.children, best.children)

    def _add_pair(self, path: str, pair: Pair) -> str:
        """Add a pair; return its label."""
        self.match.pairs.append(pair)
        label = self._label(path, pair[0])
        self.match.labels.update(dict.fromkeys(pair, label))
        return label

    def _label(self, path: str, goal: Goal) -> str:
        """Return a unique label for a goal: the id without its number, or the class."""
        name = anonymous(goal.key[1]).replace("gen#", "").strip("-") or goal.goal_class
        label = f"{path}/{name}"
        self._counts[label] += 1
        return label if self._counts[label] == 1 else f"{label}[{self._counts[label]}]"


def _take_alike(ours: list[Goal], theirs: list[Goal]) -> list[Pair]:
    """Remove pairs of the same kind from siblings, the most similar first."""
    kinds: dict[object, tuple[list[Goal], list[Goal]]] = defaultdict(lambda: ([], []))
    for run, goals in enumerate((ours, theirs)):
        for goal in goals:
            kinds[goal.kind][run].append(goal)
    pairs: list[Pair] = []
    for group in kinds.values():
        few = 1 < len(group[0]) * len(group[1]) <= MAX_COMPARED
        pairs += _most_alike(*group, 0.0) if few else zip(*group, strict=False)
    drop_pairs(pairs, ours, theirs)
    return pairs


def _take_renamed(ours: list[Goal], theirs: list[Goal]) -> list[Pair]:
    """Remove pairs of different kinds but similar behaviour from siblings."""
    if len(ours) * len(theirs) > MAX_COMPARED:
        return []
    pairs = [pair for pair in _most_alike(ours, theirs, LIKE) if pair[0].key[0] == pair[1].key[0]]
    drop_pairs(pairs, ours, theirs)
    return pairs


def _most_alike(ours: Sequence[Goal], theirs: Sequence[Goal], least: float) -> list[Pair]:
    """Return pairs of goals by decreasing similarity; equally similar ones by closeness of their indices."""
    scored = sorted(
        (-one.likeness(other), abs(i - k), i, k)
        for i, one in enumerate(ours)
        for k, other in enumerate(theirs)
    )
    taken: tuple[set[int], set[int]] = (set(), set())
    pairs: list[Pair] = []
    for unlike, _, i, k in scored:
        if -unlike >= least and i not in taken[0] and k not in taken[1]:
            taken[0].add(i)
            taken[1].add(k)
            pairs.append((ours[i], theirs[k]))
    return sorted(pairs, key=lambda pair: pair[0].start)
