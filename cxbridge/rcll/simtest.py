"""The tests that an agent runs in a game: its rules log whether they have succeeded, and leave the game."""

from __future__ import annotations

import re
from typing import Final

from cxbridge.config import Configuration
from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, LogLine

FAILED: Final = "FAILED"
_SUCCEEDED: Final = "SUCCEEDED"
_PARAMETERS: Final = "parameters/simtest"
_SAID: Final = re.compile(rf"SIMTEST: ({_SUCCEEDED}|{FAILED})")


def turn_on(config: Configuration, spec: str, testbed: str) -> None:
    """Let the rules of a spec test the agent.

    :param spec: its path in the configuration.
    :raises CxbridgeError: when it has no tests.
    """
    if not config.keys(f"{spec}/{_PARAMETERS}"):
        raise CxbridgeError(
            f"the spec '{spec.rpartition('/')[2]}' has no {_PARAMETERS}: its agent has no tests of its own"
        )
    config.set(f"{spec}/{_PARAMETERS}/enabled", True)
    config.set(f"{spec}/{_PARAMETERS}/testbed", testbed)


class Verdict:
    """Hears how the tests end; a sink of log lines. Of several agents one that fails decides."""

    def __init__(self) -> None:
        self.text = ""
        """``SUCCEEDED`` or ``FAILED``; empty while nobody has said it."""

    def __call__(self, event: Event) -> None:
        """Take a log line."""
        found = _SAID.search(event.text) if isinstance(event, LogLine) else None
        if found is not None and self.text != FAILED:
            self.text = found[1]
