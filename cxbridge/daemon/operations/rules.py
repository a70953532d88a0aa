"""The operation that reports where a debugger has stopped the rules."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from msgspec import convert

from cxbridge.daemon.operations.operation import NoParameters, OperationContext, Operations
from cxbridge.daemon.operations.replies import StopInfo
from cxbridge.rights import Right

if TYPE_CHECKING:
    from cxbridge.executive.executive import RuleControl

OPERATIONS: Final = Operations()


def stop_info(control: RuleControl | None) -> StopInfo | None:
    """Return where a debugger has stopped the rules; None if the rules run or have no debugger."""
    stopped = None if control is None else control.stopped
    return None if stopped is None else convert(stopped, StopInfo, from_attributes=True)


@OPERATIONS.add("where", Right.LOOK, NoParameters)
def _find_stop(context: OperationContext, _parameters: NoParameters) -> StopInfo | None:
    return stop_info(context.executive.control)
