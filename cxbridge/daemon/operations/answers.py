"""Replies that operations and servers share."""

from __future__ import annotations

from typing import Annotated, Final

from msgspec import Meta, Struct

_KINDS: Final = ["before", "after", "line", "transition", "step", "asked"]
_STATES: Final = ["UNCONFIGURED", "INACTIVE", "ACTIVE", "FINALIZED"]


class StopInfo(Struct):
    """The stop of the rules."""

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
