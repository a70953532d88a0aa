"""An interrupted exploration resumes, and comes to the uninterrupted result."""

from __future__ import annotations

import os
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from explore_tests.retrying import write_retrying
from explore_tests.sessions import assert_ended, others_of_session
from explore_tests.test_explore import SCENARIO, counts, explored
from tests.forked import nursery

FAULTS = ("--faults", "3")
EACH = (*FAULTS, "--no-merge")
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")


def interrupted(folder: Path, *words: object) -> tuple[int, str]:
    """Interrupt an exploration when runs are under way; return its exit status and its output."""
    process, stdin, stdout, stderr = nursery().begin(
        ["explore", *map(str, words)], folder=folder, session=True
    )
    with process, stdin, stdout, stderr:
        while len(list(others_of_session(process.number))) < 3 and process.is_running:
            time.sleep(0.01)
        with suppress(ProcessLookupError):
            os.kill(process.number, signal.SIGINT)
        said = stderr.read().decode()
        status = process.wait(60)
    assert_ended(process.number)
    return status, said


@LINUX
@pytest.mark.parametrize("words", [EACH, FAULTS], ids=len)
def test_it_goes_on_after_ctrl_c(tmp_path: Path, words: tuple[str, ...]):
    scenario = write_retrying(tmp_path / "retrying", tries=5)
    whole = counts(explored(scenario, *words))
    status, said = interrupted(tmp_path, scenario, *words)
    assert status == 3
    assert "--resume explore.resume" in said
    times = 1
    while times < 3 and status == 3:
        status, said = interrupted(tmp_path, scenario, *words, "--resume", "explore.resume")
        times += 1
    found = explored(scenario, *words, "--resume", "explore.resume", folder=tmp_path)
    assert counts(found) == whole


@LINUX
def test_an_exploration_without_a_checkpoint_still_has_its_result(tmp_path: Path):
    (tmp_path / "explore.resume").mkdir()  # a folder in place of the file
    status, said = interrupted(tmp_path, write_retrying(tmp_path / "retrying", tries=5), *EACH)
    assert status == 3
    assert "no checkpoint was written: explore.resume: cannot be written" in said


@LINUX
def test_only_the_same_exploration_goes_on(tmp_path: Path):
    scenario = write_retrying(tmp_path / "retrying", tries=4)
    interrupted(tmp_path, scenario, *FAULTS)
    (tmp_path / "slow.yaml").write_text("otherwise: {fails: []}\n")
    resume = ("--resume", tmp_path / "explore.resume")
    for words, what in (
        ((scenario, "--faults", "2"), "faults"),
        ((scenario, *FAULTS, "--timeout", "3"), "timeout"),
        ((scenario, *FAULTS, "--property", "never (goal (class NOBODY))"), "properties"),
        ((scenario, *FAULTS, "--world", tmp_path / "slow.yaml"), "world"),
        ((SCENARIO, *FAULTS), "scenario"),
    ):
        refused(words, resume, what)
    agent = scenario / "mini.clp"
    agent.write_text(agent.read_text() + "; changed\n")
    refused((scenario, *FAULTS), resume, "files of the agent")


@pytest.mark.parametrize("content", [None, b"", b"\xff\xfe no exploration", b"\x80"])
def test_another_file_is_refused(tmp_path: Path, content: bytes | None):
    file = tmp_path / "file"
    if content is not None:
        file.write_bytes(content)
    refused((SCENARIO,), ("--resume", file), str(file))


def refused(words: tuple[object, ...], resume: tuple[object, ...], what: str) -> None:
    done = nursery().run(["explore", *map(str, (*words, *resume))])
    said = done.stderr.decode()
    assert done.returncode == 2, said
    assert what in said
    assert "Traceback" not in said
