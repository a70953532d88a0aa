"""Reads the agenda of an environment: the activations in firing order."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from clips._clips import lib

from cxbridge.executive.host.capi import NULL, decode, items_of

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment


def read_activations(env: ClipsEnvironment) -> Iterator[tuple[int, str, str]]:
    """Yield the salience, the rule and the facts (``f-1,*``) of each activation, in firing order."""
    for activation in items_of(lib.GetNextActivation, env.c_env):
        rule, basis = decode(lib.ActivationRuleName(activation)), env.watcher.activation_basis(activation)
        yield int(lib.ActivationGetSalience(activation)), rule, basis


def find_next_rule(env: ClipsEnvironment) -> str:
    """Return the name of the rule that fires next; empty if the agenda is empty."""
    activation = lib.GetNextActivation(env.c_env, NULL)
    return "" if activation == NULL else decode(lib.ActivationRuleName(activation))
