"""The operation that returns the monitor's data, such as goals, plan-actions, skills, log and breakpoints."""

from __future__ import annotations

from typing import Any, Final

from msgspec import UNSET, Struct, UnsetType, to_builtins

from cxbridge.daemon.operations.operation import OperationContext, Operations
from cxbridge.daemon.operations.rules import stop_info
from cxbridge.rights import Right
from cxbridge_studio.debugger.debugger import Debugger
from cxbridge_studio.operations.debugger import list_breakpoint_infos
from cxbridge_studio.operations.environments import list_environment_names

OPERATIONS: Final = Operations()


class _StateQuery(Struct):
    """The data that a client selects.

    :meth:`cxbridge.daemon.requests.StateCollector.describe` has the defaults.

    :param since: the number of the last log line that the client has.
    :param goals: the maximum number of goals.
    :param words: a text; only the goals that contain it and their ancestors are returned.
    """

    since: int | UnsetType = UNSET
    goals: int | UnsetType = UNSET
    words: str | UnsetType = UNSET


@OPERATIONS.add("state", Right.LOOK, _StateQuery)
def _describe_run_state(context: OperationContext, parameters: _StateQuery) -> dict[str, Any]:
    executive = None if context.find_executive is None else context.find_executive()
    control = None if executive is None else executive.control
    debugger = control if isinstance(control, Debugger) else None
    return context.describe_state(to_builtins(parameters)) | {
        "where": stop_info(control),
        "breakpoints": list_breakpoint_infos(debugger),
        "environments": list(list_environment_names(context)),
    }
