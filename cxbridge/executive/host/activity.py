"""The rule that CLIPS is executing, read from another thread, so that the watchdog can name the rule."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cxbridge.executive.host.capi import executing_rule

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment


def executing_rule_name(env: ClipsEnvironment) -> str:
    """Return the rule whose right-hand side is active, or ``(matching)``; empty if no rule is active.

    Callable from any thread.
    """
    # executing_rule only reads the environment: the lock that prevents its destruction is enough
    with env.destruction_lock:
        return executing_rule(env.c_env) if env.is_firing else ""
