"""The agenda of an environment."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from clips._clips import lib

from cxbridge.executive.host.capi import NULL, decode

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment


def agenda(env: ClipsEnvironment) -> Iterator[tuple[int, str, str]]:
    """Yield salience, rule and facts (``f-1,f-2``) of each activation, in firing order."""
    activation = lib.GetNextActivation(env.env, NULL)
    while activation != NULL:
        env.output.pause()
        text = env.api.activation_text(activation)
        env.output.resume()
        rule = decode(lib.ActivationRuleName(activation))
        yield int(lib.ActivationGetSalience(activation)), rule, text.split(":", 1)[1].strip()
        activation = lib.GetNextActivation(env.env, activation)


def next_rule(env: ClipsEnvironment) -> str:
    """Return the first rule of the agenda; empty without one."""
    activation = lib.GetNextActivation(env.env, NULL)
    return "" if activation == NULL else decode(lib.ActivationRuleName(activation))


def agenda_size(env: ClipsEnvironment) -> int:
    activation, count = lib.GetNextActivation(env.env, NULL), 0
    while activation != NULL:
        activation, count = lib.GetNextActivation(env.env, activation), count + 1
    return count
