"""Facts made from C values, without the checks of clipspy's builders.

CLIPS checks types and allowed values when it parses a construct, but not when a rule sets a slot, so that
rules can store an integer in a SYMBOL slot. The C API's ``PutFactSlot`` does check, so values that it refuses
are written directly into the fact's memory, as CLIPS' own `modify` does.
"""

from __future__ import annotations

from functools import cache

from clips._clips import ffi, lib

from cxbridge.clipstext.facts import IMPLIED
from cxbridge.executive.host.capi import EXTRA_FUNCTIONS, MULTIFIELD_TYPE, NULL, CData, encode
from cxbridge.executive.host.values import to_python

_POINTER_BYTES = 8
_SEARCHED_BYTES = 512  # the part of a fact's struct in which contents_offset() searches


@cache
def contents_offset() -> int:
    """Return the offset of the slot values in a ``Fact``, in bytes.

    :raises RuntimeError: if the offset is not found, in an unknown build of CLIPS.
    """
    # the offset depends on the build of CLIPS, so it is searched in a fact with known values
    env = lib.CreateEnvironment()
    try:
        lib.Build(env, b"(deftemplate probe (slot a) (slot b))")
        fact = EXTRA_FUNCTIONS.CreateFact(lib.FindDeftemplate(env, b"probe"))
        marks = []
        for slot in (b"a", b"b"):
            value = ffi.new("CLIPSValue *")
            value.value = lib.CreateSymbol(env, b"mark-of-slot-" + slot)
            EXTRA_FUNCTIONS.PutFactSlot(fact, slot, value)
            marks.append(int(ffi.cast("intptr_t", value.value)))
        words = ffi.cast("intptr_t *", fact)
        for index in range(_SEARCHED_BYTES // _POINTER_BYTES):
            if [words[index], words[index + 1]] == marks:
                EXTRA_FUNCTIONS.ReturnFact(env, fact)
                return index * _POINTER_BYTES
    finally:
        lib.DestroyEnvironment(env)
    raise RuntimeError("this build of CLIPS lays out facts in an unknown way")


class FactMaker:
    """Makes and asserts facts of one environment.

    :param env: the environment's pointer.
    """

    def __init__(self, env: CData) -> None:
        self._env = env
        self.is_replacing = False
        """Whether a ``modify`` is retracting a fact that it replaces by a new fact."""

    def make_copy(self, fact: CData, changes: list[tuple[bytes, CData]]) -> CData:
        """Make a modified copy of a fact without asserting it.

        :param changes: slot names and pointers to CLIPSValues (a multifield for multislots).
        :raises KeyError: the slot, if the deftemplate lacks it, a single slot would get a multifield, or a
            multislot a single value.
        """
        new_fact = EXTRA_FUNCTIONS.CreateFact(lib.FactDeftemplate(fact))
        EXTRA_FUNCTIONS.CopyFactSlotValues(self._env, new_fact, fact)
        self._set_slots(new_fact, changes)
        return new_fact

    def make_fact(self, deftemplate: CData, values: list[tuple[bytes, CData]]) -> CData:
        """Make a fact with default values for missing slots, without asserting it.

        :param values: slot names and pointers to CLIPSValues; NULL names the fields of an ordered fact.
        :raises KeyError: as in :meth:`make_copy`.
        """
        new_fact = EXTRA_FUNCTIONS.CreateFact(deftemplate)
        self._set_slots(new_fact, values)
        EXTRA_FUNCTIONS.AssignFactSlotDefaults(new_fact)
        return new_fact

    def assert_fact(self, new_fact: CData) -> CData:
        """Assert a fact from :meth:`make_copy` or :meth:`make_fact`; return NULL if CLIPS refuses it."""
        return EXTRA_FUNCTIONS.Assert(new_fact)

    def find_fact(self, index: int) -> CData:
        """Return the fact with this index, or NULL."""
        return EXTRA_FUNCTIONS.FindIndexedFact(self._env, index)

    def _set_slots(self, new_fact: CData, values: list[tuple[bytes, CData]]) -> None:
        """Set slots of a fact.

        :raises KeyError: as in :meth:`make_copy`; the fact's memory is then freed.
        """
        for slot, value in values:
            if not EXTRA_FUNCTIONS.PutFactSlot(new_fact, slot, value) and not self._force_slot(
                new_fact, slot, value
            ):
                EXTRA_FUNCTIONS.ReturnFact(self._env, new_fact)
                raise KeyError(IMPLIED if slot == NULL else slot.decode())

    def _force_slot(self, new_fact: CData, slot: bytes, value: CData) -> bool:
        """Write a value that the slot's constraints forbid; return False if the slot cannot hold it."""
        if slot == NULL:
            return False
        deftemplate = lib.FactDeftemplate(new_fact)
        names = ffi.new("CLIPSValue *")
        lib.DeftemplateSlotNames(deftemplate, names)
        slots = [encode(str(name)) for name in to_python(names)]
        is_multifield = value.header.type == MULTIFIELD_TYPE
        if slot not in slots or is_multifield != bool(lib.DeftemplateSlotMultiP(deftemplate, slot)):
            return False
        contents = ffi.cast("CLIPSValue *", ffi.cast("char *", new_fact) + contents_offset())
        slot_value = contents + slots.index(slot)
        if is_multifield:  # a fact owns its multifields, while atoms are shared
            EXTRA_FUNCTIONS.ReturnMultifield(self._env, slot_value.multifieldValue)
            slot_value.multifieldValue = EXTRA_FUNCTIONS.CopyMultifield(self._env, value.multifieldValue)
        else:
            slot_value.value = value.value
        return True
