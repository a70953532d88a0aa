"""`modify` and `duplicate` of CLIPS 6.30 for users' files.

`modify` retracts a fact and asserts a new fact with a new index. As in 6.30, all values are evaluated first,
and a `modify` without changes still makes a new fact, for which rules fire again. `duplicate` asserts a
changed copy. If a single slot gets several values, 6.4's `duplicate` ends the process; here this is an error.
:mod:`cxbridge.executive.host.source` rewrites calls in users' files to these functions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from clips._clips import lib

from cxbridge.clipstext.facts import IMPLIED
from cxbridge.executive.host.capi import NULL, CData, ClipsApi, decode, encode
from cxbridge.executive.host.facts.making import FactMaker
from cxbridge.executive.host.values import FALSE, FactAddress, Value, clips_value, value_text


class Modify:
    """The implementation of ``(cx-modify FACT slot (create$ value...) ...)``.

    :cvar name: the name in messages.
    :cvar retracts: whether the changed fact is retracted.
    :param env: the environment's pointer.
    :param log_error: receives CLIPS' message about an impossible modify.
    """

    name: ClassVar = "modify"
    retracts: ClassVar = True

    def __init__(self, env: CData, api: ClipsApi, maker: FactMaker, log_error: Callable[[str], None]) -> None:
        self._env, self._api, self._maker, self._log_error = env, api, maker, log_error

    def __call__(self, fact: Value, *changes: Value) -> Value:
        """Return the new fact; FALSE if there is none, because of an error or an equal fact.

        :param changes: the name of a slot and the tuple of its values, in turn.
        """
        changed_fact = self._find_fact(fact)
        if changed_fact is None:
            return FALSE
        deftemplate = lib.FactDeftemplate(changed_fact)
        if lib.DeftemplateSlotExistP(deftemplate, encode(IMPLIED)):
            return FALSE  # an ordered fact: silently, as in 6.30
        slot_values: list[tuple[bytes, CData]] = []
        for slot, values in zip(changes[::2], changes[1::2], strict=True):
            c_name = encode(slot)
            exists = lib.DeftemplateSlotExistP(deftemplate, c_name)
            is_multislot = exists and lib.DeftemplateSlotMultiP(deftemplate, c_name)
            if not exists or (not is_multislot and len(values) != 1):
                template = decode(lib.DeftemplateName(deftemplate))
                self._fail(
                    f"The single field slot '{slot}' can only contain a single field value."
                    if exists
                    else f"Invalid slot '{slot}' not defined in corresponding deftemplate '{template}'."
                )
                return FALSE
            slot_values.append((c_name, clips_value(self._env, values if is_multislot else values[0])))
        new_fact = self._maker.make_copy(changed_fact, slot_values)
        if not self.retracts:
            asserted = self._maker.assert_fact(new_fact)
        else:
            lib.RetainFact(changed_fact)  # the new fact shares its values, which must outlive the retraction
            self._maker.is_replacing = True
            lib.Retract(changed_fact)
            self._maker.is_replacing = False
            asserted = self._maker.assert_fact(new_fact)
            lib.ReleaseFact(changed_fact)
        # CLIPS returns an equal existing fact instead of the new fact
        return FactAddress(asserted) if asserted == new_fact else FALSE

    def _find_fact(self, fact: Value) -> CData | None:
        """Return the fact of the first argument.

        The result is None for an argument that is not a present fact, after a message unless it is FALSE.
        """
        if isinstance(fact, FactAddress):
            if lib.FactExistp(fact.pointer):
                return fact.pointer
            self._fail(
                f"fact f-{lib.FactIndex(fact.pointer)} has been retracted and cannot be used by '{self.name}'"
            )
            return None
        if isinstance(fact, int):
            fact_of_index = self._maker.find_fact(fact)
            if fact_of_index == NULL:
                self._log_error(f"Unable to find fact f-{fact}.")  # the right-hand side continues, as in 6.30
                return None
            return fact_of_index
        # FALSE is the value of an earlier `modify` or `duplicate` without a new fact
        if fact != FALSE:
            self._fail(
                f"Function '{self.name}' expected a fact-address or fact-index, not {value_text(fact)}."
            )
        return None

    def _fail(self, text: str) -> None:
        """Log an error, and end the right-hand side."""
        self._log_error(text)
        self._api.halt()


class Duplicate(Modify):
    """The implementation of ``(cx-duplicate FACT slot (create$ value...) ...)``."""

    name = "duplicate"
    retracts = False
