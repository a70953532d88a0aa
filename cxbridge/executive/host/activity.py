"""The rule and functions that CLIPS is executing, read from another thread."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from clips._clips import ffi, lib

from cxbridge.executive.host.capi import MATCHING, decode, executing_rule, items_of

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
    with env.life:
        functions = list(items_of(lib.GetNextDeffunction, env.env)) if env.is_firing else []
        # CLIPS lists functions in the order of their definition, callees before their callers
        return [
            decode(lib.DeffunctionName(function))
            for function in reversed(functions)
            if ffi.cast("unsigned int *", function)[_EXECUTING]
        ]
