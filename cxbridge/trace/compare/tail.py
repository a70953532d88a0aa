"""The events of two runs from the first place on where they differ, as numbers: a million fit in memory."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

from cxbridge.events import Event
from cxbridge.trace.compare.align import NONE, align
from cxbridge.trace.compare.naming import Names
from cxbridge.trace.compare.tokens import THREAD, Key, Token

KEPT: Final = 20_000
"""So many events of each run are kept as they are; later ones are read again when they are shown."""


class Keys:
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
class Tail:
    """The rest of one run.

    :param keys: what each event says, as a number of :class:`Keys`.
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


class Tails:
    """The rest of both runs, with names that are the same for what is the same.

    :param known: so many names of both runs are known to be the same, number by number.
    """

    def __init__(self, known: int) -> None:
        self.a, self.b = Tail(), Tail()
        self.keys = Keys()
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

    def labels_a(self, names: Sequence[int]) -> Names:
        """Return the labels of names of A."""
        return tuple(names)

    def labels_b(self, names: Sequence[int]) -> Names:
        """Return the labels of names of B: those of their partners in A, others are below 0."""
        known, partner = self._known, self._partner
        return tuple(name if name < known else partner.get(name, -1 - name) for name in names)

    def labels(self, tail: Tail, at: int) -> Names:
        """Return the labels of the names in an event."""
        names = tail.names_of(at)
        return self.labels_a(names) if tail is self.a else self.labels_b(names)

    def open_labels(self, names: Names) -> Names:
        """Return labels with -1 for all that the other run has no partner for."""
        known, taken = self._known, self._taken
        return tuple(name if name in taken or 0 <= name < known else -1 for name in names)

    def thread(self, tail: Tail, at: int) -> tuple[Key, Names]:
        """Return what an event is a step of, the same for both runs."""
        number = tail.keys[at]
        key = self.keys.all[number]
        return key[: THREAD[key[0]]], self.labels(tail, at)[: self.keys.thread_names[number]]

    def adopt(self, name_a: int, name_b: int) -> None:
        """Take two names for the same, unless one of them is known already."""
        if min(name_a, name_b) >= self._known and name_b not in self._partner and name_a not in self._taken:
            self._partner[name_b] = name_a
            self._taken.add(name_a)

    def _labelled(self, tail: Tail) -> array[int]:
        """Return for each event a number of what it says, names included."""
        label = self.labels_a if tail is self.a else self.labels_b
        found = array("q")
        start = 0
        for key, end in zip(tail.keys, tail.ends, strict=True):
            found.append(hash((key, label(tail.names[start:end]))) if end > start else key)
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
