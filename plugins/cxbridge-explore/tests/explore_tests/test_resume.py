"""The resumption of an interrupted exploration."""

from __future__ import annotations

import os
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from explore_tests.retrying import write_retrying
from explore_tests.sessions import assert_ended, session_members
from explore_tests.test_explore import SCENARIO, run_explore, without_times
from tests.forked import nursery

FAULTS = ("--faults", "3")
UNMERGED = (*FAULTS, "--no-merge")
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")


def interrupt(folder: Path, *words: object) -> tuple[int, str]:
    """Interrupt an exploration during its runs; return its exit status and its stderr."""
    process, stdin, stdout, stderr = nursery().begin(
        ["explore", *map(str, words)], folder=folder, session=True
    )
    with process, stdin, stdout, stderr:
        while len(list(session_members(process.number))) < 3 and process.is_running:
            time.sleep(0.01)
        with suppress(ProcessLookupError):
            os.kill(process.number, signal.SIGINT)
        errors = stderr.read().decode()
        status = process.wait(60)
    assert_ended(process.number)
    return status, errors


@LINUX
@pytest.mark.parametrize("words", [UNMERGED, FAULTS], ids=len)
def test_interrupted_exploration_resumes_to_complete_result(tmp_path: Path, words: tuple[str, ...]):
    scenario = write_retrying(tmp_path / "retrying", tries=5)
    expected = without_times(run_explore(scenario, *words))
    status, errors = interrupt(tmp_path, scenario, *words)
    assert status == 3
    assert "--resume explore.resume" in errors
    interruptions = 1
    while interruptions < 3 and status == 3:
        status, errors = interrupt(tmp_path, scenario, *words, "--resume", "explore.resume")
        interruptions += 1
    result = run_explore(scenario, *words, "--resume", "explore.resume", folder=tmp_path)
    assert without_times(result) == expected


@LINUX
def test_interrupted_exploration_without_checkpoint_has_result(tmp_path: Path):
    (tmp_path / "explore.resume").mkdir()  # a folder in place of the file
    status, errors = interrupt(tmp_path, write_retrying(tmp_path / "retrying", tries=5), *UNMERGED)
    assert status == 3
    assert "no checkpoint was written: explore.resume: cannot be written" in errors


@LINUX
def test_changed_exploration_cannot_resume(tmp_path: Path):
    scenario = write_retrying(tmp_path / "retrying", tries=4)
    interrupt(tmp_path, scenario, *FAULTS)
    (tmp_path / "slow.yaml").write_text("otherwise: {fails: []}\n")
    resume = ("--resume", tmp_path / "explore.resume")
    for words, reason in (
        ((scenario, "--faults", "2"), "faults"),
        ((scenario, *FAULTS, "--timeout", "3"), "timeout"),
        ((scenario, *FAULTS, "--property", "never (goal (class UNUSED))"), "properties"),
        ((scenario, *FAULTS, "--world", tmp_path / "slow.yaml"), "world"),
        ((SCENARIO, *FAULTS), "scenario"),
    ):
        check_refused(words, resume, reason)
    agent = scenario / "mini.clp"
    agent.write_text(agent.read_text() + "; changed\n")
    check_refused((scenario, *FAULTS), resume, "files of the agent")


@pytest.mark.parametrize("content", [None, b"", b"\xff\xfe no exploration", b"\x80"])
def test_invalid_resume_file_is_refused(tmp_path: Path, content: bytes | None):
    file = tmp_path / "file"
    if content is not None:
        file.write_bytes(content)
    check_refused((SCENARIO,), ("--resume", file), str(file))


def check_refused(words: tuple[object, ...], resume: tuple[object, ...], reason: str) -> None:
    process = nursery().run(["explore", *map(str, (*words, *resume))])
    errors = process.stderr.decode()
    assert process.returncode == 2, errors
    assert reason in errors
    assert "Traceback" not in errors
