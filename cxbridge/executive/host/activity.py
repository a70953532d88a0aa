"""The rule and the functions that CLIPS executes now, read from another thread."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cxbridge.executive.host.capi import MATCHING, executing_rule

__all__ = ["MATCHING", "executing"]

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
