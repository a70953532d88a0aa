"""Copies of many facts for clients, in small pieces, so that rules do not wait long.

Slot values are read from the facts' memory: ``GetFactSlot`` would make copies of 10,000 facts noticeably
slow.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Final

from clips._clips import ffi, lib
from msgspec import Struct, field

from cxbridge.clipstext.facts import IMPLIED
from cxbridge.clipstext.values import FactRef
from cxbridge.executive.host.capi import MULTIFIELD_TYPE, NULL, CData, decode, encode, items_of
from cxbridge.executive.host.facts.making import contents_offset
from cxbridge.executive.host.values import FactAddress, Value, to_python

PIECE_SIZE: Final = 100
"""The default number of facts in a piece, after which the caller may let rules run."""

_WORDS: Final = ffi.typeof("intptr_t *")
_WORD_BYTES: Final = ffi.sizeof("intptr_t")
_POINTER: Final = ffi.typeof("void *")


class FactTemplate(Struct, frozen=True):
    """A deftemplate.

    :param slots: names, and whether each is a multislot; None for ordered facts.
    """

    name: str
    slots: tuple[tuple[str, bool], ...] | None

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the slots; ``implied`` for an ordered fact."""
        return (IMPLIED,) if self.slots is None else tuple(name for name, _ in self.slots)

    def slots_of(self, row: FactRow) -> dict[str, Value]:
        """Return the values of a fact of this deftemplate, by slot."""
        return dict(zip(self.names, row.values, strict=True))


class FactRow(Struct, frozen=True):
    """A fact.

    :param values: the slot values in order; an ordered fact has a single tuple.
    """

    index: int
    template: str
    values: tuple[Value, ...]


class FactCopy(Struct):
    """Facts in the order of CLIPS' list, with their deftemplates."""

    templates: dict[str, FactTemplate] = field(default_factory=dict)
    rows: list[FactRow] = field(default_factory=list)

    def facts_of(self, template: str) -> Iterator[Mapping[str, Value]]:
        """Yield the slots of a deftemplate's facts."""
        for row in self.rows:
            if row.template == template:
                yield self.templates[template].slots_of(row)


def template_of(pointer: CData) -> FactTemplate:
    """Return the name and the slots of a ``Deftemplate *``."""
    value = ffi.new("CLIPSValue *")
    lib.DeftemplateSlotNames(pointer, value)
    names = [str(name) for name in to_python(value)]
    slots = tuple((name, bool(lib.DeftemplateSlotMultiP(pointer, encode(name)))) for name in names)
    return FactTemplate(decode(lib.DeftemplateName(pointer)), None if names == [IMPLIED] else slots)


class FactCopier:
    """Copies facts in pieces. The copy contains each fact that exists at the end, and no retracted fact.

    If rules have run between two pieces, a fact has the slots that it had when its piece was copied.

    :param env: the environment's pointer.
    :param is_wanted: returns whether a deftemplate's facts are copied.
    :param piece_size: the number of facts in a piece.
    """

    def __init__(
        self,
        env: CData,
        is_wanted: Callable[[str], bool],
        piece_size: int = PIECE_SIZE,
    ) -> None:
        self._env, self._is_wanted, self._piece_size = env, is_wanted, piece_size
        self._values: dict[int, Value] = {}  # by address: CLIPS shares equal atoms
        self._clips_value = ffi.new("CLIPSValue *")
        # by pointer: deftemplate and number of slots; None for an unwanted deftemplate
        self._templates: dict[CData, tuple[FactTemplate, int] | None] = {}
        self._first_word = contents_offset() // _WORD_BYTES
        self.copy = FactCopy()
        """The facts copied so far."""

    def pieces(self) -> Iterator[None]:
        """Copy a piece before each ``yield``. The environment must be locked while the iterator advances."""
        env = self._env
        copied: set[int] = set()
        fact = lib.GetNextFact(env, NULL)
        visited = 0
        while fact != NULL:
            index = int(lib.FactIndex(fact))
            if index not in copied:
                copied.add(index)
                self.add(fact)
            visited += 1
            if visited % self._piece_size == 0:
                lib.RetainFact(fact)  # otherwise CLIPS could reuse the fact's memory
                yield
                self._clear_caches()
                # a retracted fact has no successor: after its retraction, all facts are visited again
                following = lib.GetNextFact(env, fact if lib.FactExistp(fact) else NULL)
                lib.ReleaseFact(fact)
                fact = following
            else:
                fact = lib.GetNextFact(env, fact)
        # rules could retract facts only between two pieces
        if visited >= self._piece_size:
            self._drop_retracted()

    def _clear_caches(self) -> None:
        """Clear caches that rules may have invalidated."""
        self._values.clear()
        self._templates.clear()

    def add(self, fact: CData) -> None:
        """Copy a fact if its deftemplate is wanted."""
        deftemplate = lib.FactDeftemplate(fact)
        if deftemplate not in self._templates:
            template = template_of(deftemplate)
            self._templates[deftemplate] = (
                (template, len(template.names)) if self._is_wanted(template.name) else None
            )
        template_and_count = self._templates[deftemplate]
        if template_and_count is None:
            return
        template, slot_count = template_and_count
        self.copy.templates[template.name] = template
        values = self._read_values(ffi.cast(_WORDS, fact) + self._first_word, slot_count)
        self.copy.rows.append(FactRow(int(lib.FactIndex(fact)), template.name, values))

    def _read_values(self, words: CData, count: int) -> tuple[Value, ...]:
        """Return the values of adjacent ``CLIPSValue`` structs."""
        # the cache itself marks a missing value, because None is the value of void
        cache, values = self._values, []
        for word in ffi.unpack(words, count):
            value = cache.get(word, cache)
            values.append(self._read_value(word) if value is cache else value)
        return tuple(values)

    def _read_value(self, word: int) -> Value:
        """Return the value of a ``CLIPSValue``, given the address that the struct holds."""
        clips_value = self._clips_value
        clips_value.value = ffi.cast(_POINTER, word)
        if clips_value.header.type == MULTIFIELD_TYPE:
            multifield = clips_value.multifieldValue
            return self._read_values(ffi.cast(_WORDS, multifield.contents), multifield.length)
        value = to_python(clips_value)
        if isinstance(value, FactAddress):
            value = FactRef(int(lib.FactIndex(value.pointer)))
        self._values[word] = value
        return value

    def _drop_retracted(self) -> None:
        """Remove facts that were retracted after they had been copied."""
        present = {int(lib.FactIndex(fact)) for fact in items_of(lib.GetNextFact, self._env)}
        self.copy.rows = [row for row in self.copy.rows if row.index in present]
