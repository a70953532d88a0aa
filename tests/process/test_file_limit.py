"""The limit of open files: clients do not use it up."""

from __future__ import annotations

import subprocess
import sys

import pytest

from cxbridge.process.file_limit import WEB_SHARE, ZMQ_SHARE, most_clients, share
from tests.support import ROOT

resource = pytest.importorskip("resource")


@pytest.mark.parametrize(("soft", "hard", "expected"), [(256, 1024, 1024), (300, 300, 300)])
def test_it_is_raised_as_far_as_is_allowed(soft, hard, expected):
    """In a process of its own: a hard limit cannot be raised again."""
    program = (
        "import resource\n"
        "from cxbridge.process.file_limit import raise_file_limit\n"
        f"resource.setrlimit(resource.RLIMIT_NOFILE, ({soft}, {hard}))\n"
        "print(raise_file_limit(), *resource.getrlimit(resource.RLIMIT_NOFILE))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.split() == [str(expected), str(expected), str(hard)]


def test_it_works_where_there_is_no_such_limit(monkeypatch):
    monkeypatch.setitem(sys.modules, "resource", None)
    from cxbridge.process.file_limit import raise_file_limit

    assert raise_file_limit() > 2048


@pytest.mark.parametrize(("files", "expected"), [(16384, 2048), (1024, 512), (600, 88), (64, 1)])
def test_something_is_left_for_the_rest(files, expected):
    assert most_clients(files, 2048) == expected


@pytest.mark.parametrize("files", [64, 256, 1024, 4096, 16384])
def test_the_shares_leave_files_for_the_process_itself(files):
    shares = share(files, 2112, ZMQ_SHARE) + share(files, 256, WEB_SHARE) + most_clients(files, 2048)
    assert shares + 24 <= files
    assert share(files, 5, ZMQ_SHARE) == 5
