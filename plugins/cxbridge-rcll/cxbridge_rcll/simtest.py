"""The tests that an agent has for games in simulation: its rules check a game, log a verdict, and quit.

The rules of an agent have several testbeds, each a set of checks.
"""

from __future__ import annotations

import re
from typing import Final

from cxbridge.config import Configuration
from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, LogLine

FAILED: Final = "FAILED"
_SUCCEEDED: Final = "SUCCEEDED"
_PARAMETERS_PATH: Final = "parameters/simtest"
_VERDICT_LINE: Final = re.compile(rf"SIMTEST: ({_SUCCEEDED}|{FAILED})")


def enable_simtest(config: Configuration, spec: str, testbed: str) -> None:
    """Enable the tests of a spec in the configuration.

    :param spec: the path of the spec in the configuration.
    :raises CxbridgeError: if the spec has no tests.
    """
    if not config.keys(f"{spec}/{_PARAMETERS_PATH}"):
        name = spec.rpartition("/")[2]
        raise CxbridgeError(f"the spec '{name}' has no {_PARAMETERS_PATH}: its agent has no tests")
    config.set(f"{spec}/{_PARAMETERS_PATH}/enabled", True)
    config.set(f"{spec}/{_PARAMETERS_PATH}/testbed", testbed)


class VerdictListener:
    """Finds the verdict of the tests in log lines; if several agents log a verdict, a failure decides."""

    def __init__(self) -> None:
        self.verdict = ""  # `SUCCEEDED` or `FAILED`; empty before a verdict

    def __call__(self, event: Event) -> None:
        match = _VERDICT_LINE.search(event.text) if isinstance(event, LogLine) else None
        if match is not None and self.verdict != FAILED:
            self.verdict = match[1]
