"""The C functions of CLIPS 6.4 that clipspy carries but does not wrap.

clipspy 1.0.6 is one shared object that exports all of CLIPS. Wrapped functions are called through its ``lib``
(fast); the rest, a handful, through cffi's ABI mode below. clipspy's Python classes are not used: its Fact
leaks, its functions flatten multifields, and its builders refuse values that CLIPS itself accepts (see
docs/clips.md). Source of the signatures: the CLIPS 6.4 Advanced Programming Guide and its header files.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

from clips import _clips
from clips._clips import ffi, lib

CData = Any
"""A C value or pointer. cffi has no types for mypy to check."""

NULL = ffi.NULL

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
    """The functions of :data:`_SIGNATURES` as attributes.

    Addresses come from the dynamic linker, types from clipspy's own cffi: its pointers fit without a cast.
    """

    def __init__(self) -> None:
        library = ctypes.CDLL(_clips.__file__)
        for name, signature in _SIGNATURES.items():
            address = ctypes.cast(getattr(library, name), ctypes.c_void_p).value
            setattr(self, name, ffi.cast(signature, address))

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name)


EXTRA = _ExtraFunctions()
"""The extra functions of C, called like those of ``lib``."""


def callback(signature: str, function: Callable[..., Any]) -> CData:
    """Make a C function of ``function``. The caller must keep the result alive as long as C may call it."""
    return ffi.callback(signature, function)


class ClipsApi:
    """The extra C functions, for one environment.

    :param environment: clipspy's environment pointer.
    """

    def __init__(self, environment: CData) -> None:
        self._env = environment
        self._builder = lib.CreateStringBuilder(environment, 512)
        EXTRA.OpenStringBuilderDestination(environment, _TEXT_TARGET, self._builder)

    def remove_udf(self, name: str) -> None:
        """Take a built-in away. Only before anything that uses it is parsed: CLIPS keeps pointers."""
        EXTRA.RemoveUDF(self._env, name.encode())

    def on_assert(self, call: CData | None) -> None:
        """Call ``void call(Environment *, Fact *, void *)`` after each assertion; None ends it."""
        EXTRA.RemoveAssertFunction(self._env, _HOOK)
        if call is not None:
            EXTRA.AddAssertFunction(self._env, _HOOK, call, 0, NULL)

    def on_retract(self, call: CData | None) -> None:
        """Call ``void call(Environment *, Fact *, void *)`` before each retraction; None ends it."""
        EXTRA.RemoveRetractFunction(self._env, _HOOK)
        if call is not None:
            EXTRA.AddRetractFunction(self._env, _HOOK, call, 0, NULL)

    def on_fire(self, call: CData | None) -> None:
        """Call ``void call(Environment *, Activation *, void *)`` before each firing; None ends it."""
        EXTRA.RemoveBeforeRuleFiresFunction(self._env, _HOOK)
        if call is not None:
            EXTRA.AddBeforeRuleFiresFunction(self._env, _HOOK, call, 0, NULL)

    def after_fire(self, call: CData | None) -> None:
        """Call ``void call(Environment *, Activation *, void *)`` after each firing; None ends it."""
        EXTRA.RemoveAfterRuleFiresFunction(self._env, _HOOK)
        if call is not None:
            EXTRA.AddAfterRuleFiresFunction(self._env, _HOOK, call, 0, NULL)

    def trace(self, fired: CData | None, asserted: CData | None) -> None:
        """Call these, too, as :meth:`on_fire` and :meth:`on_assert` do; None ends it."""
        EXTRA.RemoveBeforeRuleFiresFunction(self._env, _TRACE)
        EXTRA.RemoveAssertFunction(self._env, _TRACE)
        if fired is not None:
            EXTRA.AddBeforeRuleFiresFunction(self._env, _TRACE, fired, 0, NULL)
        if asserted is not None:
            EXTRA.AddAssertFunction(self._env, _TRACE, asserted, 0, NULL)

    def fact_text(self, fact: CData) -> str:
        """Return a fact as CLIPS prints it on one line, without its index."""
        lib.SBReset(self._builder)
        EXTRA.PrintFact(self._env, _TEXT_TARGET, fact, False, False, NULL)
        return decode(self._builder.contents)

    def activation_text(self, activation: CData) -> str:
        """Return an activation as the agenda shows it: ``salience rule: f-1,f-2``."""
        lib.SBReset(self._builder)
        lib.ActivationPPForm(activation, self._builder)
        return decode(self._builder.contents)

    def halt(self) -> None:
        """End the right-hand side and the run that are under way, as an error in CLIPS does."""
        EXTRA.SetEvaluationError(self._env, True)
        EXTRA.SetHaltExecution(self._env, True)

    def clear_halt(self) -> None:
        """Forget an earlier error: the next run starts clean."""
        EXTRA.SetEvaluationError(self._env, False)
        EXTRA.SetHaltExecution(self._env, False)

    def halted(self) -> bool:
        """Whether an error has ended the present work."""
        return bool(EXTRA.GetHaltExecution(self._env))

    def halt_rules(self) -> None:
        """Let the run end when the right-hand side that is under way has, as ``(halt)`` does."""
        EXTRA.SetHaltRules(self._env, True)

    def rules_halt(self) -> bool:
        """Whether the run that is under way ends with this right-hand side."""
        return bool(EXTRA.GetHaltRules(self._env))

    def dispose(self) -> None:
        """Remove all hooks and free all held memory, so that CLIPS can free its environment."""
        self.on_assert(None)
        self.on_retract(None)
        self.on_fire(None)
        self.after_fire(None)
        self.trace(None, None)
        EXTRA.CloseStringBuilderDestination(self._env, _TEXT_TARGET)
        lib.SBDispose(self._builder)


def decode(text: CData) -> str:
    """Return a C string as Python text; bytes that are not UTF-8 survive as surrogates."""
    data: bytes = ffi.string(text)
    return data.decode("utf-8", "surrogateescape")


def encode(text: str) -> bytes:
    """Return text as the bytes CLIPS stores; the inverse of :func:`decode`."""
    return text.encode("utf-8", "surrogateescape")


MATCHING = "(matching)"
"""In place of a rule: facts are being matched against conditions."""


def executing_rule(env: CData) -> str:
    """Return the rule whose right-hand side runs; empty: none; :data:`MATCHING`: facts are matched."""
    busy, count = "", 0
    rule = lib.GetNextDefrule(env, NULL)
    while rule != NULL:
        if not lib.DefruleIsDeletable(rule):
            busy, count = decode(lib.DefruleName(rule)), count + 1
        if count > 1:
            return MATCHING
        rule = lib.GetNextDefrule(env, rule)
    return busy
