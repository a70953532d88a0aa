"""Files with tests that an exploration has written, run by pytest."""

from __future__ import annotations

from pathlib import Path
from subprocess import CompletedProcess
from typing import Final

import pytest

from tests.forked import IGNORED, nursery

_OPTIONS: Final = ("-q", "-p", "cxbridge", "-p", "no:cacheprovider", "-W", IGNORED)


def pytest_of(file: Path, monkeypatch: pytest.MonkeyPatch) -> CompletedProcess[bytes]:
    """Run the tests of a file with our plug-in, in a child process."""
    # foreign plug-ins take longer to import than the run takes
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    command = [*_OPTIONS, "--rootdir", str(file.parent), str(file)]
    return nursery().run(command, folder=file.parent, program="pytest")
