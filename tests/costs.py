"""Sums the processor time of tests by folder, with that of the processes they start: `pytest -p tests.costs`.

Durations by the wall clock mislead on a busy machine, and while workers share two cores. `--costs=files` sums
by file, `--costs=tests` by test. `FULL=1 pytest -p tests.costs --costs=long` writes the list of long tests
(tests/long.py).
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Generator, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from tests import long

_TICKS = os.sysconf("SC_CLK_TCK")
_PROPERTY = "processor seconds"
_LEAST = 0.1


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--costs", choices=("folders", "files", "tests", "long"), default="folders", help="what is summed"
    )


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Measure a test from its fixtures' setup to their teardown."""
    before = _spent()
    item.stash[_BEFORE] = before
    return (yield)


_BEFORE = pytest.StashKey[float]()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Add each phase's share to the report, which carries the share from a worker to the controller."""
    report = yield
    now = _spent()
    report.user_properties.append((_PROPERTY, max(0.0, now - item.stash[_BEFORE])))
    item.stash[_BEFORE] = now
    return report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Print the sums, the largest first; or write the list of long tests."""
    spent: defaultdict[str, float] = defaultdict(float)
    for report in _reports(terminalreporter):
        shares = [float(str(value)) for name, value in report.user_properties if name == _PROPERTY]
        spent[_group(report.nodeid, config.getoption("--costs"))] += shares[-1] if shares else 0.0
    if config.getoption("--costs") == "long":
        long.write_list(spent)
        return
    terminalreporter.section(f"processor seconds: {sum(spent.values()):.0f}")
    for name, seconds in sorted(spent.items(), key=lambda item: -item[1]):
        if seconds >= _LEAST:
            terminalreporter.line(f"{seconds:8.1f}  {name}")


def _reports(reporter: pytest.TerminalReporter) -> Iterator[pytest.TestReport]:
    for reports in reporter.stats.values():
        for report in reports:
            if isinstance(report, pytest.TestReport):
                yield report


def _group(nodeid: str, by: str) -> str:
    if by in ("tests", "long"):
        return nodeid
    path = nodeid.partition("::")[0]
    return path if by == "files" else str(Path(path).parent)


def _spent() -> float:
    """Return the processor seconds of this process, its ended children and all living descendants."""
    return sum(map(_seconds_of, _family()))


def _family() -> Iterator[int]:
    waiting = [os.getpid()]
    while waiting:
        pid = waiting.pop()
        yield pid
        with suppress(OSError):
            for thread in list(Path(f"/proc/{pid}/task").iterdir()):
                waiting += map(int, (thread / "children").read_text("ascii").split())


def _seconds_of(pid: int) -> float:
    try:
        text = Path(f"/proc/{pid}/stat").read_text("utf-8", "replace")
    except OSError:  # the process has ended
        return 0.0
    times = text.rpartition(")")[2].split()[11:15]  # behind the command's name: state, parent, ...
    return sum(map(int, times)) / _TICKS
