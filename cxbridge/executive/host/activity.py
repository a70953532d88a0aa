"""The rule and the functions that CLIPS is executing, read from another thread.

The watchdog calls these functions to name the cause of a loop that does not end.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from clips._clips import ffi, lib

from cxbridge.executive.host.capi import MATCHING, decode, executing_rule, items_of

__all__ = ["MATCHING", "executing_function_names", "executing_rule_name"]

# Offset of a deffunction's count of active calls in CLIPS 6.4.2, in units of ``unsigned int``. The C API has
# no function for this count.
_CALL_COUNT_OFFSET: Final = 17

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment


def executing_rule_name(env: ClipsEnvironment) -> str:
    """Return the rule whose right-hand side is active; empty if no rule is. Callable from any thread."""
    # the query whether a rule is deletable (see executing_rule) changes nothing, so that it needs no lock
    # except the lock against the destruction of the environment
    with env.destruction_lock:
        return executing_rule(env.c_env) if env.is_firing else ""


def executing_function_names(env: ClipsEnvironment) -> list[str]:
    """Return the active deffunctions of the current module, outermost first.

    The order is a guess from the order of definition, which is the reverse. A file may declare a function,
    and define it after its callers: then it comes before them.
    """
    with env.destruction_lock:
        functions = list(items_of(lib.GetNextDeffunction, env.c_env)) if env.is_firing else []
        # CLIPS lists functions in the order of their definition, callees before their callers
        return [
            decode(lib.DeffunctionName(function))
            for function in reversed(functions)
            if ffi.cast("unsigned int *", function)[_CALL_COUNT_OFFSET]
        ]
