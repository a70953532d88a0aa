"""The agenda of an environment: what would fire, in order."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from clips._clips import lib

from cxbridge.executive.host.capi import NULL, decode

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment


def agenda(env: ClipsEnvironment) -> Iterator[tuple[int, str, str]]:
    """Yield salience, rule and facts (``f-1,f-2``) of what would fire, in order."""
    activation = lib.GetNextActivation(env.env, NULL)
    while activation != NULL:
        env.output.pause()
        text = env.api.activation_text(activation)
        env.output.resume()
        rule = decode(lib.ActivationRuleName(activation))
        yield int(lib.ActivationGetSalience(activation)), rule, text.split(":", 1)[1].strip()
        activation = lib.GetNextActivation(env.env, activation)


def next_rule(env: ClipsEnvironment) -> str:
    """Return the rule that would fire next; empty when there is none."""
    activation = lib.GetNextActivation(env.env, NULL)
    return "" if activation == NULL else decode(lib.ActivationRuleName(activation))


def agenda_size(env: ClipsEnvironment) -> int:
    """Return how many activations there are."""
    activation, count = lib.GetNextActivation(env.env, NULL), 0
    while activation != NULL:
        activation, count = lib.GetNextActivation(env.env, activation), count + 1
    return count
