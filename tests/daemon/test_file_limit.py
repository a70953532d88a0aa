"""The limit of open files: clients do not use it up."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.support import ROOT

resource = pytest.importorskip("resource")


@pytest.mark.parametrize(("soft", "hard", "expected"), [(256, 1024, 1024), (300, 300, 300)])
def test_it_is_raised_as_far_as_is_allowed(soft, hard, expected):
    """In a process of its own: a hard limit cannot be raised again."""
    program = (
        "import resource\n"
        "from cxbridge.daemon.process import raise_file_limit\n"
        f"resource.setrlimit(resource.RLIMIT_NOFILE, ({soft}, {hard}))\n"
        "raise_file_limit()\n"
        "print(*resource.getrlimit(resource.RLIMIT_NOFILE))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.split() == [str(expected), str(hard)]
