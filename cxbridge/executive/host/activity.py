"""The rule and functions that CLIPS is executing, read from another thread."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from clips._clips import ffi, lib

from cxbridge.executive.host.capi import MATCHING, NULL, decode, executing_rule

__all__ = ["MATCHING", "executing", "executing_functions"]

# Offset of a deffunction's count of active calls in CLIPS 6.4.2, in units of ``unsigned int``.
_EXECUTING: Final = 17

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment


def executing(env: ClipsEnvironment) -> str:
    """Return the rule with the active right-hand side; empty without one. Callable from any thread."""
    # CLIPS refuses to delete an active rule, and any rule during matching: the query whether a rule is
    # deletable changes nothing, so it needs no lock except against the destruction of the environment
    with env.life:
        return executing_rule(env.env) if env.is_firing else ""


def executing_functions(env: ClipsEnvironment) -> list[str]:
    """Return the active deffunctions of the current module, outermost first.

    A function that is defined before its callee is missing.
    """
    found: list[str] = []
    with env.life:
        function = lib.GetNextDeffunction(env.env, NULL) if env.is_firing else NULL
        while function != NULL:
            if ffi.cast("unsigned int *", function)[_EXECUTING]:
                found.insert(0, decode(lib.DeffunctionName(function)))
            function = lib.GetNextDeffunction(env.env, function)
    return found
