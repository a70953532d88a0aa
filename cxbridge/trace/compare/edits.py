"""What became of the events that have no partner: moved, changed, or there in one run only."""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections import defaultdict, deque
from collections.abc import Hashable, Iterator
from dataclasses import dataclass

from cxbridge.trace.compare.align import NONE
from cxbridge.trace.compare.result import Kind
from cxbridge.trace.compare.tail import Tail, Tails


@dataclass(slots=True)
class Edit:
    """A difference between the rests of two runs.

    :param a: index in the first rest; ``b``: in the second; -1: it has nothing.
    :param count: how many events in a row.
    :param place: where it comes, in an order of the events of both runs.
    :param whole: whether it is all events of a goal, wherever they are, of one that the other run has not.
    :param late: by how many seconds the second run is late, for a difference of times.
    """

    kind: Kind
    a: int
    b: int
    place: tuple[int, int, int]
    count: int = 1
    late: float = 0.0
    whole: bool = False

    @property
    def at(self) -> tuple[int, int]:
        """The indices in both."""
        return (self.a, self.b)

    def goes_on(self, other: Edit) -> bool:
        """Whether another edit is the same for the next event of each run that this one is about."""
        next_a = self.a + self.count if self.a != NONE else NONE
        next_b = self.b + self.count if self.b != NONE else NONE
        alike = (
            not self.whole and self.kind is other.kind and self.kind in {Kind.ORDER, Kind.ONLY_A, Kind.ONLY_B}
        )
        return alike and other.at == (next_a, next_b)


class Edits:
    """Finds the edits between two rests.

    :param partners: the partner in B of each event of A, -1 for none.
    """

    changed: dict[int, int]
    """What became of events of A, by the indices in both; known after the iteration."""

    def __init__(self, tails: Tails, partners: array[int]) -> None:
        self._tails = tails
        self._partners = partners
        self.changed = {}
        self._loose_a = [at for at, partner in enumerate(partners) if partner == NONE]
        self._taken = bytearray(len(tails.b))
        for partner in partners:
            if partner != NONE:
                self._taken[partner] = 1
        self._loose_b = [at for at in range(len(tails.b)) if not self._taken[at]]
        self._paired_a = [at for at, partner in enumerate(partners) if partner != NONE]
        self._paired_b = [partners[at] for at in self._paired_a]

    def __iter__(self) -> Iterator[Edit]:
        """Yield the edits in the order of the runs."""
        self._adopt_names()
        found = [*self._moved(), *self._changed()]
        found += self._only(self._tails.a, [Edit(Kind.ONLY_A, at, NONE, (at, 0, at)) for at in self._loose_a])
        found += self._only(
            self._tails.b, [Edit(Kind.ONLY_B, NONE, at, self._place_b(at)) for at in self._loose_b]
        )
        found.sort(key=lambda edit: edit.place)
        last: Edit | None = None
        for edit in found:
            if last is not None and last.goes_on(edit):
                last.count += 1
                continue
            if last is not None:
                yield last
            last = edit
        if last is not None:
            yield last

    def _gap(self, paired: list[int], at: int) -> int:
        """Return the index in A of the first event after this one that has a partner.

        :param paired: the indices of those that have one, in the run that ``at`` is of.
        """
        place = bisect_left(paired, at)
        return self._paired_a[place] if place < len(paired) else len(self._tails.a)

    def has_partner(self, at: int) -> bool:
        """Whether an event of B has a partner."""
        return bool(self._taken[at])

    def partner_before(self, run: int, at: int) -> int:
        """Return the index in the other run of the partner of the last event before this one, -1 for none.

        :param run: the run that ``at`` is of: 0 is A, 1 is B.
        """
        mine, others = (self._paired_a, self._paired_b) if run == 0 else (self._paired_b, self._paired_a)
        place = bisect_left(mine, at)
        return others[place - 1] if place else NONE

    def _place_b(self, at: int) -> tuple[int, int, int]:
        """Return where an event of B that has no partner comes: after those of A in the same gap."""
        return (self._gap(self._paired_b, at) - 1, 1, at)

    def _adopt_names(self) -> None:
        """Take goals that are in one run only, in the same gap, for the same when they can be."""
        gaps: dict[int, tuple[list[int], list[int]]] = defaultdict(lambda: ([], []))
        for at in self._loose_a:
            gaps[self._gap(self._paired_a, at)][0].append(at)
        for at in self._loose_b:
            gaps[self._gap(self._paired_b, at)][1].append(at)
        for loose_a, loose_b in gaps.values():
            self._adopt(self._threads(self._tails.a, loose_a), self._threads(self._tails.b, loose_b))

    def _adopt(self, ours: dict[Hashable, list[int]], theirs: dict[Hashable, list[int]]) -> None:
        """Take the names that are free on both sides for the same, in order of appearance."""
        for thread, names in ours.items():
            for one, other in zip(names, theirs.get(thread, ()), strict=False):
                self._tails.adopt(one, other)

    def _threads(self, tail: Tail, loose: list[int]) -> dict[Hashable, list[int]]:
        """Return the names of the goals that events are steps of, by what the goals' ids have in common."""
        found: dict[Hashable, list[int]] = defaultdict(list)
        for at in loose:
            (key, labels), names = self._tails.thread(tail, at), tail.names_of(at)
            if key[0] == "goal" and len(labels) == 1 and self._tails.open_labels(labels) == (NONE,):
                known = found[key]
                if names[0] not in known:
                    known.append(names[0])
        return found

    def _only(self, tail: Tail, edits: list[Edit]) -> Iterator[Edit]:
        """Yield events that one run only has, all those of a goal that the other has not as one."""
        goals: dict[int, Edit] = {}
        for edit in edits:
            at = edit.a if tail is self._tails.a else edit.b
            names = self._tails.thread(tail, at)[1][:1]
            if not names or self._tails.open_labels(names) != (NONE,):
                yield edit
            elif names[0] in goals:
                goals[names[0]].count += 1
            else:
                edit.whole = True
                goals[names[0]] = edit
        yield from goals.values()

    def _moved(self) -> Iterator[Edit]:
        """Yield what both runs have, at other places."""
        left: dict[Hashable, deque[int]] = defaultdict(deque)
        for at in self._loose_b:
            left[self._content(self._tails.b, at)].append(at)
        rest, gone = [], set()
        for at in self._loose_a:
            others = left.get(self._content(self._tails.a, at))
            if others:
                other = others.popleft()
                gone.add(other)
                yield Edit(Kind.ORDER, at, other, min((at, 0, at), self._place_b(other)))
            else:
                rest.append(at)
        self._loose_a = rest
        self._loose_b = [at for at in self._loose_b if at not in gone]

    def _content(self, tail: Tail, at: int) -> Hashable:
        """Return what an event says, names that one run has only being all the same."""
        return tail.keys[at], self._tails.open_labels(self._tails.labels(tail, at))

    def _changed(self) -> Iterator[Edit]:
        """Yield what both runs have between the same steps of a goal, plan or skiller, said otherwise."""
        left: dict[Hashable, deque[int]] = defaultdict(deque)
        for at, place in self._steps(self._tails.b, self._loose_b):
            left[place].append(at)
        gone = set()
        for at, place in self._steps(self._tails.a, self._loose_a):
            others = left.get(place)
            if others:
                other = others.popleft()
                self.changed[at] = other
                gone.add(other)
                yield Edit(Kind.CHANGED, at, other, min((at, 0, at), self._place_b(other)))
        self._loose_a = [at for at in self._loose_a if at not in self.changed]
        self._loose_b = [at for at in self._loose_b if at not in gone]

    def _steps(self, tail: Tail, loose: list[int]) -> Iterator[tuple[int, Hashable]]:
        """Yield loose events, each with its thread and how many partners of the thread came before it."""
        wanted = {self._tails.thread(tail, at) for at in loose}
        counts: dict[Hashable, int] = defaultdict(int)
        of_a = tail is self._tails.a
        waiting = deque(loose)
        at = 0
        while waiting:
            if at == waiting[0]:
                waiting.popleft()
                thread = self._tails.thread(tail, at)
                yield at, (thread, counts[thread])
            elif self._partners[at] != NONE if of_a else self._taken[at]:
                thread = self._tails.thread(tail, at)
                if thread in wanted:
                    counts[thread] += 1
            at += 1
