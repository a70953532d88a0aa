"""A rule with the facts to match at one moment, and the rules of an environment: values without pointers.

Snapshots come from an environment (:mod:`.environment`) or from a recording (:mod:`..recorded`). They are the
only input of :mod:`.diagnoser`, so the run can continue during the diagnosis.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Final

from cxbridge.clipstext.facts import IMPLIED, fact_text
from cxbridge.clipstext.values import Value, lone_value_text
from cxbridge.executive.host.facts.copying import FactRow, FactTemplate
from cxbridge.executive.host.loading import Diagnostic

# The limit of copied facts: copying as many stops the loop of a daemon for about 0.5 s. Beyond the limit, a
# report has only CLIPS' own counts; of a recording, it has none.
MAX_FACTS: Final = 50_000

_MAX_FACT_LENGTH: Final = 200  # limit of the characters that a report shows of a fact
_ELLIPSIS: Final = " ...)"  # the end of a shortened fact
_IDENTIFYING_SLOTS: Final = ("id", "name")  # slots by which a user recognises a fact


@dataclass(frozen=True, slots=True)
class Activation:
    """An activation on the agenda.

    :param basis: the facts in CLIPS' notation ``f-1,*``, with ``*`` for a CE without a fact.
    """

    rule: str
    salience: int
    basis: str


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A rule and its facts.

    :param text: the defrule.
    :param templates: the deftemplates of the facts, by name.
    :param functions: the texts of the deffunctions that its condition calls, directly or not; callees first.
    :param globals: the values of global variables.
    :param global_texts: the expressions of global variables with unknown values, in the order of definition.
    :param agenda: the first activations in order; None if unknown.
    :param clips_counts: the output lines of CLIPS' ``(matches RULE succinct)``; empty if unavailable.
    :param uncopied_count: the number of facts if there are too many to copy, else 0; the count ends at the
        first fact beyond the limit.
    :param needs_all_facts: whether a function in the condition may query facts of any template.
    """

    env: str
    time_us: int
    text: str
    templates: Mapping[str, FactTemplate]
    facts: tuple[FactRow, ...]
    functions: tuple[str, ...] = ()
    globals: Mapping[str, Value] = field(default_factory=dict)
    global_texts: Mapping[str, str] = field(default_factory=dict)
    agenda: tuple[Activation, ...] | None = None
    clips_counts: tuple[str, ...] = ()
    uncopied_count: int = 0
    needs_all_facts: bool = False

    @property
    def activation_count(self) -> int | None:
        """The number of the rule's activations on the agenda; None if unknown."""
        counts = (line.rpartition("Activations: ") for line in self.clips_counts)
        return next((int(number) for _, label, number in counts if label), None)

    def fact_text(self, row: FactRow, slot_names: Collection[str] = ()) -> str:
        """Return a fact with its index as text.

        :param slot_names: the slots to show besides the identifying slots; empty for all slots.
        """
        slots = self.templates[row.template].slots_of(row)
        selected_slots = {
            name: value
            for name, value in slots.items()
            if not slot_names or name in (*slot_names, *_IDENTIFYING_SLOTS, IMPLIED)
        }
        text = fact_text(row.template, selected_slots)
        if len(selected_slots) < len(slots):
            text = text[:-1] + _ELLIPSIS
        if len(text) > _MAX_FACT_LENGTH:
            text = text[: _MAX_FACT_LENGTH - len(_ELLIPSIS)] + _ELLIPSIS
        return f"f-{row.index} {text}"

    def value_text(self, row: FactRow, slot: str, position: int) -> str:
        """Return the value of a slot as text; ``missing`` if the fact lacks the slot or the field.

        :param position: the index of the field, which counts instead of the slot in an ordered fact.
        """
        template = self.templates[row.template]
        if template.slots is None:
            fields = row.values[0]
            return lone_value_text(fields[position]) if position < len(fields) else "missing"
        slots = template.slots_of(row)
        return lone_value_text(slots[slot]) if slot in slots else "missing"


@dataclass(frozen=True, slots=True)
class Rulebook:
    """The names of an environment's rules, and data about missing rules.

    :param files: the loaded files, in order.
    :param diagnostics: CLIPS' messages about the files.
    :param folders: the folders of the agent's files, which may contain further files.
    :param positions: the file and line of each rule, if known without reading files.
    :param refused_texts: the texts of refused rules by name, if known without reading files.
    """

    rules: frozenset[str]
    files: tuple[str, ...]
    diagnostics: tuple[Diagnostic, ...] = ()
    folders: tuple[str, ...] = ()
    positions: Mapping[str, tuple[str, int]] = field(default_factory=dict)
    refused_texts: Mapping[str, str] = field(default_factory=dict)
