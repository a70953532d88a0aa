"""Settings for all tests."""

from __future__ import annotations

import gc
import os
import signal
import sys
from contextlib import suppress

import pytest
from hypothesis import HealthCheck, settings

from tests import guard, long
from tests.support import FULL, SEED, many

guard.watch()

# else Python compiles the whole program again for each of the hundreds of processes that tests start
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# what somebody prefers for terminals is not how the texts of the tests are written
for _name in ("CLICOLOR", "CLICOLOR_FORCE", "COLUMNS", "FORCE_COLOR", "LINES", "NO_COLOR", "TTY_COMPATIBLE"):
    os.environ.pop(_name, None)

# Other work on the machine must not fail a property. The same examples each time, unless one looks for more:
# what fails shall fail where it was written, not where it is merged.
settings.register_profile(
    "cxbridge",
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    max_examples=many(100, 25),
    derandomize=not FULL,
)
settings.load_profile("cxbridge")

# a shell's background jobs ignore some signals and hand that on: what the tests start shall hear them
for _number in (signal.SIGINT, signal.SIGHUP):
    if signal.getsignal(_number) is signal.SIG_IGN:
        with suppress(ValueError):  # not in the main thread
            signal.signal(_number, signal.default_int_handler if _number == signal.SIGINT else signal.SIG_DFL)

_GARBAGE_THRESHOLD = 10_000
"""As many new objects as Python's collector waits for: the program has such a number too (cli/entry.py)."""


def pytest_configure(config: pytest.Config) -> None:
    long.note_extent(config)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    long.leave_out(config, items)
    long.put_tests_with_a_browser_first(items)


@pytest.hookimpl(tryfirst=True)
def pytest_collection(session: pytest.Session) -> None:
    """Let Python's collector wait until all tests are there, else it goes through them again and again."""
    gc.disable()


@pytest.hookimpl(trylast=True)
def pytest_collection_finish(session: pytest.Session) -> None:
    """Let it leave out the tests and modules, which stay to the end, and look for garbage less often."""
    gc.freeze()
    gc.enable()
    gc.set_threshold(_GARBAGE_THRESHOLD, *gc.get_threshold()[1:])


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Tell how to draw the same parts of the enumerations again."""
    if not FULL:
        terminalreporter.line(f"parts of the enumerations were drawn by SEED={SEED}; FULL=1 takes them whole")
