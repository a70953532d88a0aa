"""One mistake of a new user, and how a command has to end with it."""

from __future__ import annotations

from typing import Final

from msgspec import Struct

from tests.fawkes import NO_SERVER

RUN: Final = ("run", "agent", "--skill-dir", "agent/skills", "--interface-dir", "agent")
DAEMON: Final = (
    "daemon",
    "agent",
    "--skill-dir",
    "agent/skills",
    "--interface-dir",
    "agent",
    *NO_SERVER,
    "--endpoint",
    "ipc://agent/daemon.socket",
)

BAD_INPUT: Final = 2
STUCK: Final = 3
"""The exit status of a run in which nothing can happen any more, as the studio finds out."""


class Edit(Struct, frozen=True):
    """A change of a file of the agent.

    :param file: its path in the agent's folder.
    :param old: what is replaced, once; empty: the file as a whole.
    :param new: what takes its place; None: the file is removed.
    """

    file: str
    old: str = ""
    new: str | None = ""


class Mistake(Struct, frozen=True):
    """A mistake.

    :param name: what the user did.
    :param says: a regular expression: the cause, as it is reported.
    :param edits: what the user changed in an agent that is fine.
    :param at: ``FILE:LINE`` of the mistake, as far as it is in a file.
    :param command: of ``cxbridge``.
    :param status: the exit status.
    """

    name: str
    says: str
    edits: tuple[Edit, ...] = ()
    at: str = ""
    command: tuple[str, ...] = RUN
    status: int = BAD_INPUT


def mistake(
    name: str,
    file: str,
    old: str,
    new: str | None,
    says: str,
    at: str = "",
    *,
    status: int = BAD_INPUT,
    command: tuple[str, ...] = RUN,
) -> Mistake:
    """Return a mistake that is one change of one file."""
    return Mistake(name, says, (Edit(file, old, new),), at, command, status)
