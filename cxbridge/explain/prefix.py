"""The CEs before one that is looked at, and facts as they are shown."""

from __future__ import annotations

from collections.abc import Collection

from cxbridge.executive.host.values import Value, show
from cxbridge.explain.lhs import CE, Pattern, variables
from cxbridge.explain.sexpr import read
from cxbridge.explain.snapshot import FactRow, Snapshot

_LONGEST = 200
_NAMES = {"id", "name"}
"""Slots that tell which fact it is."""


class Prefix:
    """CEs at the begin of a condition; each pattern's fact has a variable.

    :ivar texts: the CEs.
    :ivar facts: the variables of the patterns' facts.
    :ivar binds: all variables that have a value after them.
    """

    def __init__(self, ces: list[CE]) -> None:
        self.texts: list[str] = []
        self.facts: list[str] = []
        self._first: dict[str, int] = {}
        for number, ce in enumerate(ces, 1):
            if not isinstance(ce, Pattern):
                self.texts.append(ce.text)
                continue
            variable = ce.variable or f"cx-why-{number}"
            self.texts.append(f"?{variable} <- {ce.bare()}")
            self.facts.append(variable)
            for name in [*sorted(ce.binds), *([ce.variable] if ce.variable else [])]:
                self._first.setdefault(name, number)

    @property
    def binds(self) -> frozenset[str]:
        """The variables that have a value."""
        return frozenset(self._first)

    def origin(self, name: str) -> int:
        """Return the number of the CE that binds a variable."""
        return self._first[name]


def shown(value: Value) -> str:
    """Return a value as CLIPS prints it; several in parentheses."""
    return f"({show(value)})" if isinstance(value, tuple) else show(value)


def fact_text(row: FactRow, snapshot: Snapshot, wanted: Collection[str] = ()) -> str:
    """Return a fact with its index: these slots of it and those that tell which it is; all without any."""
    slots = snapshot.templates[row.template].slots
    if slots is None:
        text = f"({' '.join([row.template, *map(show, row.values[0])])})"
    else:
        parts = [
            f" ({name}{' ' if value != () else ''}{show(value)})"
            for (name, _), value in zip(slots, row.values, strict=True)
            if not wanted or name in wanted or name in _NAMES
        ]
        left_out = " ..." if wanted and len(parts) < len(slots) else ""
        text = f"({row.template}{''.join(parts)}{left_out})"
    if len(text) > _LONGEST:
        text = f"{text[: _LONGEST - 5]} ...)"
    return f"f-{row.index} {text}"


def value_of(row: FactRow, snapshot: Snapshot, slot: str, position: int) -> str:
    """Return the value of a slot, or of a field of an ordered fact, as it is shown."""
    slots = snapshot.templates[row.template].slots
    if slots is None:
        fields = row.values[0]
        return shown(fields[position]) if position < len(fields) else "missing"
    for (name, _), value in zip(slots, row.values, strict=True):
        if name == slot:
            return shown(value)
    return "missing"


def names_in(text: str) -> frozenset[str]:
    """Return the variables in CLIPS text."""
    return variables(tuple(read(text)))
