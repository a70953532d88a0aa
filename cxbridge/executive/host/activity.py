"""The rule and the functions that CLIPS executes now, read from another thread."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from clips._clips import ffi, lib

from cxbridge.executive.host.capi import MATCHING, NULL, decode, executing_rule

__all__ = ["MATCHING", "executing", "executing_functions"]

# Where a deffunction of CLIPS 6.4.2 counts its calls that are under way, in units of ``unsigned int``.
_EXECUTING: Final = 17

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment


def executing(env: ClipsEnvironment) -> str:
    """Return the rule whose right-hand side runs at this moment; empty when none does.

    CLIPS refuses to delete a rule that runs, and any rule while facts are matched; it is asked about each of
    the current module, which is the one of the rule that runs. Nothing is changed, so that no lock is needed
    but the one that keeps the environment from being destroyed.
    """
    with env.life:
        return executing_rule(env.env) if env.is_firing else ""


def executing_functions(env: ClipsEnvironment) -> list[str]:
    """Return the deffunctions of the current module that run at this moment, the outer ones first.

    Functions that are defined before a function that they call are left out.
    """
    found: list[str] = []
    with env.life:
        function = lib.GetNextDeffunction(env.env, NULL) if env.is_firing else NULL
        while function != NULL:
            if ffi.cast("unsigned int *", function)[_EXECUTING]:
                found.insert(0, decode(lib.DeffunctionName(function)))
            function = lib.GetNextDeffunction(env.env, function)
    return found
