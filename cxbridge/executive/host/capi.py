"""C functions of CLIPS 6.4 that clipspy includes but does not wrap.

clipspy 1.0.6 is one shared object that exports all of CLIPS. Functions that clipspy wraps are called through
its ``lib``, the other functions through pointers made here. cxbridge does not use clipspy's Python classes:
its Fact leaks memory, its functions flatten multifields, and its builders refuse values that CLIPS accepts
(see docs/evidence/clips.md). The signatures follow the CLIPS 6.4 Advanced Programming Guide and header files.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any, Literal, get_args

from clips import _clips
from clips._clips import ffi, lib

CData = Any
"""A C value or pointer, which has no static type."""

NULL = ffi.NULL

MULTIFIELD_TYPE = 4
"""CLIPS' type code of multifields."""

HookEvent = Literal["Assert", "Retract", "BeforeRuleFires", "AfterRuleFires"]
"""An event of CLIPS, as in the names of the C functions that add and remove hooks."""

_HOOK_OWNER = b"cxbridge"
TRACE_OWNER = b"cxbridge-trace"
"""The owner of the hooks that trace firings in search of endless rules."""

_TEXT_TARGET = b"cxbridge-text"  # the logical name of the string builder into which CLIPS prints

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
        [
            "LengthFunction",
            "StrIndexFunction",
            "StringToFieldFunction",
            "ExplodeFunction",
            "NthFunction",
            "SubseqFunction",
            "DeleteFunction",
            "InsertFunction",
            "ReplaceFunction",
            "SubStringFunction",
            "StrCompareFunction",
            "EvenpFunction",
            "OddpFunction",
            "RandomFunction",
            "SeedFunction",
            "SetgenFunction",
            "StrByteLengthFunction",
        ],
        "void(*)(Environment *, UDFContext *, UDFValue *)",
    ),
}


_LIBRARY = ctypes.CDLL(_clips.__file__)

# addresses come from the dynamic linker and types from clipspy's cffi, so that pointers from clipspy can be
# passed to these functions without a cast
EXTRA_FUNCTIONS: Any = SimpleNamespace(
    **{
        name: ffi.cast(signature, ctypes.cast(getattr(_LIBRARY, name), ctypes.c_void_p).value)
        for name, signature in _SIGNATURES.items()
    }
)
"""The C functions that clipspy's ``lib`` lacks."""


def make_callback(signature: str, function: Callable[..., Any]) -> CData:
    """Make a C function from a Python function. The caller must keep the result as long as C may call it."""
    return ffi.callback(signature, function)


class ClipsApi:
    """Hooks, printing and halts of one environment.

    :param environment: clipspy's pointer to the environment.
    """

    def __init__(self, environment: CData) -> None:
        self._env = environment
        self._builder = lib.CreateStringBuilder(environment, 512)  # grows if necessary
        EXTRA_FUNCTIONS.OpenStringBuilderDestination(environment, _TEXT_TARGET, self._builder)

    def remove_udf(self, name: str) -> None:
        """Remove a built-in function. To be called before any construct uses the function."""
        # parsed constructs contain pointers to the functions that they call
        EXTRA_FUNCTIONS.RemoveUDF(self._env, name.encode())

    def set_hook(self, event: HookEvent, hook: CData | None, owner: bytes = _HOOK_OWNER) -> None:
        """Set or remove the function that CLIPS calls at an event. An owner has one function per event.

        :param hook: ``void hook(Environment *, Fact *, void *)`` for assertions (called afterwards) and
            retractions (called before); with an ``Activation *`` for firings; None removes the hook.
        """
        getattr(EXTRA_FUNCTIONS, f"Remove{event}Function")(self._env, owner)
        if hook is not None:  # with priority 0 and without a context
            getattr(EXTRA_FUNCTIONS, f"Add{event}Function")(self._env, owner, hook, 0, NULL)

    def fact_text(self, fact: CData) -> str:
        """Return a fact as CLIPS prints it in one line, without its index."""
        lib.SBReset(self._builder)
        EXTRA_FUNCTIONS.PrintFact(self._env, _TEXT_TARGET, fact, False, False, NULL)
        return decode(self._builder.contents)

    def activation_text(self, activation: CData) -> str:
        """Return an activation in the notation of the agenda: ``salience rule: f-1,f-2``."""
        lib.SBReset(self._builder)
        lib.ActivationPPForm(activation, self._builder)
        return decode(self._builder.contents)

    def halt(self) -> None:
        """Stop the active right-hand side and the run, as a CLIPS error does."""
        EXTRA_FUNCTIONS.SetEvaluationError(self._env, True)
        EXTRA_FUNCTIONS.SetHaltExecution(self._env, True)

    def clear_halt(self) -> None:
        """Clear an earlier error, which would end the next run at its first rule."""
        EXTRA_FUNCTIONS.SetEvaluationError(self._env, False)
        EXTRA_FUNCTIONS.SetHaltExecution(self._env, False)

    def is_halted(self) -> bool:
        """Return whether an error has stopped the execution."""
        return bool(EXTRA_FUNCTIONS.GetHaltExecution(self._env))

    def request_halt(self) -> None:
        """Stop the run after the active right-hand side, as ``(halt)`` does."""
        EXTRA_FUNCTIONS.SetHaltRules(self._env, True)

    def is_halt_requested(self) -> bool:
        """Return whether the run stops after the active right-hand side, see :meth:`request_halt`."""
        return bool(EXTRA_FUNCTIONS.GetHaltRules(self._env))

    def dispose(self) -> None:
        """Remove all hooks and free all memory. CLIPS can free its environment only afterwards."""
        for event in get_args(HookEvent):
            for owner in (_HOOK_OWNER, TRACE_OWNER):
                self.set_hook(event, None, owner)
        EXTRA_FUNCTIONS.CloseStringBuilderDestination(self._env, _TEXT_TARGET)
        lib.SBDispose(self._builder)


def decode(text: CData) -> str:
    """Return a C string as text. Bytes other than UTF-8 become surrogates."""
    encoded: bytes = ffi.string(text)
    return encoded.decode("utf-8", "surrogateescape")


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
"""The result of :func:`executing_rule` while CLIPS matches facts against conditions."""


def executing_rule(env: CData) -> str:
    """Return the rule whose right-hand side is active, or :data:`MATCHING`; empty if no rule is active."""
    # CLIPS refuses to delete the active rule, and every rule during matching
    undeletable_rules = [
        rule for rule in items_of(lib.GetNextDefrule, env) if not lib.DefruleIsDeletable(rule)
    ]
    if len(undeletable_rules) > 1:
        return MATCHING
    return decode(lib.DefruleName(undeletable_rules[0])) if undeletable_rules else ""
