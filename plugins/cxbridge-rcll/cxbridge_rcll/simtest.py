"""An agent's own tests in a game: its rules log the verdict and quit."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from cxbridge.config import Configuration
from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, LogLine
from cxbridge.suggestions import did_you_mean

FAILED: Final = "FAILED"
_SUCCEEDED: Final = "SUCCEEDED"
_PARAMETERS: Final = "parameters/simtest"
_FOLDER: Final = "src/clips-specs"
_FILE: Final = "simtest.clp"
# A case such as ``(case FULL then`` in the rule that chooses the facts of a testbed.
_CASE: Final = re.compile(r'\(case "?([\w-]+)"? then')
_VERDICT: Final = re.compile(rf"SIMTEST: ({_SUCCEEDED}|{FAILED})")


def turn_on(config: Configuration, spec: str, testbed: str, checkouts: Iterable[Path]) -> None:
    """Enable the tests in the rules of a spec.

    :param spec: the path of the spec in the configuration.
    :param checkouts: the checkouts with the agent's rules.
    :raises CxbridgeError: if the spec has no tests, or lacks the testbed.
    """
    name = spec.rpartition("/")[2]
    if not config.keys(f"{spec}/{_PARAMETERS}"):
        raise CxbridgeError(f"the spec '{name}' has no {_PARAMETERS}: its agent has no tests")
    testbeds = _testbeds(folder / _FOLDER / name / _FILE for folder in checkouts)
    if testbeds and testbed not in testbeds:
        raise CxbridgeError(
            f"the spec '{name}' has no testbed '{testbed}'",
            hint=did_you_mean(testbed, testbeds) or f"it has: {', '.join(testbeds)}",
        )
    config.set(f"{spec}/{_PARAMETERS}/enabled", True)
    config.set(f"{spec}/{_PARAMETERS}/testbed", testbed)


def _testbeds(files: Iterable[Path]) -> list[str]:
    """Return the testbeds in the first existing file; empty if no file names them."""
    file = next((file for file in files if file.is_file()), None)
    if file is None:
        return []
    return list(dict.fromkeys(_CASE.findall(file.read_text(errors="replace"))))


class Verdict:
    """Records the verdict of the tests from log lines: of several agents, the first failure decides."""

    def __init__(self) -> None:
        self.text = ""  # `SUCCEEDED` or `FAILED`; empty before a verdict

    def __call__(self, event: Event) -> None:
        match = _VERDICT.search(event.text) if isinstance(event, LogLine) else None
        if match is not None and self.text != FAILED:
            self.text = match[1]
