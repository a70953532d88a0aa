"""The commands of ``cxbridge trace``: output and exit status."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from cxbridge.events import SourceRead
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.formats.transitions_text import format_transition
from tests.support import needs_shared
from tests.trace.runs import NAMES, RECORDINGS, family, recording


@pytest.fixture
def run(tmp_path: Path) -> Path:
    with McapWriter(tmp_path / "run.mcap") as writer:
        writer.describe({"spec": "test"})
        for event in family():
            writer.write(event)
    return tmp_path / "run.mcap"


@pytest.fixture
def changed(tmp_path: Path) -> Path:
    lines = [format_transition(event) for event in family() if isinstance(event, TRANSITION_TYPES)]
    path = tmp_path / "changed.txt"
    path.write_text("\n".join(lines).replace("outcome=COMPLETED", "outcome=FAILED") + "\n")
    return path


@needs_shared
@pytest.mark.parametrize("name", NAMES)
def test_transitions_equal_recording(name: str, capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    assert invoke(["trace", "transitions", str(recording(name))]) == 0
    assert capsysbinary.readouterr().out == (RECORDINGS / name / "trace.txt").read_bytes()


@needs_shared
def test_rules_equal_recording(capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke(["trace", "rules", str(recording("skiller-1"))]) == 0
    rules = capsys.readouterr().out.splitlines()
    assert (len(rules), rules[0], rules[-1]) == (728, "executive-init-start", "skill-control-release")


def test_difference_is_shown_with_context(
    run: Path, changed: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert invoke(["trace", "diff", str(run), str(changed), "--order", "partial"]) == 1
    out = capsys.readouterr().out
    assert "differ in 1 thing, partial order: A has 18 transitions, B 18" in out
    assert "first difference: goal /RUN/WORK[2]: another outcome" in out
    assert re.search(
        r"  A \[17\] goal gen1 .* outcome=COMPLETED .*\n  B \[17\] goal gen1 .* outcome=FAILED ", out
    )
    assert ">     17   +0.000000 goal gen1 class=WORK" in out
    assert "    RUN-gen3 PARENT DISPATCHED\n      gen1 WORK FINISHED COMPLETED\n" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["diff", "RUN", "missing"], "cannot be read: No such file"),
        (["diff", "RUN", "RUN", "--level", "rules"], "has no events of level rules"),
        (["diff", "RUN", "RUN", "--level", "odd"], "'odd' is not one of transitions, skills"),
        (["diff", "RUN", "RUN", "--order", "odd"], "'odd' is not one of total, partial"),
        (["diff", "RUN", "RUN", "--only", "odd"], "pattern 'odd': unknown kind 'odd'"),
        (["diff", "RUN", "RUN", "--time-tolerance", "-1"], "-1"),
        (["diff", "RUN", "RUN", "--html", "RUN"], "is one of the runs"),
        (
            ["diff", "RUN", "RUN", "--time-tolerance", "1", "--level", "rules", "--order", "partial"],
            "rules have no times",
        ),
        (["diff", "RUN"], "Missing argument"),
        (["convert", "RUN", "RUN"], "a file cannot be converted to itself"),
        (["convert", "RUN", "out", "--to", "odd"], "'odd' is not one of mcap, fawkes-log, transitions"),
        (["convert", "BAD", "out"], "not a recorded run"),
        (["transitions", "BAD"], "not a recorded run"),
        (["rules", "BAD"], "not a recorded run"),
        (["info", "BAD"], "not a recorded run"),
        (["cat", "BAD"], "not a recorded run"),
        (["cat", "RUN", "--kind", "odd"], "unknown kind of event: 'odd'"),
        (["cat", "RUN", "--match", "("], "is not a regular expression"),
    ],
)
def test_invalid_arguments_are_errors(
    arguments: list[str], message: str, run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "bad").write_bytes(bytes(range(256)))
    paths = {"RUN": str(run), "BAD": str(tmp_path / "bad")}
    assert invoke(["trace", *(paths.get(argument, argument) for argument in arguments)]) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert not captured.out


def test_info(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke(["trace", "info", str(run)]) == 0
    assert [line.split() for line in capsys.readouterr().out.splitlines()] == [
        ["format", "mcap"],
        ["duration", "0.000000", "s"],
        ["goal", "13", "events"],
        ["plan-action", "3", "events"],
        ["skill", "2", "events"],
        ["spec", "test"],
    ]
    assert invoke(["trace", "info", str(run), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["events"] == {"goal": 13, "plan-action": 3, "skill": 2}


def test_cat(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke(["trace", "cat", str(run), "--kind", "skill", "--match", "FINAL"]) == 0
    assert capsys.readouterr().out == (
        '    0.000000 skill       SkillerInterface skill="say{}" msgid=1 status=S_FINAL\n'
    )
    assert invoke(["trace", "cat", str(run), "--json", "--kind", "skill", "--kind", "plan-action"]) == 0
    events = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [event["kind"] for event in events] == ["plan-action"] * 2 + ["skill"] * 2 + ["plan-action"]


def test_convert(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    copy = tmp_path / "copy.txt"
    assert invoke(["trace", "convert", str(run), str(copy), "--to", "transitions"]) == 0
    assert invoke(["trace", "transitions", str(run)]) == 0
    assert capsys.readouterr().out == copy.read_text()


def test_damage_of_file_is_reported_on_stderr(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run.write_bytes(run.read_bytes()[:-20])
    assert invoke(["trace", "transitions", str(run)]) == 0
    captured = capsys.readouterr()
    assert len(captured.out.splitlines()) == 18
    assert "damaged or cut off" in captured.err


def test_extracting_files(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with McapWriter(run) as writer:
        writer.write(SourceRead(1, "pddl", "", "/there/domain.pddl", b"(define)", {"kind": "domain"}))
        for event in family():
            writer.write(event)
    assert invoke(["trace", "extract", str(run), "pddl/*", "-o", str(tmp_path / "out")]) == 0
    file = tmp_path / "out" / "pddl" / "domain.pddl"
    assert capsys.readouterr().out == f"{file}\n"
    assert file.read_bytes() == b"(define)"
    assert invoke(["trace", "extract", str(run), "clips/*", "-o", str(tmp_path / "out")]) == 1
    assert "no file in it matches 'clips/*'" in capsys.readouterr().err
    assert invoke(["trace", "info", str(run)]) == 0
    assert "attached     pddl/domain.pddl (8 bytes)" in capsys.readouterr().out
