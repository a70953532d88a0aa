"""The long tests: a fifth of a second of processor time or more each, or a table of cases that takes long.

Most of the suite's time goes into 4 % of its tests: runs of many processes, explorations, large inputs. A run
of the whole suite draws an eighth of them by its seed; ``FULL=1``, and a run that names files or folders,
take all. Tests of the project's main claims are in each run.
"""

from __future__ import annotations

import json
import os
import random
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import pytest

from tests.support import FULL, SEED

LIST: Final = Path(__file__).with_name("long_tests.json")
"""The names of the long tests, without parameters. `pytest -p tests.costs --costs=long` writes it."""

_LEAST_SECONDS: Final = 0.2
_LEAST_SECONDS_OF_CASES: Final = 0.8
_LEAST_CASES: Final = 6
_SHARE: Final = 8
_WHOLE_SUITE: Final = "CXBRIDGE_WHOLE_SUITE"
_ALWAYS: Final = (
    "tests/docs/",
    "tests/executive/test_",
    "tests/run/test_run.py",
    "tests/scenarios/test_test_",
    "tests/test_architecture.py",
    "tests/test_packaging.py::test_the_wheel_works",
    "plugins/cxbridge-web/tests/web_tests/page/",
)
"""Beginnings of the names of tests in each run: recordings, the manual, the wheel, views of the page."""
_FIRST: Final = "plugins/cxbridge-web/tests/web_tests/page/"
"""The tests with a browser run first: they mostly wait, so that tests of more workers run meanwhile."""


def note_extent(config: pytest.Config) -> None:
    """Note in the environment, which workers inherit, whether this is a run of the whole suite."""
    if not hasattr(config, "workerinput"):
        whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS and not FULL
        os.environ[_WHOLE_SUITE] = "1" if whole else ""


def leave_out(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Remove the long tests that SEED does not draw from the tests of a run."""
    if not os.environ.get(_WHOLE_SUITE):
        return
    names = frozenset(_listed())
    left_out = [item for item in items if name_of(item.nodeid) in names and not _is_drawn(item.nodeid)]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        gone = set(left_out)
        items[:] = [item for item in items if item not in gone]


def put_tests_with_a_browser_first(items: list[pytest.Item]) -> None:
    """Put the tests with a browser first, for otherwise one worker has them left at the end of a run."""
    items.sort(key=lambda item: not item.nodeid.startswith(_FIRST))


def write_list(seconds: Mapping[str, float]) -> None:
    """Write the list of long tests. Tests that are not measured keep their place in it.

    :param seconds: the processor seconds of each test.
    """
    by_name: defaultdict[str, list[float]] = defaultdict(list)
    for nodeid, spent in seconds.items():
        by_name[name_of(nodeid)].append(spent)
    measured = {name for name, spent in by_name.items() if _is_long(spent) and not name.startswith(_ALWAYS)}
    names = measured | set(_listed()) - set(by_name)
    LIST.write_text(json.dumps(sorted(names), indent=0) + "\n", "utf-8")


def name_of(nodeid: str) -> str:
    """Return the name of a test without its parameters."""
    return nodeid.partition("[")[0]


def _is_long(seconds: list[float]) -> bool:
    is_slow_table = len(seconds) >= _LEAST_CASES and sum(seconds) >= _LEAST_SECONDS_OF_CASES
    return is_slow_table or sum(seconds) / len(seconds) >= _LEAST_SECONDS


def _listed() -> list[str]:
    names: list[str] = json.loads(LIST.read_text("utf-8"))
    return names


def _is_drawn(nodeid: str) -> bool:
    return random.Random(f"{SEED} {nodeid}").randrange(_SHARE) == 0
