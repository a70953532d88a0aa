"""The shell's completion, with the environment of a shell."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from cxbridge import resources
from cxbridge.errors import CxbridgeError
from tests.support import share

PROGRAM = "from cxbridge.cli.main import main; main()"


def complete(line, **environment):
    """The candidates of bash for the last word of a line."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env=os.environ
        | {"_CXBRIDGE_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(line.count(" "))}
        | environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    return done.stdout.split()


@pytest.mark.parametrize(
    ("line", "expected"),
    share(
        [
            ("cxbridge run test", ["test-scenario", "test-scenario-pddl"]),
            ("cxbridge run tests/", []),
            ("cxbridge interface show Skiller", ["SkillerDebugInterface", "SkillerInterface"]),
            ("cxbridge interface check Lamp", []),
            ("cxbridge doc", ["doctor"]),
            ("cxbridge trace transi", ["transitions"]),
            ("cxbridge daemon pau", ["pause"]),  # start is the default command
            ("cxbridge daemon --secret-k", ["--secret-key"]),
        ],
        3,
    ),
)
def test_completion_offers_names_with_prefix(line, expected):
    assert complete(line) == expected


@pytest.mark.parametrize(
    ("shell", "mark"),
    [("bash", "complete_bash"), ("zsh", "#compdef cxbridge"), ("fish", "complete --command cxbridge")],
)
def test_completion_scripts_of_shells(shell, mark):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env=os.environ | {"_CXBRIDGE_COMPLETE": f"source_{shell}"},
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert mark in done.stdout


def test_incomplete_installation_offers_no_names(monkeypatch):
    def absent(name):
        raise CxbridgeError(f"no {name}")

    monkeypatch.setattr(resources, "shipped_dir", absent)
    assert resources.shipped_scenarios() == resources.shipped_interfaces() == []
