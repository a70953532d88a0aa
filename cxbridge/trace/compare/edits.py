"""Finds the edits between the tails of two runs: events that moved, changed, or are in one run only."""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections import Counter, defaultdict, deque
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

from cxbridge.events import Event
from cxbridge.trace.compare.align import NONE, align
from cxbridge.trace.compare.keys import Key, Token, thread_key
from cxbridge.trace.compare.model import DifferenceKind
from cxbridge.trace.compare.names import Names

KEPT: Final = 20_000
"""So many events of each run are kept as they are; later ones are read again when they are shown."""


class KeyNumbers:
    """The keys of both runs, numbered."""

    def __init__(self) -> None:
        self.all: list[Key] = []
        self.thread_names: list[int] = []
        self._numbers: dict[Key, int] = {}

    def number(self, token: Token) -> int:
        """Return the number of a key."""
        number = self._numbers.get(token.key)
        if number is None:
            number = self._numbers[token.key] = len(self.all)
            self.all.append(token.key)
            self.thread_names.append(token.thread_names)
        return number


@dataclass(slots=True)
class RunTail:
    """The events of one run from the first difference on, as numbers: a million fit in memory.

    :param keys: what each event says, as a number of :class:`KeyNumbers`.
    :param numbers: the number of each event among those that are compared.
    :param msgids: -1: it has none.
    :param names: the names of all events, one after the other; ``ends``: where those of each event end.
    """

    keys: array[int] = field(default_factory=lambda: array("q"))
    numbers: array[int] = field(default_factory=lambda: array("q"))
    msgids: array[int] = field(default_factory=lambda: array("q"))
    times: array[int] = field(default_factory=lambda: array("q"))
    names: array[int] = field(default_factory=lambda: array("q"))
    ends: array[int] = field(default_factory=lambda: array("q"))
    events: list[Event] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.keys)

    def add(self, token: Token, key: int) -> None:
        """Take the next event."""
        self.keys.append(key)
        self.numbers.append(token.number)
        self.msgids.append(NONE if token.msgid is None else token.msgid)
        self.times.append(token.event.time_us)
        self.names.extend(token.names)
        self.ends.append(len(self.names))
        if len(self.events) < KEPT:
            self.events.append(token.event)

    def names_of(self, at: int) -> Names:
        """Return the names in an event."""
        return tuple(self.names[self.ends[at - 1] if at else 0 : self.ends[at]])


class RunTails:
    """The tails of both runs, with names that are the same for what is the same.

    :param known: so many names of both runs are known to be the same, number by number.
    """

    def __init__(self, known: int) -> None:
        self.a, self.b = RunTail(), RunTail()
        self.keys = KeyNumbers()
        self._known = known
        self._partner: dict[int, int] = {}  # names of B to those of A
        self._taken: set[int] = set()  # names of A that have a partner

    def add(self, one: Token | None, other: Token | None) -> None:
        """Take the next event of each run, None when it is over."""
        if one is not None:
            self.a.add(one, self.keys.number(one))
        if other is not None:
            self.b.add(other, self.keys.number(other))

    def align(self) -> array[int]:
        """Return the partner in B of each event of A, -1 for none: by what is said, then by names too."""
        partners = align(self.a.keys, self.b.keys)
        if not self.a.names and not self.b.names:
            return partners
        self._learn_names(partners)
        return align(self._labelled(self.a), self._labelled(self.b))

    def labels(self, tail: RunTail, at: int) -> Names:
        """Return the labels of the names in an event."""
        return self._labels(tail, tail.names_of(at))

    def _labels(self, tail: RunTail, names: Sequence[int]) -> Names:
        """Return labels: the names of A, and of B those of their partners in A; others are below 0."""
        if tail is self.a:
            return tuple(names)
        known, partner = self._known, self._partner
        return tuple(name if name < known else partner.get(name, -1 - name) for name in names)

    def open_labels(self, names: Names) -> Names:
        """Return labels with -1 for all that the other run has no partner for."""
        known, taken = self._known, self._taken
        return tuple(name if name in taken or 0 <= name < known else -1 for name in names)

    def thread(self, tail: RunTail, at: int) -> tuple[Key, Names]:
        """Return what an event is a step of, the same for both runs."""
        number = tail.keys[at]
        names = self.labels(tail, at)[: self.keys.thread_names[number]]
        return thread_key(self.keys.all[number]), names

    def key(self, tail: RunTail, at: int) -> Key:
        """Return the key of an event."""
        return self.keys.all[tail.keys[at]]

    def adopt(self, name_a: int, name_b: int) -> None:
        """Take two names for the same, unless one of them is known already."""
        if min(name_a, name_b) >= self._known and name_b not in self._partner and name_a not in self._taken:
            self._partner[name_b] = name_a
            self._taken.add(name_a)

    def _labelled(self, tail: RunTail) -> array[int]:
        """Return for each event a number of what it says, names included."""
        found = array("q")
        start = 0
        for key, end in zip(tail.keys, tail.ends, strict=True):
            found.append(hash((key, self._labels(tail, tail.names[start:end]))) if end > start else key)
            start = end
        return found

    def _learn_names(self, partners: array[int]) -> None:
        """Let partners vote on which name of A is which of B; the most votes win."""
        votes: Counter[tuple[int, int]] = Counter()
        for pair in self._name_pairs(partners):
            votes[pair] += 1
        for (one, other), _ in sorted(votes.items(), key=lambda vote: -vote[1]):
            self.adopt(one, other)

    def _name_pairs(self, partners: array[int]) -> Iterator[tuple[int, int]]:
        """Yield the names at the same place of partners."""
        for at, partner in enumerate(partners):
            if partner != NONE:
                yield from zip(self.a.names_of(at), self.b.names_of(partner), strict=False)


_IN_ROWS: Final = frozenset({DifferenceKind.ORDER, DifferenceKind.ONLY_A, DifferenceKind.ONLY_B})


@dataclass(slots=True)
class Edit:
    """A difference between the tails of two runs.

    :param a: index in the first tail; ``b``: in the second; -1: it has nothing.
    :param count: how many events in a row.
    :param place: where it comes, in an order of the events of both runs.
    :param whole: whether it is all events of a goal, wherever they are, of one that the other run has not.
    :param late: by how many seconds the second run is late, for a difference of times.
    """

    kind: DifferenceKind
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
        alike = not self.whole and self.kind is other.kind and self.kind in _IN_ROWS
        return alike and other.at == (next_a, next_b)


class Edits:
    """Finds the edits between two tails.

    :param partners: the partner in B of each event of A, -1 for none.
    """

    changed: dict[int, int]
    """What became of events of A, by the indices in both; known after the iteration."""

    def __init__(self, tails: RunTails, partners: array[int]) -> None:
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
        only_a = [Edit(DifferenceKind.ONLY_A, at, NONE, (at, 0, at)) for at in self._loose_a]
        only_b = [Edit(DifferenceKind.ONLY_B, NONE, at, self._place_b(at)) for at in self._loose_b]
        found += [*self._only(self._tails.a, only_a), *self._only(self._tails.b, only_b)]
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

    def _threads(self, tail: RunTail, loose: list[int]) -> dict[Hashable, list[int]]:
        """Return the names of the goals that events are steps of, by what the goals' ids have in common."""
        found: dict[Hashable, list[int]] = defaultdict(list)
        for at in loose:
            (key, labels), names = self._tails.thread(tail, at), tail.names_of(at)
            if key[0] == "goal" and len(labels) == 1 and self._tails.open_labels(labels) == (NONE,):
                known = found[key]
                if names[0] not in known:
                    known.append(names[0])
        return found

    def _only(self, tail: RunTail, edits: list[Edit]) -> Iterator[Edit]:
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
                yield Edit(DifferenceKind.ORDER, at, other, min((at, 0, at), self._place_b(other)))
            else:
                rest.append(at)
        self._loose_a = rest
        self._loose_b = [at for at in self._loose_b if at not in gone]

    def _content(self, tail: RunTail, at: int) -> Hashable:
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
                yield Edit(DifferenceKind.CHANGED, at, other, min((at, 0, at), self._place_b(other)))
        self._loose_a = [at for at in self._loose_a if at not in self.changed]
        self._loose_b = [at for at in self._loose_b if at not in gone]

    def _steps(self, tail: RunTail, loose: list[int]) -> Iterator[tuple[int, Hashable]]:
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
