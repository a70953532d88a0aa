"""The rules of a CLIPS environment with their activations, read directly from CLIPS.

CLIPS' C functions walk them: clipspy's classes need its own ``Environment``, which cxbridge does not use.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Annotated

from clips._clips import lib
from msgspec import UNSET, Meta, UnsetType

from cxbridge.executive.host.capi import decode, items_of
from cxbridge_web.models import Model

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment


def count_items(env: ClipsEnvironment) -> dict[str, int]:
    """Return the numbers of facts, and of the rules and activations of the current module, by name."""
    next_item_functions = {
        "facts": lib.GetNextFact,
        "rules": lib.GetNextDefrule,
        "agenda": lib.GetNextActivation,
    }
    with env.lock:
        return {
            name: sum(1 for _ in items_of(next_item, env.c_env))
            for name, next_item in next_item_functions.items()
        }


class Rule(Model, kw_only=True):
    """A rule: its location, the number of its activations on the agenda, the number of its firings."""

    name: str
    module: str
    agenda: int
    file: str | UnsetType = UNSET
    line: int | UnsetType = UNSET
    core: bool | UnsetType = UNSET
    firings: Annotated[
        int | UnsetType, Meta(description="only while a client follows events of the kind `rule`")
    ] = UNSET


def list_rules(env: ClipsEnvironment) -> list[Rule]:
    """Return the rules of the current module without their locations.

    The caller holds the lock of the environment, and calls the function between runs of the rules.
    """
    activations = items_of(lib.GetNextActivation, env.c_env)
    activation_counts = Counter(decode(lib.ActivationRuleName(activation)) for activation in activations)
    models = []
    for rule in items_of(lib.GetNextDefrule, env.c_env):
        name = decode(lib.DefruleName(rule))
        models.append(Rule(name=name, module=decode(lib.DefruleModule(rule)), agenda=activation_counts[name]))
    return models
