"""`modify` and `duplicate` of CLIPS 6.30 for users' files.

`modify` retracts a fact and asserts a new one with a new index. As in 6.30, all values are evaluated first,
and a modify without changes still makes a new fact, for which rules fire again. 6.4's `duplicate` ends the
process if a single slot gets several values; here this is an error. :mod:`cxbridge.executive.host.source`
rewrites calls in users' files to these functions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Final

from clips._clips import ffi, lib

from cxbridge.executive.host.capi import NULL, CData, ClipsApi, decode, encode
from cxbridge.executive.host.facts.making import FactMaker
from cxbridge.executive.host.values import FALSE, FactAddress, Symbol, Value, clips_value, show, to_python

_IMPLIED: Final = "implied"

Complain = Callable[[str], None]


class Modify:
    """The implementation of ``(cx-modify FACT slot (create$ value...) ...)``.

    :cvar name: the name in messages.
    :cvar retracts: whether the old fact is retracted.
    :param env: the environment's pointer.
    :param complain: receives CLIPS' message about an impossible modify. The right-hand side then ends.
    """

    name: ClassVar = "modify"
    retracts: ClassVar = True

    def __init__(self, env: CData, api: ClipsApi, facts: FactMaker, complain: Complain) -> None:
        self._env = env
        self._api = api
        self._facts = facts
        self._complain = complain
        self._ordered: dict[str, bool] = {}
        self._multislots: dict[tuple[str, str], bool] = {}

    def __call__(self, fact: Value, *changes: Value) -> Value:
        """Return the new fact; FALSE without an old fact, or if a fact like the new one exists."""
        old = self._find(fact)
        if old is None:
            return FALSE
        deftemplate = lib.FactDeftemplate(old)
        if self._is_ordered(deftemplate):
            return FALSE  # silently, as in 6.30
        slots: list[tuple[bytes, CData]] = []
        for slot, values in zip(changes[::2], changes[1::2], strict=True):
            value = self._slot_value(deftemplate, slot, values)
            if value is None:
                return FALSE
            slots.append((encode(slot), value))
        new = self._facts.copy(old, slots)
        if not self.retracts:
            asserted = self._facts.add(new)
        else:
            lib.RetainFact(old)  # the new fact shares its values, which must outlive the retraction
            self._facts.replaces = True
            lib.Retract(old)
            self._facts.replaces = False
            asserted = self._facts.add(new)
            lib.ReleaseFact(old)
        # CLIPS returns the equal fact when there is one
        return FactAddress(asserted) if asserted == new else FALSE

    def _find(self, fact: Value) -> CData | None:
        """Return the fact of the first argument; None after a complaint."""
        if isinstance(fact, FactAddress):
            if lib.FactExistp(fact.pointer):
                return fact.pointer
            self._fail(
                f"fact f-{lib.FactIndex(fact.pointer)} has been retracted and cannot be used by '{self.name}'"
            )
            return None
        if isinstance(fact, int):
            found = self._facts.find(fact)
            if found == NULL:
                self._complain(f"Unable to find fact f-{fact}.")  # the right-hand side continues, as in 6.30
                return None
            return found
        if fact != FALSE:
            self._fail(f"Function '{self.name}' expected a fact-address or fact-index, not {show(fact)}.")
        return None

    def _is_ordered(self, deftemplate: CData) -> bool:
        template = decode(lib.DeftemplateName(deftemplate))
        if template not in self._ordered:
            names = ffi.new("CLIPSValue *")
            lib.DeftemplateSlotNames(deftemplate, names)
            self._ordered[template] = to_python(names) == (_IMPLIED,)
        return self._ordered[template]

    def _slot_value(self, deftemplate: CData, slot: Symbol, values: tuple[Value, ...]) -> CData | None:
        template = decode(lib.DeftemplateName(deftemplate))
        key = (template, slot)
        if key not in self._multislots:
            if not lib.DeftemplateSlotExistP(deftemplate, encode(slot)):
                self._fail(f"Invalid slot '{slot}' not defined in corresponding deftemplate '{template}'.")
                return None
            self._multislots[key] = bool(lib.DeftemplateSlotMultiP(deftemplate, encode(slot)))
        if self._multislots[key]:
            return clips_value(self._env, values)
        if len(values) != 1:
            self._fail(f"The single field slot '{slot}' can only contain a single field value.")
            return None
        return clips_value(self._env, values[0])

    def _fail(self, text: str) -> None:
        self._complain(text)
        self._api.halt()


class Duplicate(Modify):
    """The implementation of ``(cx-duplicate FACT slot (create$ value...) ...)``."""

    name = "duplicate"
    retracts = False
