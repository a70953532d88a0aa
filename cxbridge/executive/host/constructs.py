"""The names that the constructs of an environment define: rules, and the values that slots allow."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cxbridge.clipstext.syntax import without_module
from cxbridge.executive.host.values import Symbol

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment


def rule_names(env: ClipsEnvironment) -> frozenset[str]:
    """Return the names of all rules, without their modules."""
    found = env.call("get-defrule-list", Symbol("*"))
    return frozenset(without_module(str(name)) for name in found) if isinstance(found, tuple) else frozenset()


def allowed_values(env: ClipsEnvironment, template: str, slot: str) -> tuple[str, ...]:
    """Return the values that a slot of a deftemplate can have; none when it can have any, or is not there."""
    if not env.has_template(template):
        return ()
    found = env.call("deftemplate-slot-allowed-values", Symbol(template), Symbol(slot))
    return tuple(map(str, found)) if isinstance(found, tuple) else ()
