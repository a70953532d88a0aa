"""Replies that operations and servers share."""

from __future__ import annotations

from typing import Annotated, Final

from msgspec import Meta, Struct

_KINDS: Final = ["before", "after", "line", "transition", "step", "asked"]
_STATES: Final = ["UNCONFIGURED", "INACTIVE", "ACTIVE", "FINALIZED"]


class StopInfo(Struct):
    """The place at which a debugger has stopped the rules.

    :param kind: the event that has stopped the rules.
    :param breakpoint: the number of the breakpoint; 0 without one.
    :param rule: the rule that fired last; empty if no rule has fired.
    :param next_rule: the first rule of the agenda; empty if the agenda is empty.
    :param loop: the number of the cycle.
    :param fired: the number of rules that have fired in the cycle.
    """

    kind: Annotated[str, Meta(extra_json_schema={"enum": _KINDS})]
    reason: str
    breakpoint: int
    rule: str
    next_rule: str
    loop: int
    fired: int
    time_us: int


class ComponentState(Struct):
    """The state of a component."""

    name: str
    state: Annotated[str, Meta(extra_json_schema={"enum": _STATES})]
    since_us: int
    reason: str
