"""A rule with all that it is matched with at one moment, and the rules there are: values, no pointers.

It comes from an environment (:mod:`.environment`) or from a recording (:mod:`..recorded`), and
is the whole input of :mod:`.diagnose`: the run can continue at the same time.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Final

from cxbridge.clipstext.facts import IMPLIED, fact_text
from cxbridge.clipstext.values import FactRef, Value, show_alone
from cxbridge.executive.host.facts.copying import FactRow, FactTemplate
from cxbridge.executive.host.loading import Diagnostic

__all__ = ["MAX_FACTS", "FactRef", "FactRow", "FactTemplate", "Rulebook", "Snapshot", "Waiting"]

MAX_FACTS: Final = 50_000
"""Facts of a rule's templates that are copied; with more there are only CLIPS' own counts."""

_LONGEST: Final = 200
_NAMES: Final = ("id", "name")
"""Slots that identify a fact."""


@dataclass(frozen=True, slots=True)
class Waiting:
    """An activation on the agenda.

    :param basis: the facts, as CLIPS prints them: ``f-1,*``.
    """

    rule: str
    salience: int
    basis: str


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A rule, and its facts.

    :param text: the defrule.
    :param functions: the deffunctions that its condition uses, called ones first.
    :param global_texts: the expressions of global variables whose values are not known, in their order.
    :param agenda: the first activations, in order; None when it is not known.
    :param own_counts: the answer of CLIPS' ``(matches RULE succinct)``; empty without one.
    :param too_many: facts there are, when they were too many to copy; else 0.
    :param all_facts: whether the condition may ask for facts of any template, by a function.
    :param halted: why no rule fires any more; empty as long as they do.
    """

    env: str
    time_us: int
    text: str
    templates: Mapping[str, FactTemplate]
    facts: tuple[FactRow, ...]
    functions: tuple[str, ...] = ()
    globals: Mapping[str, Value] = field(default_factory=dict)
    global_texts: Mapping[str, str] = field(default_factory=dict)
    agenda: tuple[Waiting, ...] | None = None
    own_counts: tuple[str, ...] = ()
    too_many: int = 0
    all_facts: bool = False
    halted: str = ""

    @property
    def activations(self) -> int | None:
        """How many activations of the rule are on the agenda; None when that is not known."""
        for line in self.own_counts:
            name, _, number = line.partition(": ")
            if name == "Activations":
                return int(number)
        return None

    def fact_text(self, row: FactRow, wanted: Collection[str] = ()) -> str:
        """Return a fact with its index, as people read it.

        :param wanted: the slots that are shown, besides those that identify the fact; all without any.
        """
        template = self.templates[row.template]
        slots = template.slots_of(row)
        shown = {
            name: value for name, value in slots.items() if not wanted or name in (*wanted, *_NAMES, IMPLIED)
        }
        text = fact_text(row.template, shown)
        if len(shown) < len(slots):
            text = f"{text[:-1]} ...)"
        if len(text) > _LONGEST:
            text = f"{text[: _LONGEST - 5]} ...)"
        return f"f-{row.index} {text}"

    def value_text(self, row: FactRow, slot: str, position: int) -> str:
        """Return the value of a slot, or of a field of an ordered fact, as people read it."""
        template = self.templates[row.template]
        if template.slots is None:
            fields = row.values[0]
            return show_alone(fields[position]) if position < len(fields) else "missing"
        slots = template.slots_of(row)
        return show_alone(slots[slot]) if slot in slots else "missing"


@dataclass(frozen=True, slots=True)
class Rulebook:
    """The rules of an environment, and the reasons of missing ones.

    :param rules: names.
    :param files: the files that were loaded, in order.
    :param diagnostics: their mistakes.
    :param folders: where the agent's files are, loaded or not.
    :param places: file and line of rules, where they are known without looking into the files.
    :param refused: the texts of rules that were refused, where they are known without looking into the files.
    """

    rules: frozenset[str]
    files: tuple[str, ...]
    diagnostics: tuple[Diagnostic, ...] = ()
    folders: tuple[str, ...] = ()
    places: Mapping[str, tuple[str, int]] = field(default_factory=dict)
    refused: Mapping[str, str] = field(default_factory=dict)
