"""The operation that returns the monitor's data: goals, plan-actions, skills, log, breakpoints."""

from __future__ import annotations

from typing import Any, Final

from msgspec import UNSET, Struct, UnsetType, to_builtins

from cxbridge.operations.debugger import breakpoint_rows, stop_info
from cxbridge.operations.operation import OperationContext, Operations
from cxbridge.rights import Right

OPERATIONS: Final = Operations()


class _Wanted(Struct):
    since: int | UnsetType = UNSET
    goals: int | UnsetType = UNSET
    words: str | UnsetType = UNSET


@OPERATIONS.add("state", Right.LOOK, _Wanted)
def _state(context: OperationContext, given: _Wanted) -> dict[str, Any]:
    debugger = None if context.executive is None else context.executive.debugger
    return context.describe_state(to_builtins(given)) | {
        "where": stop_info(debugger),
        "breakpoints": breakpoint_rows(debugger),
        "environments": list(context.environments),
    }
