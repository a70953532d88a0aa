"""`fact-existp` by index, without a walk through all facts.

Fawkes' core keeps facts' indices in slots, and asks in conditions whether they exist, for each goal and in
each loop. CLIPS looks for an index in the list of all facts. Here the facts that were found once are held.
"""

from __future__ import annotations

from typing import Final

from clips._clips import ffi, lib

from cxbridge.executive.host.capi import EXTRA, NULL, CData, callback

EXISTS_FUNCTION: Final = "fact-existp"
"""The built-in that this replaces."""

_INTEGER: Final = 1
_FACT_ADDRESS: Final = 6
_ALL_BITS: Final = (1 << 10) - 1
# Facts that are held.
_MOST: Final = 4096


class FactsByIndex:
    """The facts of an environment whose indices were requested.

    :param env: the environment's pointer.
    """

    def __init__(self, env: CData) -> None:
        self._env = env
        self._held: dict[int, CData] = {}
        self._argument = ffi.new("UDFValue *")
        self._true, self._false = lib.TrueSymbol(env), lib.FalseSymbol(env)
        self.function = callback("void(Environment *, UDFContext *, UDFValue *)", self._answer)
        """What CLIPS calls for `fact-existp`."""

    def exists(self, index: int) -> bool:
        """Whether there is a fact with this index."""
        fact = self._held.get(index)
        if fact is not None:
            if lib.FactExistp(fact):
                return True
            lib.ReleaseFact(self._held.pop(index))
        fact = EXTRA.FindIndexedFact(self._env, index)
        if fact == NULL:
            return False
        if len(self._held) >= _MOST:
            self.forget()
        lib.RetainFact(fact)
        self._held[index] = fact
        return True

    def forget(self) -> None:
        """Let go of all facts."""
        while self._held:
            lib.ReleaseFact(self._held.popitem()[1])

    def _answer(self, _env: CData, context: CData, result: CData) -> None:
        argument = self._argument
        result.lexemeValue = self._false
        if not lib.UDFFirstArgument(context, _ALL_BITS, argument):
            return
        kind = argument.header.type
        if kind == _FACT_ADDRESS:
            there = lib.FactExistp(argument.factValue)
        else:  # for a value that is no index, CLIPS reports a missing fact
            there = kind == _INTEGER and self.exists(argument.integerValue.contents)
        if there:
            result.lexemeValue = self._true
