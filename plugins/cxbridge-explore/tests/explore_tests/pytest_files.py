"""Running of the tests that an exploration has written."""

from __future__ import annotations

from pathlib import Path
from subprocess import CompletedProcess
from typing import Final

import pytest

from tests.forked import IGNORED, nursery

_OPTIONS: Final = ("-q", "-p", "cxbridge", "-p", "no:cacheprovider", "-W", IGNORED)


def run_pytest(file: Path, monkeypatch: pytest.MonkeyPatch) -> CompletedProcess[bytes]:
    """Run the tests of a file with the plug-in `cxbridge` in a child process."""
    # the import of foreign plug-ins takes longer than the run
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    command = [*_OPTIONS, "--rootdir", str(file.parent), str(file)]
    return nursery().run(command, folder=file.parent, program="pytest")
