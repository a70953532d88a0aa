"""The script of a Skiller: its commands, from its writes."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.events import InterfaceMessage, InterfaceWrite
from cxbridge.run.replay.script import CommandKind, SkillerScript, make_executor_script, make_skiller_script

UID = "SkillerInterface::Skiller"


def script(*writes: tuple[str, int, str, str]) -> SkillerScript:
    """The script of writes: skill string, message id, status, controller; a millisecond apart."""
    return make_skiller_script(
        InterfaceWrite(
            1000 * number,
            UID,
            {
                "skill_string": skill,
                "msgid": msgid,
                "status": status,
                "exclusive_controller": controller,
                "error": "",
            },
        )
        for number, (skill, msgid, status, controller) in enumerate(writes)
    )


def describe_commands(found: SkillerScript) -> list[tuple[CommandKind, str, list[Any]]]:
    return [
        (command.kind, command.text, [(after, values["status"]) for after, values in command.later_writes])
        for command in found.commands
    ]


def test_script_has_control_then_skills_with_results() -> None:
    found = script(
        ("", 0, "S_INACTIVE", "us"),
        ("a{}", 2, "S_RUNNING", "us"),
        ("a{}", 2, "S_FINAL", "us"),
        ("b{}", 3, "S_RUNNING", "us"),
        ("b{}", 3, "S_FAILED", "us"),
        ("b{}", 3, "S_FAILED", ""),
    )
    assert describe_commands(found) == [
        (CommandKind.CONTROL, "", []),
        (CommandKind.EXEC, "a{}", [(1000, "S_FINAL")]),
        (CommandKind.EXEC, "b{}", [(1000, "S_FAILED")]),
    ]


def test_rest_of_earlier_run_is_no_command() -> None:
    found = script(("old{}", 9, "S_FINAL", "us"), ("a{}", 2, "S_RUNNING", "us"))
    assert describe_commands(found) == [(CommandKind.CONTROL, "old{}", []), (CommandKind.EXEC, "a{}", [])]
    assert [values["status"] for _, values in script(("old{}", 9, "S_FINAL", "")).initial_writes] == [
        "S_FINAL"
    ]


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["", "a{}", "b{}"]),
            st.integers(0, 2),
            st.sampled_from(["S_INACTIVE", "S_RUNNING", "S_FINAL", "S_FAILED"]),
            st.sampled_from(["", "us", "you"]),
        )
    )
)
def test_script_keeps_all_writes_but_ends_of_control(writes: list[tuple[str, int, str, str]]) -> None:
    found = script(*writes)
    kept = len(found.initial_writes) + sum(1 + len(command.later_writes) for command in found.commands)
    ends = sum(one[3] != other[3] for one, other in zip([("", 0, "", ""), *writes], writes, strict=False))
    assert len(writes) - ends <= kept <= len(writes)
    times = [command.time_us for command in found.commands]
    assert times == sorted(times)


@pytest.mark.parametrize(
    ("text", "parameters", "call"), [('{"to":"a"}', {"to": "a"}, 'go {"to": "a"}'), ("[1]", None, "go")]
)
def test_script_has_skills_of_executor_with_messages(text: str, parameters: Any, call: str) -> None:
    """Parameters that were JSON, but no object, ended a replay with a TypeError."""

    def write(time_us: int, state: str, master: int) -> InterfaceWrite:
        values = {
            "agent": "r",
            "skills": "go see",
            "state": state,
            "epoch": 1,
            "master": master,
            "skill": "go",
        }
        return InterfaceWrite(time_us, "SkillExecutorInterface::e", values)

    def message(time_us: int, kind: str, **values: Any) -> InterfaceMessage:
        board = kind in ("FeedbackMessage", "FinishMessage")
        uid = "SkillBoardInterface::b" if board else "SkillExecutorInterface::e"
        more = {"executor": "e"} if board else {}
        return InterfaceMessage(
            time_us, uid, kind, 1, "x", "queued", {"epoch": 1, "master": 7} | more | values
        )

    writes = [write(0, "IDLE", 0), write(10, "RESERVED", 7), write(20, "BUSY", 7), write(90, "IDLE", 0)]
    messages = [
        message(10, "RequestMessage", parameters=text),
        message(50, "FeedbackMessage", progress=0.5, text="half"),
        message(90, "FinishMessage", outcome="FAILED", error="lost"),
    ]
    found = make_executor_script("e", writes, messages)
    (execution,) = found.executions
    assert (found.agent, found.skills) == ("r", ("go", "see"))
    assert (execution.parameters, execution.duration_us) == (parameters, 70)
    assert (execution.feedback, execution.outcome, execution.error, str(execution)) == (
        [(30, 0.5, "half")],
        "FAILED",
        "lost",
        call,
    )
