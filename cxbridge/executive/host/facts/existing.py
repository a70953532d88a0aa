"""A fast `fact-existp` by index.

Fawkes' core stores fact indices in slots, and checks in conditions whether the facts exist, for each goal and
loop. CLIPS searches its list of all facts for an index. This version retains the facts that it has found, so
that it searches once.
"""

from __future__ import annotations

from typing import Final

from clips._clips import ffi, lib

from cxbridge.executive.host.capi import EXTRA_FUNCTIONS, NULL, CData, make_callback

EXISTS_FUNCTION: Final = "fact-existp"
"""The name of the replaced function."""

_INTEGER: Final = 1  # CLIPS' type code of integers
_FACT_ADDRESS: Final = 6  # CLIPS' type code of fact addresses
_ALL_BITS: Final = (1 << 10) - 1  # accept arguments of any type
# the maximum number of retained facts, which keep their memory even after their retraction
_MAX_RETAINED: Final = 4096


class FactsByIndex:
    """The retained facts of one environment.

    :param env: the environment's pointer.
    """

    def __init__(self, env: CData) -> None:
        self._env = env
        self._retained_facts: dict[int, CData] = {}
        self._argument = ffi.new("UDFValue *")
        self._true, self._false = lib.TrueSymbol(env), lib.FalseSymbol(env)
        self.function = make_callback("void(Environment *, UDFContext *, UDFValue *)", self._execute)
        """The C implementation of `fact-existp`."""

    def exists(self, index: int) -> bool:
        """Return whether a fact with this index exists."""
        fact = self._retained_facts.get(index)
        if fact is not None:
            if lib.FactExistp(fact):
                return True
            lib.ReleaseFact(self._retained_facts.pop(index))
        fact = EXTRA_FUNCTIONS.FindIndexedFact(self._env, index)
        if fact == NULL:
            return False
        if len(self._retained_facts) >= _MAX_RETAINED:
            self.forget()
        lib.RetainFact(fact)
        self._retained_facts[index] = fact
        return True

    def forget(self) -> None:
        """Release all facts."""
        while self._retained_facts:
            lib.ReleaseFact(self._retained_facts.popitem()[1])

    def _execute(self, _env: CData, context: CData, result: CData) -> None:
        """Execute `fact-existp`, whose argument is a fact address or an index."""
        argument = self._argument
        result.lexemeValue = self._false
        if not lib.UDFFirstArgument(context, _ALL_BITS, argument):
            return
        type_code = argument.header.type
        if type_code == _FACT_ADDRESS:
            exists = lib.FactExistp(argument.factValue)
        else:  # CLIPS reports a missing fact for a value that is not an index
            exists = type_code == _INTEGER and self.exists(argument.integerValue.contents)
        if exists:
            result.lexemeValue = self._true
