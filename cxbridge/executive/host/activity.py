"""The rule and the functions that CLIPS executes now, read from another thread."""

from __future__ import annotations

from typing import TYPE_CHECKING

from clips._clips import lib

from cxbridge.executive.host.capi import NULL, CData, decode

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

MATCHING = "(matching)"
"""In place of a rule: facts are being matched against conditions."""


def executing(env: ClipsEnvironment) -> str:
    """Return the rule whose right-hand side runs at this moment; empty when none does.

    CLIPS refuses to delete a rule that runs, and any rule while facts are matched; it is asked about each of
    the current module, which is the one of the rule that runs. Nothing is changed, so that no lock is needed
    but the one that keeps the environment from being destroyed.
    """
    with env.life:
        return executing_rule(env.env) if env.is_firing else ""


def executing_rule(env: CData) -> str:
    """Return what :func:`executing` does of an environment that cannot be destroyed meanwhile."""
    busy, count = "", 0
    rule = lib.GetNextDefrule(env, NULL)
    while rule != NULL:
        if not lib.DefruleIsDeletable(rule):
            busy, count = decode(lib.DefruleName(rule)), count + 1
        if count > 1:
            return MATCHING
        rule = lib.GetNextDefrule(env, rule)
    return busy
