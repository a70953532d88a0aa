"""`modify` as CLIPS 6.30 does it, for users' files on CLIPS 6.4: retract, then assert anew with a new index.

The values are all evaluated before the old fact goes, as in 6.30; a modify that changes nothing still makes a
new fact, for which rules fire again. :mod:`cxbridge.executive.source` turns each ``modify`` of a user's file
into a call of this function.
"""

from __future__ import annotations

from collections.abc import Callable

from clips._clips import lib

from cxbridge.executive.capi import NULL, CData, ClipsApi, decode, encode
from cxbridge.executive.factmaking import FactMaker
from cxbridge.executive.values import FALSE, FactAddress, Symbol, Value, clips_value, show

Complain = Callable[[str], None]


class Modify:
    """The function behind ``(cx-modify FACT slot (create$ value...) ...)``.

    :param env: the environment's pointer.
    :param complain: told, in CLIPS' words, why a modify cannot be done; the right-hand side then ends.
    """

    def __init__(self, env: CData, api: ClipsApi, facts: FactMaker, complain: Complain) -> None:
        self._env = env
        self._api = api
        self._facts = facts
        self._complain = complain
        self._multislots: dict[tuple[str, str], bool] = {}

    def __call__(self, fact: Value, *changes: Value) -> Value:
        """Do it; returns the new fact, or FALSE when there is nothing to modify."""
        old = self._find(fact)
        if old is None:
            return FALSE
        deftemplate = lib.FactDeftemplate(old)
        slots: list[tuple[bytes, CData]] = []
        for slot, values in zip(changes[::2], changes[1::2], strict=True):
            value = self._slot_value(deftemplate, slot, values)
            if value is None:
                return FALSE
            slots.append((encode(slot), value))
        new = self._facts.copy(old, slots)
        lib.RetainFact(old)  # its values are the new one's, too: they must outlive the retraction
        lib.Retract(old)
        asserted = self._facts.add(new)
        lib.ReleaseFact(old)
        return FALSE if asserted == NULL else FactAddress(asserted)

    def _find(self, fact: Value) -> CData | None:
        """Return the fact that the first argument names, or None after a complaint."""
        if isinstance(fact, FactAddress):
            if lib.FactExistp(fact.pointer):
                return fact.pointer
            self._fail(f"fact f-{lib.FactIndex(fact.pointer)} has been retracted and cannot be modified")
            return None
        if isinstance(fact, int):
            found = self._facts.find(fact)
            if found == NULL:
                self._fail(f"Unable to find fact f-{fact}.")
                return None
            return found
        if fact != FALSE:
            self._fail(f"Function 'modify' expected a fact-address or fact-index, not {show(fact)}.")
        return None

    def _slot_value(self, deftemplate: CData, slot: Symbol, values: tuple[Value, ...]) -> CData | None:
        """Return what goes into the slot, or None after a complaint."""
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
