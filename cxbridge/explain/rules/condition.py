"""The condition of a rule: its conditional elements (CEs), and the constraints of its patterns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from cxbridge.clipstext.syntax import SyntaxNode

_VARIABLE = re.compile(r"\$?\?([A-Za-z_][^\s:]*)(?::.*)?\Z")


def variables(nodes: tuple[SyntaxNode, ...]) -> frozenset[str]:
    """Return the names of the local variables in some nodes, e.g. ``x`` for ``?x`` and ``$?x``."""
    found = (_VARIABLE.match(node.text) for top in nodes for node in top.walk() if node.items is None)
    return frozenset(match[1] for match in found if match)


@dataclass(frozen=True, slots=True)
class FieldConstraint:
    """The constraint of one field of a pattern.

    :param binder: the variable it binds or repeats, as written (``?x``, ``$?x``); ``?``, ``$?`` or empty.
    :param alternatives: what is joined by ``|``, each the terms that are joined by ``&``: nodes of a term.
    :param text: as it is written, on one line.
    """

    binder: str
    alternatives: tuple[tuple[tuple[SyntaxNode, ...], ...], ...]
    text: str

    @property
    def name(self) -> str:
        """The name of the variable that it binds or repeats, empty when there is none."""
        match = _VARIABLE.match(self.binder)
        return match[1] if match else ""

    @property
    def wildcard(self) -> str:
        """What stands for any value (or values) in its place."""
        return "$?" if self.binder.startswith("$") else "?"

    @property
    def used(self) -> frozenset[str]:
        """The variables of its terms, without the binder."""
        return frozenset().union(*(variables(term) for terms in self.alternatives for term in terms))

    def loosened(self, known: frozenset[str], *, bind: bool) -> str:
        """Return its text with those terms only whose variables are all known.

        :param known: variables that have a value here.
        :param bind: whether the binder stays.
        """
        head = self.binder if bind and self.name else self.wildcard
        kept = [
            [term for term in terms if variables(term) <= known | ({self.name} if bind else set())]
            for terms in self.alternatives
        ]
        if not all(kept) or not kept:
            return head
        tests = "|".join("&".join("".join(node.text for node in term) for term in terms) for terms in kept)
        return f"{head}&{tests}" if head not in ("?", "$?") else tests


@dataclass(frozen=True, slots=True)
class SlotConstraint:
    """What a pattern says about one slot, or of one field of an ordered fact.

    :param slot: the slot; empty for an ordered fact.
    :param position: of the field of an ordered fact, from 0; 0 for a slot.
    """

    slot: str
    position: int
    fields: tuple[FieldConstraint, ...]

    @property
    def label(self) -> str:
        """What it is called: ``mode``, ``field 2``."""
        return self.slot or f"field {self.position + 1}"

    @property
    def text(self) -> str:
        """Its constraint, on one line."""
        return " ".join(field.text for field in self.fields)

    @property
    def binds(self) -> frozenset[str]:
        """The variables that appear as the first of a field."""
        return frozenset(field.name for field in self.fields if field.name)

    @property
    def used(self) -> frozenset[str]:
        """The variables that its tests need."""
        return frozenset().union(*(field.used for field in self.fields))

    def is_open(self, known: frozenset[str]) -> bool:
        """Whether any value will do.

        :param known: the variables that have a value before it.
        """
        return all(field.binder and not field.alternatives for field in self.fields) and not (
            self.binds & known or len(self.binds) < sum(bool(field.name) for field in self.fields)
        )

    def write(self, fields: list[str]) -> str:
        """Return the text of the part with these constraints in place of its own."""
        return f"({self.slot} {' '.join(fields)})" if self.slot else " ".join(fields)


@dataclass(frozen=True, slots=True)
class PatternCE:
    """A pattern CE.

    :param variable: the variable that the fact is bound to, without its ``?``; empty for none.
    """

    template: str
    variable: str
    parts: tuple[SlotConstraint, ...]
    text: str

    @property
    def binds(self) -> frozenset[str]:
        """The variables that appear as the first of a field."""
        return frozenset().union(*(part.binds for part in self.parts))

    def tested(self, known: frozenset[str]) -> list[SlotConstraint]:
        """Return the parts for which not any value will do.

        :param known: the variables that have a value before the pattern.
        """
        parts = []
        for part in self.parts:
            if not part.is_open(known):
                parts.append(part)
            known |= part.binds
        return parts

    def bare(self) -> str:
        """Return its text without the variable of the fact."""
        return self.text.split("<-", 1)[1].strip() if self.variable else self.text

    def alone(self, foreign: frozenset[str]) -> str:
        """Return the pattern without what the CEs before it say.

        :param foreign: the variables that these bind.
        """
        known: set[str] = set()
        texts = []
        for part in self.parts:
            fields = []
            for field in part.fields:
                own = field.name not in foreign
                if own and field.name:
                    known.add(field.name)
                fields.append(field.loosened(frozenset(known), bind=own))
            texts.append(part.write(fields))
        return f"({' '.join([self.template, *texts])})"

    def only(self, wanted: SlotConstraint, foreign: frozenset[str]) -> str:
        """Return the pattern with the constraint of one part, and of those before it what that one needs.

        :param foreign: the variables that the CEs before it bind.
        """
        needed = (wanted.used | wanted.binds) - foreign
        texts = []
        before = True
        for part in self.parts:
            if part is wanted:
                before = False
                texts.append(part.write([field.text for field in part.fields]))
            elif before and part.binds & needed:
                fields = [f.binder if f.name in needed else f.wildcard for f in part.fields]
                texts.append(part.write(fields))
            elif not part.slot:
                texts.append(part.write([field.wildcard for field in part.fields]))
        return f"({' '.join([self.template, *texts])})"


@dataclass(frozen=True, slots=True)
class TestCE:
    """A test CE."""

    text: str
    used: frozenset[str]


@dataclass(frozen=True, slots=True)
class GroupCE:
    """CEs in one of ``and or not exists forall``.

    :param kind: which.
    """

    kind: str
    items: tuple[PatternCE | TestCE | GroupCE, ...]
    text: str


CE = PatternCE | TestCE | GroupCE
"""A conditional element."""


class Prefix:
    """The CEs at the start of a condition; each pattern's fact has a variable.

    :ivar texts: the CEs.
    :ivar facts: the variables of the patterns' facts.
    """

    def __init__(self, ces: Sequence[CE]) -> None:
        self.texts: list[str] = []
        self.facts: list[str] = []
        self._first: dict[str, int] = {}
        for number, ce in enumerate(ces, 1):
            if not isinstance(ce, PatternCE):
                self.texts.append(ce.text)
                continue
            variable = ce.variable or f"cx-why-{number}"
            self.texts.append(f"?{variable} <- {ce.bare()}")
            self.facts.append(variable)
            for name in [*sorted(ce.binds), *([ce.variable] if ce.variable else [])]:
                self._first.setdefault(name, number)

    @property
    def binds(self) -> frozenset[str]:
        """The variables that have a value after them."""
        return frozenset(self._first)

    def origin(self, name: str) -> int:
        """Return the number of the CE that binds a variable."""
        return self._first[name]


@dataclass(frozen=True, slots=True)
class Condition:
    """The left-hand side of a rule.

    :param salience: the expression of its salience, empty when it has none.
    :param functions: what is called in it.
    :param globals: the global variables in it, without ``?*`` and ``*``.
    """

    rule: str
    salience: str
    ces: tuple[CE, ...]
    functions: frozenset[str]
    globals: frozenset[str]
