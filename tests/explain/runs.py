"""Recordings made of a list of events."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
from cxbridge.trace.formats.base import Attachment, Run

ENV = "executive"


class ListRun(Run):
    """A recording in memory."""

    format = "list"

    def __init__(self, events: Sequence[Event], files: Sequence[Attachment] = ()) -> None:
        super().__init__(Path("list.mcap"))
        self.events = events
        self.files = files

    @classmethod
    def recognises(cls, path: Path, head: bytes) -> bool:
        return False

    def __iter__(self) -> Iterator[Event]:
        return iter(self.events)

    def attachments(self) -> Iterator[Attachment]:
        return iter(self.files)


def us(seconds: float) -> int:
    """Seconds after a begin at 1000 s."""
    return 1_000_000_000 + round(seconds * 1e6)


def goal(
    at: float, name: str, mode: str, outcome: str = "UNKNOWN", error: str = "", parent: str = "nil"
) -> Event:
    """A transition of a goal; its class is its name without digits."""
    return GoalTransition(
        us(at), ENV, name, name.rstrip("0123456789").upper(), "nil", parent, mode, outcome, error
    )


def action(at: float, of: str, number: int, name: str, state: str) -> Event:
    """A transition of an action of a goal's plan."""
    return PlanActionTransition(us(at), ENV, str(number), of, f"{of}-PLAN", name, state)


def skill(at: float, text: str, status: str) -> Event:
    """What the Skiller says."""
    return SkillStatus(us(at), ENV, "Skiller", text, 1, status)


def skill_error(at: float, text: str) -> Event:
    """The Skiller's interface with the reason of a failure."""
    return InterfaceWrite(us(at), "SkillerInterface::Skiller", {"error": text})


def fired(at: float, rule: str, basis: str = "f-1") -> Event:
    """A rule fired."""
    return RuleFired(us(at), ENV, 1, rule, basis)


def fact(at: float, index: int, text: str, *, asserted: bool = True) -> Event:
    """A fact came or went."""
    return FactChange(us(at), ENV, asserted, index, text[1:].split(" ", maxsplit=1)[0].rstrip(")"), text)


def clips(name: str, text: str) -> Attachment:
    """A CLIPS file that is attached."""
    return Attachment(f"clips/{ENV}/{name}", "text/plain", text.encode())
