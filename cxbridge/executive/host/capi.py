"""C functions of CLIPS 6.4 that clipspy includes but does not wrap.

clipspy 1.0.6 is one shared object that exports all of CLIPS. Wrapped functions are called through its
``lib``, the remaining few through cffi's ABI mode. clipspy's Python classes are not used: its Fact leaks
memory, its functions flatten multifields, and its builders refuse values that CLIPS accepts (see
docs/evidence/clips.md). The signatures follow the CLIPS 6.4 Advanced Programming Guide and header files.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from typing import Any

from clips import _clips
from clips._clips import ffi, lib

CData = Any
"""A C value or pointer, which has no static type."""

NULL = ffi.NULL

# the owners of hooks: the events of the environment, and the search for endless rules, which has hooks only
# during a part of a run
_HOOK = b"cxbridge"
_TRACE = b"cxbridge-trace"
_TEXT_TARGET = b"cxbridge-text"

_SIGNATURES = {
    "RemoveUDF": "bool(*)(Environment *, char *)",
    "AddAssertFunction": "bool(*)(Environment *, char *, void *, int, void *)",
    "AddRetractFunction": "bool(*)(Environment *, char *, void *, int, void *)",
    "AddBeforeRuleFiresFunction": "bool(*)(Environment *, char *, void *, int, void *)",
    "RemoveAssertFunction": "bool(*)(Environment *, char *)",
    "RemoveRetractFunction": "bool(*)(Environment *, char *)",
    "RemoveBeforeRuleFiresFunction": "bool(*)(Environment *, char *)",
    "AddAfterRuleFiresFunction": "bool(*)(Environment *, char *, void *, int, void *)",
    "RemoveAfterRuleFiresFunction": "bool(*)(Environment *, char *)",
    "PrintFact": "void(*)(Environment *, char *, Fact *, bool, bool, char *)",
    "OpenStringBuilderDestination": "bool(*)(Environment *, char *, void *)",
    "CloseStringBuilderDestination": "bool(*)(Environment *, char *)",
    "CreateFact": "Fact *(*)(Deftemplate *)",
    "ReturnFact": "void(*)(Environment *, Fact *)",
    "CopyMultifield": "Multifield *(*)(Environment *, Multifield *)",
    "ReturnMultifield": "void(*)(Environment *, Multifield *)",
    "CopyFactSlotValues": "bool(*)(Environment *, Fact *, Fact *)",
    "PutFactSlot": "bool(*)(Fact *, char *, CLIPSValue *)",
    "AssignFactSlotDefaults": "bool(*)(Fact *)",
    "Assert": "Fact *(*)(Fact *)",
    "FindIndexedFact": "Fact *(*)(Environment *, long long)",
    "SetEvaluationError": "void(*)(Environment *, bool)",
    "SetHaltExecution": "void(*)(Environment *, bool)",
    "GetHaltExecution": "bool(*)(Environment *)",
    "SetHaltRules": "void(*)(Environment *, bool)",
    "GetHaltRules": "bool(*)(Environment *)",
    "WatchString": "bool(*)(Environment *, char *)",
    "UnwatchString": "bool(*)(Environment *, char *)",
    "AddPeriodicFunction": "bool(*)(Environment *, char *, void *, int, void *)",
    "FindFunction": "void *(*)(Environment *, char *)",
    "RetainLexeme": "void(*)(Environment *, CLIPSLexeme *)",
    "AddFunctionParser": "bool(*)(Environment *, char *, void *)",
    "CollectArguments": "void *(*)(Environment *, void *, char *)",
    "CountArguments": "int(*)(void *)",
    "CheckDeffunctionCall": "bool(*)(Environment *, void *, int)",
    "GetFunctionReference": "bool(*)(Environment *, char *, void *)",
    "GetSequenceOperatorRecognition": "bool(*)(Environment *)",
    "ReplaceSequenceExpansionOps": "bool(*)(Environment *, void *, void *, void *, void *)",
    "ReturnExpression": "void(*)(Environment *, void *)",
    **dict.fromkeys(
        (
            *(
                "LengthFunction",
                "StrIndexFunction",
                "StringToFieldFunction",
                "ExplodeFunction",
                "NthFunction",
            ),
            *("SubseqFunction", "DeleteFunction", "InsertFunction", "ReplaceFunction", "SubStringFunction"),
            *("StrCompareFunction", "EvenpFunction", "OddpFunction", "RandomFunction", "SeedFunction"),
            *("SetgenFunction", "StrByteLengthFunction", "FactExistpFunction"),
        ),
        "void(*)(Environment *, UDFContext *, UDFValue *)",
    ),
}


class _ExtraFunctions:
    """The functions of :data:`_SIGNATURES` as attributes."""

    # addresses come from the dynamic linker and types from clipspy's cffi, so its pointers need no cast
    def __init__(self) -> None:
        library = ctypes.CDLL(_clips.__file__)
        for name, signature in _SIGNATURES.items():
            address = ctypes.cast(getattr(library, name), ctypes.c_void_p).value
            setattr(self, name, ffi.cast(signature, address))

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name)


EXTRA = _ExtraFunctions()
"""The functions of C missing in ``lib``."""


def callback(signature: str, function: Callable[..., Any]) -> CData:
    """Make a C function. The caller must keep the result alive as long as C may call it."""
    return ffi.callback(signature, function)


class ClipsApi:
    """The unwrapped C functions for one environment.

    :param environment: clipspy's pointer to the environment.
    """

    def __init__(self, environment: CData) -> None:
        self._env = environment
        self._builder = lib.CreateStringBuilder(environment, 512)  # grows if necessary
        EXTRA.OpenStringBuilderDestination(environment, _TEXT_TARGET, self._builder)

    def remove_udf(self, name: str) -> None:
        """Remove a built-in function before any construct uses it."""
        # CLIPS keeps pointers to functions in parsed constructs
        EXTRA.RemoveUDF(self._env, name.encode())

    def _hook(self, event: str, call: CData | None, owner: bytes = _HOOK) -> None:
        """Set or remove the function that CLIPS calls at an event. An owner has one function per event."""
        getattr(EXTRA, f"Remove{event}Function")(self._env, owner)
        if call is not None:
            getattr(EXTRA, f"Add{event}Function")(self._env, owner, call, 0, NULL)

    def on_assert(self, call: CData | None) -> None:
        """Call ``void call(Environment *, Fact *, void *)`` after each assertion; None removes it."""
        self._hook("Assert", call)

    def on_retract(self, call: CData | None) -> None:
        """Call ``void call(Environment *, Fact *, void *)`` before each retraction; None removes it."""
        self._hook("Retract", call)

    def on_fire(self, call: CData | None) -> None:
        """Call ``void call(Environment *, Activation *, void *)`` before each firing; None removes it."""
        self._hook("BeforeRuleFires", call)

    def after_fire(self, call: CData | None) -> None:
        """Call ``void call(Environment *, Activation *, void *)`` after each firing; None removes it."""
        self._hook("AfterRuleFires", call)

    def trace(self, fired: CData | None, asserted: CData | None) -> None:
        """Add further hooks like those of :meth:`on_fire` and :meth:`on_assert`; None removes them."""
        self._hook("BeforeRuleFires", fired, _TRACE)
        self._hook("Assert", asserted, _TRACE)

    def fact_text(self, fact: CData) -> str:
        """Return a fact as CLIPS prints it in one line, without its index."""
        lib.SBReset(self._builder)
        EXTRA.PrintFact(self._env, _TEXT_TARGET, fact, False, False, NULL)
        return decode(self._builder.contents)

    def activation_text(self, activation: CData) -> str:
        """Return an activation in the notation of the agenda: ``salience rule: f-1,f-2``."""
        lib.SBReset(self._builder)
        lib.ActivationPPForm(activation, self._builder)
        return decode(self._builder.contents)

    def halt(self) -> None:
        """Stop the active right-hand side and the run, as a CLIPS error does."""
        EXTRA.SetEvaluationError(self._env, True)
        EXTRA.SetHaltExecution(self._env, True)

    def clear_halt(self) -> None:
        """Clear an earlier error before the next run."""
        EXTRA.SetEvaluationError(self._env, False)
        EXTRA.SetHaltExecution(self._env, False)

    def halted(self) -> bool:
        """Return whether an error has stopped the execution."""
        return bool(EXTRA.GetHaltExecution(self._env))

    def halt_rules(self) -> None:
        """Stop the run after the active right-hand side, as ``(halt)`` does."""
        EXTRA.SetHaltRules(self._env, True)

    def rules_halt(self) -> bool:
        """Return whether the run stops after the active right-hand side."""
        return bool(EXTRA.GetHaltRules(self._env))

    def dispose(self) -> None:
        """Remove all hooks and free all memory. CLIPS can free its environment only afterwards."""
        for event in ("Assert", "Retract", "BeforeRuleFires", "AfterRuleFires"):
            self._hook(event, None)
        self.trace(None, None)
        EXTRA.CloseStringBuilderDestination(self._env, _TEXT_TARGET)
        lib.SBDispose(self._builder)


def decode(text: CData) -> str:
    """Return a C string as text. Bytes other than UTF-8 become surrogates."""
    data: bytes = ffi.string(text)
    return data.decode("utf-8", "surrogateescape")


def encode(text: str) -> bytes:
    """Return the bytes of a text in CLIPS; the inverse of :func:`decode`."""
    return text.encode("utf-8", "surrogateescape")


def items_of(get_next: Callable[[CData, CData], CData], owner: CData) -> Iterator[CData]:
    """Yield the items of one of CLIPS' linked lists, such as ``lib.GetNextDefrule`` of an environment."""
    item = get_next(owner, NULL)
    while item != NULL:
        yield item
        item = get_next(owner, item)


MATCHING = "(matching)"
"""The result of :func:`executing_rule` while facts are matched against conditions."""


def executing_rule(env: CData) -> str:
    """Return the active rule; empty without one; :data:`MATCHING` during matching."""
    # CLIPS refuses to delete the active rule, and every rule during matching
    busy = [rule for rule in items_of(lib.GetNextDefrule, env) if not lib.DefruleIsDeletable(rule)]
    if len(busy) > 1:
        return MATCHING
    return decode(lib.DefruleName(busy[0])) if busy else ""
