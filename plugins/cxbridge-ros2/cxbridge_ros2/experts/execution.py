"""Plans as text, and their execution by PlanSys2's executor."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from cxbridge.errors import Ros2Error
from cxbridge_ros2.actions import ActionClient, GoalStatus, SentGoal
from cxbridge_ros2.experts.client import DEFAULT_SERVER_TIMEOUT_S, ExpertClient, ExpertRefusedError
from cxbridge_ros2.experts.definitions import EXECUTE_PLAN
from cxbridge_ros2.messages import Message

_ACTION_NAME: Final = "/execute_plan"
# Constants of plansys2_msgs/msg/ActionExecutionInfo.
_FAILED: Final = 3
# 1, NOT_EXECUTED, is missing: the state of each action at the start is not reported
_STATES: Final = {2: "executing", _FAILED: "failed", 4: "succeeded", 5: "cancelled"}

_NUMBER_PATTERN: Final = r"(\d+(?:\.\d+)?)"
_ITEM_PATTERN: Final = re.compile(
    rf"\s*{_NUMBER_PATTERN}\s*:\s*(\([^()]+\))\s*(?:\[\s*{_NUMBER_PATTERN}\s*\])?\s*"
)

PlanItem = Mapping[str, Any]  # a plansys2_msgs/msg/PlanItem


def parse_item(text: str) -> PlanItem | None:
    """Parse a line of a plan such as ``0.000: (move r2 hall dock) [5.000]``; return None for other lines."""
    match = _ITEM_PATTERN.fullmatch(text)
    if match is None:
        return None
    return {"time": float(match[1]), "action": match[2], "duration": float(match[3] or 0)}


def read_plan(file: Path) -> list[PlanItem]:
    """Return the plan in a file with one action a line; empty lines and comments (``;``) are skipped.

    :raises Ros2Error: if the file cannot be read, or a line is not an action.
    """
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise Ros2Error(f"cannot read {file}: {error}") from None
    items = []
    for number, line in enumerate(lines, start=1):
        text = line.partition(";")[0]
        if not text.strip():
            continue
        item = parse_item(text)
        if item is None:
            raise Ros2Error(
                f"'{text.strip()}' is not an action of a plan",
                file=file,
                line=number,
                hint="write TIME: (ACTION ARGUMENTS) [DURATION]",
            )
        items.append(item)
    return items


def execute_plan(client: ExpertClient, items: Sequence[PlanItem]) -> Iterator[str]:
    """Execute a plan; yield a text about each change of an action's state, and about the success of the plan.

    Closing the generator early cancels the plan.

    :raises ExpertRefusedError: if the plan fails; the error names the failed actions.
    :raises Ros2Error: if there is no executor, or the executor vanishes.
    """
    name = client.namespace + _ACTION_NAME
    with ActionClient(client.node, name, EXECUTE_PLAN) as executor:
        if not client.wait(lambda: executor.has_server, DEFAULT_SERVER_TIMEOUT_S):
            raise Ros2Error(f"{name} has no server", hint=executor.explain_missing_server() or None)
        sent_goal = executor.send({"plan": {"items": items}})
        states: dict[str, int] = {}
        try:
            while not sent_goal.is_over:
                has_changed = client.wait(
                    lambda: sent_goal.is_over or _has_changes(sent_goal, states), DEFAULT_SERVER_TIMEOUT_S
                )
                executor.check_server(sent_goal)
                if not has_changed and not executor.has_server:
                    raise Ros2Error(f"the executor of {name} has vanished")
                yield from _describe_changes(_list_action_infos(sent_goal.feedback), states)
        finally:
            if not sent_goal.is_over:  # the caller has closed this generator, or the executor has vanished
                sent_goal.cancel()
                client.wait(lambda: sent_goal.is_over, DEFAULT_SERVER_TIMEOUT_S)
    if sent_goal.is_accepted is False:
        raise ExpertRefusedError(f"{name} has rejected the plan")
    infos = _list_action_infos(sent_goal.result)
    yield from _describe_changes(infos, states)
    if sent_goal.status is not GoalStatus.SUCCEEDED or not (sent_goal.result or {}).get("success"):
        failed_actions = [
            f"{_format_action(info)} {info['message_status']}".rstrip()
            for info in infos
            if info["status"] == _FAILED
        ]
        reason = sent_goal.reason or "; ".join(failed_actions) or sent_goal.status.name
        raise ExpertRefusedError(f"the plan has failed: {reason}")
    yield "the plan has succeeded"


def _list_action_infos(message: Message | None) -> Sequence[Message]:
    infos: Sequence[Message] = (message or {}).get("action_execution_status", [])
    return infos


def _has_changes(sent_goal: SentGoal, states: Mapping[str, int]) -> bool:
    return any(
        states.get(info["action_full_name"]) != info["status"]
        for info in _list_action_infos(sent_goal.feedback)
    )


def _describe_changes(infos: Sequence[Message], states: dict[str, int]) -> Iterator[str]:
    """Yield a text about each change of an action's state, and store the new states.

    :param states: the last reported states by action.
    """
    for info in infos:
        name, status = info["action_full_name"], info["status"]
        if status != states.get(name) and status in _STATES:
            yield f"{_format_action(info)}: {_STATES[status]}"
        states[name] = status


def _format_action(info: Message) -> str:
    return f"({' '.join((info['action'], *info['arguments']))})"
