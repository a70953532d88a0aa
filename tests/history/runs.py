"""Recordings from lists of events."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

from cxbridge.events import (
    Event,
    FactChange,
    GoalTransition,
    InterfaceWrite,
    PlanActionTransition,
    RuleFired,
    SkillStatus,
)
from cxbridge.trace.formats.base import Run, StoredFile

ENV = "executive"


class ListRun(Run):
    """A recording in memory."""

    format = "list"

    def __init__(self, events: Sequence[Event], texts: Mapping[str, str] | None = None) -> None:
        super().__init__(Path("list.mcap"))
        self.events = events
        self.texts = texts or {}

    def __iter__(self) -> Iterator[Event]:
        return iter(self.events)

    def files(self) -> Iterator[StoredFile]:
        for name, text in self.texts.items():
            yield StoredFile(name, "text/x-clips", len(text), 0, partial(text.encode))

    def source_records(self) -> Iterator[Mapping[str, str]]:
        for name in self.texts:
            yield {
                "role": "clips",
                "owner": ENV,
                "name": f"/agent/{name}",
                "attachment": name,
                "time_us": "0",
            }


def us(seconds: float) -> int:
    """Return the time of seconds after a begin at 1000 s."""
    return 1_000_000_000 + round(seconds * 1e6)


def goal(
    at: float, name: str, mode: str, outcome: str = "UNKNOWN", error: str = "", parent: str = "nil"
) -> Event:
    """Return a transition of a goal whose class is its name without digits."""
    return GoalTransition(
        us(at), ENV, name, name.rstrip("0123456789").upper(), "nil", parent, mode, outcome, error
    )


def action(at: float, of: str, number: int, name: str, state: str) -> Event:
    """Return a transition of an action of a goal's plan."""
    return PlanActionTransition(us(at), ENV, str(number), of, f"{of}-PLAN", name, state)


def skill(at: float, text: str, status: str) -> Event:
    """Return a status of the Skiller."""
    return SkillStatus(us(at), ENV, "Skiller", text, 1, status)


def skill_error(at: float, text: str) -> Event:
    """Return a write of the Skiller's interface with the reason of a failure."""
    return InterfaceWrite(us(at), "SkillerInterface::Skiller", {"error": text})


def fired(at: float, rule: str, basis: str = "f-1") -> Event:
    """Return the firing of a rule."""
    return RuleFired(us(at), ENV, 1, rule, basis)


def fact(at: float, index: int, text: str, *, asserted: bool = True) -> Event:
    """Return the assertion or retraction of a fact."""
    return FactChange(us(at), ENV, asserted, index, text[1:].split(" ", maxsplit=1)[0].rstrip(")"), text)
