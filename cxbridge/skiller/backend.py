"""The interface of Skillers for the rest of a run: each serves a SkillerInterface, one step a loop."""

from __future__ import annotations

from abc import abstractmethod
from typing import Final, Literal

from cxbridge.closing import Closing

DEFAULT_SKILLER: Final = "Skiller"
"""Id of the SkillerInterface that a Skiller serves unless its settings say otherwise."""

INSTANCES: Final = "/skiller/instances"
"""Where several Skillers are configured, by name."""

Mode = Literal["strict", "fawkes"]
"""What to do where Fawkes is odd: the sane thing (``strict``), or exactly what Fawkes does."""


class SkillerBackend(Closing):
    """Writes ``SkillerInterface::NAME`` and acts on its messages.

    :param name: the interface's id; ``Skiller`` unless there are several.
    """

    def __init__(self, name: str = DEFAULT_SKILLER) -> None:
        self.name = name

    @property
    def known_skills(self) -> frozenset[str] | None:
        """The skills that it can execute; None: unknown."""
        return None

    @property
    @abstractmethod
    def running(self) -> bool:
        """Whether a skill string is being executed: a run is not over before it is not."""

    @property
    def is_quiet(self) -> bool:
        """Whether nothing happens until a message comes."""
        return not self.running

    @abstractmethod
    def loop(self) -> None:
        """Take the messages and do one step; to be called once a main loop at the hook ``skill``."""

    @abstractmethod
    def close(self) -> None:
        """Close the interfaces; a skill that runs is dropped."""
