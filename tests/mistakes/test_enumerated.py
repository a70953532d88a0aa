"""Every file of an agent spoilt in every way, every key of its configuration with every wrong value."""

from __future__ import annotations

import re
import shutil
from itertools import product
from pathlib import Path
from typing import Final

import pytest

from cxbridge.cli.main import invoke
from tests.mistakes.enumerating import HARMLESS, SPOILT, files, keys
from tests.mistakes.making import AGENT
from tests.mistakes.table.mistake import RUN
from tests.support import needs_plugin, share
from tests.unprivileged import unprivileged

_CONFIG: Final = "scenario.yaml"
_PLACE: Final = re.compile(r"\bagent/[\w/.-]+:\d+\b")
_NO_LINE: Final = re.compile(
    r"\bagent: this folder has no scenario\.yaml and no config\.yaml"
    r"|\bagent/[\w/.-]+: cannot read the [a-z ]+: permission denied"
    r"|\bagent/scenario\.yaml: the folder has no configuration file"
    r"|cxbridge-studio names the events that the run waits for",
    re.IGNORECASE,
)
"""Said without a line: no file could have one, nobody may look into it, or only the studio knows the line."""

_TAKEN: Final = re.compile(
    r"(assert-time-each-loop|automatic-goal-retraction|steal-skiller-control) is a truth value"
    r"|1[468]: name is (a number|a truth value)"
)
"""Values that are fine for the key, if odd."""


@pytest.fixture(name="agent")
def _agent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return shutil.copytree(AGENT, tmp_path / "agent")


def end(capfd: pytest.CaptureFixture[str]) -> tuple[int, str]:
    """Run the agent as one who is not root; return the exit status and what it printed."""
    with unprivileged():
        status = invoke(RUN)
    return status, "".join(capfd.readouterr())


def check(status: int, text: str) -> None:
    """See to it that an agent with one mistake has ended as it should."""
    assert status in (1, 2, 3), text
    assert "Traceback" not in text
    lines = [line for line in text.splitlines() if not line.startswith("  hint: ")]
    assert any(_PLACE.search(line) or _NO_LINE.search(line) for line in lines), text
    if status == 2:
        causes = [line for line in lines if "the agent was not started" not in line]
        assert len(causes) == 1, text


SPOILING: Final = share(product(files(AGENT), SPOILT), 16, row=lambda case: case[1])
MISSPELT: Final = share(
    [(f"{line}: {change}", text) for change, line, text in keys((AGENT / _CONFIG).read_text())],
    20,
    row=lambda case: case[0].partition(" is ")[2],
)


@pytest.mark.parametrize(("file", "what"), SPOILING)
def test_a_file_that_is_spoilt(file: str, what: str, agent: Path, capfd: pytest.CaptureFixture[str]) -> None:
    SPOILT[what](agent / file)
    if _differs(agent / file):
        check(*end(capfd))


def _differs(file: Path) -> bool:
    """Whether a file is not as it was: XML and YAML may be in UTF-16."""
    if not file.is_file() or not file.stat().st_mode & 0o400:
        return True
    return not file.read_bytes().startswith((b"\xff\xfe", b"\xfe\xff")) or _is_code(file)


def _is_code(file: Path) -> bool:
    return file.suffix in (".clp", ".lua", ".pddl")


@pytest.mark.parametrize("what", HARMLESS)
def test_files_that_only_look_odd(what: str, agent: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for file in files(agent):
        HARMLESS[what](agent / file)
    status, text = end(capfd)
    assert status == 0, text


@pytest.mark.parametrize(
    ("change", "text"),
    [
        # the line of an action that is not mapped is in a CLIPS file, which the studio reads
        pytest.param(
            change, text, id=change, marks=[needs_plugin("studio")] if "action-mapping is" in change else []
        )
        for change, text in MISSPELT
    ],
)
def test_a_key_that_is_wrong(change: str, text: str, agent: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (agent / _CONFIG).write_text(text)
    status, printed = end(capfd)
    if _TAKEN.search(change):
        assert status == 0
    else:
        check(status, printed)
