"""Reads rules with their texts, and the allowed values of slots, from a CLIPS environment."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from clips._clips import lib

from cxbridge.errors import ClipsError
from cxbridge.executive.host.capi import NULL, CData, decode, items_of
from cxbridge.executive.host.constructs import construct_names
from cxbridge.executive.host.values import Symbol
from cxbridge.suggestions import did_you_mean

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment


def iterate_rules(env: ClipsEnvironment) -> Iterator[tuple[str, CData]]:
    """Yield the name and the pointer of each rule of the current module, normally MAIN.

    Call this between runs of the rules.
    """
    for rule in items_of(lib.GetNextDefrule, env.c_env):
        yield decode(lib.DefruleName(rule)), rule


def read_rule_texts(env: ClipsEnvironment) -> dict[str, str]:
    """Return the texts of the rules of :func:`iterate_rules` by name, as the host rewrote them.

    :mod:`cxbridge.executive.host.source` describes the rewriting. Call this between runs of the rules.
    """
    # With (conserve-mem on), CLIPS keeps no text of a rule.
    forms = ((name, lib.DefrulePPForm(rule)) for name, rule in iterate_rules(env))
    return {name: decode(form) for name, form in forms if form != NULL}


def make_unknown_template_error(env: ClipsEnvironment, name: str) -> ClipsError:
    """Return the error about an unknown deftemplate."""
    templates = construct_names(env, "deftemplate")
    return ClipsError(f"there is no deftemplate '{name}'", hint=did_you_mean(name, templates) or None)


def read_allowed_values(env: ClipsEnvironment, template: str, slot: str) -> tuple[str, ...]:
    """Return a slot's allowed values; empty if the slot accepts any value or is unknown."""
    if not env.has_template(template):
        return ()
    # CLIPS returns FALSE for a slot that accepts any value.
    values = env.call("deftemplate-slot-allowed-values", Symbol(template), Symbol(slot))
    return tuple(map(str, values)) if isinstance(values, tuple) else ()
