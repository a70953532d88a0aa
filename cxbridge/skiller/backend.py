"""The common interface of Skillers: each serves a SkillerInterface, one step per loop."""

from __future__ import annotations

from abc import abstractmethod
from typing import Final, Literal

from cxbridge.closing import Closing

DEFAULT_SKILLER: Final = "Skiller"
"""The default id of a Skiller's interface."""

INSTANCES: Final = "/skiller/instances"
"""The configuration path of several Skillers, by name."""

Mode = Literal["strict", "fawkes"]
"""``fawkes`` imitates Fawkes' oddities, ``strict`` avoids them."""


class SkillerBackend(Closing):
    """Writes ``SkillerInterface::NAME`` and handles its messages.

    :param name: the interface's id.
    """

    def __init__(self, name: str = DEFAULT_SKILLER) -> None:
        self.name = name

    @property
    def known_skills(self) -> frozenset[str] | None:
        """The executable skills; None: unknown."""
        return None

    @property
    @abstractmethod
    def running(self) -> bool:
        """Whether a skill string is being executed, so that a run must wait."""

    @property
    def is_quiet(self) -> bool:
        """Whether the Skiller is idle until the next message."""
        return not self.running

    @abstractmethod
    def loop(self) -> None:
        """Handle the messages and execute one step. To be called once per cycle, at the hook ``SKILL``."""

    @abstractmethod
    def close(self) -> None:
        """Close the interfaces and drop a running skill."""
