"""The tests that an agent has for games in simulation: its rules check a game, log a verdict, and quit.

The rules of an agent have several testbeds, each a set of checks.
"""

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
_PARAMETERS_PATH: Final = "parameters/simtest"
_SPECS_FOLDER: Final = "src/clips-specs"
_TESTS_FILE: Final = "simtest.clp"
# a case such as `(case FULL then` in the rule that asserts the facts of the chosen testbed
_TESTBED_CASE: Final = re.compile(r'\(case "?([\w-]+)"? then')
_VERDICT_LINE: Final = re.compile(rf"SIMTEST: ({_SUCCEEDED}|{FAILED})")


def enable_simtest(config: Configuration, spec: str, testbed: str, checkouts: Iterable[Path]) -> None:
    """Enable the tests of a spec in the configuration.

    :param spec: the path of the spec in the configuration.
    :param checkouts: the checkouts with the agent's rules.
    :raises CxbridgeError: if the spec has no tests, or lacks the testbed.
    """
    name = spec.rpartition("/")[2]
    if not config.keys(f"{spec}/{_PARAMETERS_PATH}"):
        raise CxbridgeError(f"the spec '{name}' has no {_PARAMETERS_PATH}: its agent has no tests")
    testbeds = _find_testbeds(folder / _SPECS_FOLDER / name / _TESTS_FILE for folder in checkouts)
    if testbeds and testbed not in testbeds:
        raise CxbridgeError(
            f"the spec '{name}' has no testbed '{testbed}'",
            hint=did_you_mean(testbed, testbeds) or f"it has: {', '.join(testbeds)}",
        )
    config.set(f"{spec}/{_PARAMETERS_PATH}/enabled", True)
    config.set(f"{spec}/{_PARAMETERS_PATH}/testbed", testbed)


def _find_testbeds(files: Iterable[Path]) -> list[str]:
    """Return the testbeds in the first existing file; empty if no file exists."""
    file = next((file for file in files if file.is_file()), None)
    if file is None:
        return []
    return list(dict.fromkeys(_TESTBED_CASE.findall(file.read_text(errors="replace"))))


class VerdictListener:
    """Finds the verdict of the tests in log lines; if several agents log a verdict, a failure decides."""

    def __init__(self) -> None:
        self.text = ""  # `SUCCEEDED` or `FAILED`; empty before a verdict

    def __call__(self, event: Event) -> None:
        match = _VERDICT_LINE.search(event.text) if isinstance(event, LogLine) else None
        if match is not None and self.text != FAILED:
            self.text = match[1]
