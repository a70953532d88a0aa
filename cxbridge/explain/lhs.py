"""The condition of a rule: its elements (CEs), and the parts of its patterns."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from cxbridge.errors import ClipsError
from cxbridge.explain.sexpr import Node, one_line, read

_VARIABLE = re.compile(r"\$?\?([A-Za-z_][^\s:]*)(?::.*)?\Z")
_GLOBAL = re.compile(r"\?\*(.+)\*\Z")
_GROUPS = ("and", "or", "not", "exists", "forall", "logical")
_IMPLIED = "implied"


def variables(nodes: tuple[Node, ...]) -> frozenset[str]:
    """Return the names of the local variables in some nodes, e.g. ``x`` for ``?x`` and ``$?x``."""
    found = (_VARIABLE.match(node.text) for top in nodes for node in top.walk() if node.items is None)
    return frozenset(match[1] for match in found if match)


@dataclass(frozen=True, slots=True)
class Field:
    """The constraint of one field of a pattern.

    :param binder: the variable it binds or repeats, as written (``?x``, ``$?x``); ``?``, ``$?`` or empty.
    :param alternatives: what is joined by ``|``, each the terms that are joined by ``&``: nodes of a term.
    :param text: as it is written, on one line.
    """

    binder: str
    alternatives: tuple[tuple[tuple[Node, ...], ...], ...]
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
class Part:
    """What a pattern says of one slot, or of one field of an ordered fact.

    :param slot: the slot; empty for an ordered fact.
    :param position: of the field of an ordered fact, from 0; 0 for a slot.
    """

    slot: str
    position: int
    fields: tuple[Field, ...]

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
class Pattern:
    """A pattern CE.

    :param variable: the variable that the fact is bound to, without its ``?``; empty for none.
    """

    template: str
    variable: str
    parts: tuple[Part, ...]
    text: str

    @property
    def ordered(self) -> bool:
        """Whether it is a pattern for ordered facts."""
        return all(not part.slot for part in self.parts)

    @property
    def binds(self) -> frozenset[str]:
        """The variables that appear as the first of a field."""
        return frozenset().union(*(part.binds for part in self.parts))

    def tested(self, known: frozenset[str]) -> list[Part]:
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

    def only(self, wanted: Part, foreign: frozenset[str]) -> str:
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
class Test:
    """A test CE."""

    text: str
    used: frozenset[str]


@dataclass(frozen=True, slots=True)
class Group:
    """CEs in one of ``and or not exists forall``.

    :param kind: which.
    """

    kind: str
    items: tuple[Pattern | Test | Group, ...]
    text: str


CE = Pattern | Test | Group
"""A conditional element."""


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


def parse_rule(text: str) -> Condition:
    """Parse a defrule.

    :raises ClipsError: when it is none.
    """
    nodes = read(text)
    if len(nodes) != 1 or nodes[0].head != "defrule" or len(nodes[0].items or ()) < 2:  # noqa: PLR2004
        raise ClipsError("this is no defrule")
    items = list(nodes[0].items or ())
    name = items[1].text.rpartition("::")[2]
    items = items[2:]
    if items and items[0].text.startswith('"'):
        items = items[1:]
    arrow = next((place for place, node in enumerate(items) if node.text == "=>"), None)
    if arrow is None:
        raise ClipsError(f"the rule {name} has no =>")
    items = items[:arrow]
    salience = ""
    if items and items[0].head == "declare":
        for entry in items[0].items or ():
            if entry.head == "salience" and entry.items and len(entry.items) > 1:
                salience = one_line(entry.items[1].text)
        used: tuple[Node, ...] = tuple(items)
        items = items[1:]
    else:
        used = tuple(items)
    try:
        ces = tuple(_elements(items))
    except RecursionError:
        raise ClipsError(f"the condition of {name} is nested too deep") from None
    return Condition(name, salience, ces, called(used), named_globals(used))


def called(nodes: tuple[Node, ...]) -> frozenset[str]:
    """Return all words that stand first in a list: functions, among others."""
    return frozenset(node.head for top in nodes for node in top.walk() if node.head)


def named_globals(nodes: tuple[Node, ...]) -> frozenset[str]:
    """Return the names of the global variables in some nodes."""
    found = (_GLOBAL.match(node.text) for top in nodes for node in top.walk() if node.items is None)
    return frozenset(match[1] for match in found if match)


def patterns(ces: tuple[CE, ...]) -> Iterator[Pattern]:
    """Yield all patterns, those within groups, too."""
    for ce in ces:
        if isinstance(ce, Pattern):
            yield ce
        elif isinstance(ce, Group):
            yield from patterns(ce.items)


def _elements(items: list[Node]) -> Iterator[CE]:
    """Yield the CEs of a list; ``and`` and ``logical`` are gone."""
    place = 0
    while place < len(items):
        node = items[place]
        if node.items is None and _binds(items, place):
            pattern = _pattern(items[place + 2], node.text.lstrip("$?"))
            yield pattern
            place += 3
            continue
        place += 1
        if node.items is None:
            continue
        if node.head in ("and", "logical"):
            yield from _elements(list(node.items[1:]))
        elif node.head == "test":
            yield Test(one_line(node.text), variables(node.items[1:]))
        elif node.head in _GROUPS:
            yield _group(node)
        else:
            yield _pattern(node, "")


def _binds(items: Sequence[Node], place: int) -> bool:
    """Whether a variable for the fact of a pattern stands at a place: ``?f <- (...)``."""
    return place + 2 < len(items) and items[place + 1].text == "<-" and items[place + 2].items is not None


def _group(node: Node) -> Group:
    assert node.items is not None
    if node.head != "or":
        return Group(node.head, tuple(_elements(list(node.items[1:]))), one_line(node.text))
    branches: list[CE] = []
    for item in _joined_bindings(node.items[1:]):
        ces = tuple(_elements(list(item)))
        text = one_line(" ".join(part.text for part in item))
        branches.append(ces[0] if len(ces) == 1 else Group("and", ces, text))
    return Group("or", tuple(branches), one_line(node.text))


def _joined_bindings(items: tuple[Node, ...]) -> Iterator[tuple[Node, ...]]:
    """Yield the elements of an ``or``; ``?f <- (...)`` is one."""
    place = 0
    while place < len(items):
        length = 3 if _binds(items, place) else 1
        yield items[place : place + length]
        place += length


def _pattern(node: Node, variable: str) -> Pattern:
    assert node.items is not None
    rest = node.items[1:]
    if rest and all(item.items is not None for item in rest):
        parts = [Part(item.head, 0, tuple(_fields((item.items or ())[1:]))) for item in rest]
    else:
        parts = [Part("", place, (field,)) for place, field in enumerate(_fields(rest))]
    text = one_line(node.text)
    return Pattern(node.head, variable, tuple(parts), f"?{variable} <- {text}" if variable else text)


def _fields(nodes: tuple[Node, ...]) -> Iterator[Field]:
    """Yield the fields of a slot or an ordered pattern: ``& | ~ : =`` tie nodes together."""
    group: list[Node] = []
    tied = True
    for node in nodes:
        mark = node.text in ("&", "|")
        if group and not mark and not tied:
            yield _field(group)
            group = []
        group.append(node)
        tied = mark or node.text in ("~", ":", "=")
    if group:
        yield _field(group)


def _field(nodes: list[Node]) -> Field:
    text = one_line("".join(node.text for node in nodes))
    first = nodes[0].text
    binder = first if first.startswith(("?", "$?")) and not _GLOBAL.match(first) else ""
    if binder and len(nodes) > 1 and nodes[1].text == "|":
        binder = ""
    rest = nodes[2:] if binder else nodes
    alternatives: list[list[list[Node]]] = [[[]]]
    for node in rest:
        if node.text == "|":
            alternatives.append([[]])
        elif node.text == "&":
            alternatives[-1].append([])
        else:
            alternatives[-1][-1].append(node)
    made = tuple(tuple(tuple(term) for term in terms if term) for terms in alternatives)
    return Field(binder, tuple(terms for terms in made if terms), text)
