"""Nothing that the tests start outlives them."""

from __future__ import annotations

import os
import select
import subprocess
import sys

import pytest

from tests.support import ROOT

PROGRAM = """
import os, subprocess, sys, time
from tests import guard
guard.watch()
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"], start_new_session=True)
print(child.pid, flush=True)
time.sleep(600)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")
def test_process_in_separate_session_ends_with_killed_tests() -> None:
    with subprocess.Popen([sys.executable, "-c", PROGRAM], cwd=ROOT, stdout=subprocess.PIPE) as tests:
        assert tests.stdout is not None
        child = os.pidfd_open(int(tests.stdout.readline()))
        tests.kill()
    assert select.select([child], [], [], 60)[0]
    os.close(child)
