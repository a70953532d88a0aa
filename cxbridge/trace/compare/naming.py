"""Names that differ from run to run, and what stands for them in a comparison.

Ids made by ``gensym*`` (``gen12``), UUIDs, fact indices and absolute times say nothing of what a run did.
docs/trace-model.md, section "Names", has the rules.
"""

from __future__ import annotations

import re

from cxbridge.clock import MICROSECONDS
from cxbridge.events import Event, FactChange, InterfaceMessage, InterfaceWrite, PlannerCall, RuleFired
from cxbridge.trace.codec import dump, plain_values
from cxbridge.trace.formats.transitions_text import format_transition
from cxbridge.transitions import TRANSITION_TYPES

_GENSYM = r"(?<![A-Za-z0-9])gen\d+(?![A-Za-z0-9])"
_UUID = r"(?<![0-9A-Za-z])[0-9a-fA-F]{8}(?:-[0-9a-fA-F]{4}){3}-[0-9a-fA-F]{12}(?![0-9A-Za-z])"
_INDEX = r"(?<=<Fact-)\d+(?=>)|(?<=-idx )[1-9]\d*(?=\))|(?<=\(meta-fact )[1-9]\d*(?=\))"
_TIME = r"(?<![\w.-])[1-9]\d{9}(?:\.\d+|[ ,]+(?:INTEGER )?\d{1,6})?(?![\w.-])"

_NAMES = re.compile(f"(?P<gen>{_GENSYM})|(?P<uuid>{_UUID})")
_FACT_NAMES = re.compile(f"(?P<gen>{_GENSYM})|(?P<uuid>{_UUID})|(?P<fact>{_INDEX})|(?P<time>{_TIME})")
_MSGID = re.compile(r"\(msgid \d+\)")
_IGNORED_FIELDS = frozenset({"msgid"})


def anonymous(text: str) -> str:
    """Return ``text`` with one and the same name for every gensym id and for every UUID."""
    return _NAMES.sub(_kind, text)


def anonymous_fact(text: str) -> str:
    """Return ``text`` with one name for all gensym ids, UUIDs, fact indices, message ids and times each."""
    return _MSGID.sub("(msgid #)", _FACT_NAMES.sub(_kind, text))


def interface_text(event: InterfaceWrite, *, with_msgid: bool) -> str:
    """Return the values of an interface write as text.

    :param with_msgid: whether the id of the message that a Skiller last took counts.
    """
    values = plain_values(event.values)
    if not with_msgid:
        values = {name: value for name, value in values.items() if name not in _IGNORED_FIELDS}
    return dump(values)


def _kind(match: re.Match[str]) -> str:
    return f"{match.lastgroup}#"


class Namer:
    """Names the things of one run by the order in which they appear."""

    def __init__(self) -> None:
        self._names: dict[str, str] = {}
        self._counts: dict[str, int] = {}

    def rename(self, text: str) -> str:
        """Return ``text`` with its gensym ids and UUIDs named by appearance."""
        return _NAMES.sub(self._name, text)

    def rename_fact(self, text: str) -> str:
        """Return ``text`` with gensym ids, UUIDs and fact indices named by appearance, without times."""
        return _FACT_NAMES.sub(self._name, text)

    def _name(self, match: re.Match[str]) -> str:
        kind = match.lastgroup or ""
        if kind == "time":
            return "time#"
        key = f"{kind} {match.group()}"
        name = self._names.get(key)
        if name is None:
            count = self._counts[kind] = self._counts.get(kind, 0) + 1
            name = self._names[key] = f"{kind}#{count}"
        return name


def describe(event: Event) -> str:
    """Return the event as one line of text, as a person should see it."""
    if isinstance(event, TRANSITION_TYPES):
        return format_transition(event)
    if isinstance(event, RuleFired):
        return f"FIRE {event.number:4d} {event.rule}: {event.basis}"
    if isinstance(event, FactChange):
        return f"{'==>' if event.asserted else '<=='} f-{event.index:<5d} {event.text}"
    if isinstance(event, InterfaceWrite):
        return f"{event.uid} {dump(plain_values(event.values))}"
    if isinstance(event, InterfaceMessage | PlannerCall):
        return _message_text(event) if isinstance(event, InterfaceMessage) else _planner_text(event)
    return str(event)


def _message_text(event: InterfaceMessage) -> str:
    """Return a message in words."""
    sender = f" from {event.sender}" if event.sender else ""
    values = dump(plain_values(event.values))
    return f"{event.uid} <- {event.message} {event.msgid}{sender}, {event.outcome}: {values}"


def _planner_text(event: PlannerCall) -> str:
    """Return a planner's call in words, without what is empty."""
    call = " ".join(filter(None, (event.call, f"for {event.goal}:", event.status, "by", event.planner)))
    if event.status == "started":
        return f"{call}: {event.problem} in domain {event.domain}"
    outcome = event.reason or f"{event.actions} actions"
    return f"{call} after {event.duration_us / MICROSECONDS:.3f} s: {outcome}"
