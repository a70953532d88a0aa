"""Rules and agenda of a CLIPS environment, read directly from CLIPS.

clipspy lists neither the rules nor the activations, so CLIPS' C functions walk them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Annotated, Final

from clips._clips import lib
from msgspec import UNSET, Meta, UnsetType

from cxbridge.executive.host.capi import NULL, CData, decode
from cxbridge_web.models import Model
from cxbridge_web.paging import ListPart, Window, has_text, matches

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

MAX_ACTIVATIONS: Final = 1000  # limit of activations in one answer


def _iterate_items(env: ClipsEnvironment, next_item: Callable[[CData, CData], CData]) -> Iterator[CData]:
    """Yield the items of an environment.

    :param next_item: a function of CLIPS that returns the item after an item, and the first item after NULL.
    """
    item = next_item(env.c_env, NULL)
    while item != NULL:
        yield item
        item = next_item(env.c_env, item)


def count_items(env: ClipsEnvironment) -> dict[str, int]:
    """Return the numbers of facts, rules and activations."""
    next_item_functions = {
        "facts": lib.GetNextFact,
        "rules": lib.GetNextDefrule,
        "agenda": lib.GetNextActivation,
    }
    with env.lock:
        return {
            name: sum(1 for _ in _iterate_items(env, next_item))
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
    """Return all rules without their locations; the caller holds the lock, between runs of the rules."""
    activations = _iterate_items(env, lib.GetNextActivation)
    counts = Counter(decode(lib.ActivationRuleName(activation)) for activation in activations)
    models = []
    for rule in _iterate_items(env, lib.GetNextDefrule):
        name = decode(lib.DefruleName(rule))
        models.append(Rule(name=name, module=decode(lib.DefruleModule(rule)), agenda=counts[name]))
    return models


class Activation(Model, kw_only=True):
    """An activation: a rule, and the facts that match its conditions."""

    rule: str
    salience: int
    basis: str  # the facts as CLIPS prints them: `f-1,*`


def list_activations(env: ClipsEnvironment, pattern: str, window: Window) -> ListPart:
    """Return a part of the agenda, at most :data:`MAX_ACTIVATIONS`, however large the window is.

    The caller holds the lock, between runs of the rules.

    :param pattern: a pattern of rule names.
    """
    limit = MAX_ACTIVATIONS if window.limit is None else min(window.limit, MAX_ACTIVATIONS)
    models: list[Activation] = []
    total = 0
    env.output.pause()  # CLIPS queries each active router for each piece of text, which is slow
    for activation in _iterate_items(env, lib.GetNextActivation):
        rule = decode(lib.ActivationRuleName(activation))
        is_match = matches(rule, pattern)
        in_window = is_match and window.offset <= total < window.offset + limit
        # CLIPS prints the basis slowly, so only for the activations of the window, or for a search.
        if is_match and (in_window or window.search):
            basis = env.api.activation_text(activation).split(":", 1)[1].strip()
            is_match = not window.search or has_text((rule, basis), window.search)
            if in_window and is_match:
                salience = int(lib.ActivationGetSalience(activation))
                models.append(Activation(rule=rule, salience=salience, basis=basis))
        total += is_match
    env.output.resume()
    return ListPart(models, total)
