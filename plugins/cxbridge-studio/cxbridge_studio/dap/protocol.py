"""The implemented part of the Debug Adapter Protocol: messages, their arguments and their bodies.

The names of messages and fields are those of the specification, version 1.68. Only the classes of arguments
that several requests share, and of bodies, have other names: there the specification has a type for each
request, or none. Arguments that the adapter does not read have no field here, so msgspec ignores them.
"""

from __future__ import annotations

from typing import Any, Final, TypeVar

import msgspec

EMPTY_ARGUMENTS: Final = msgspec.Raw(b"{}")

_T = TypeVar("_T")


class Request(msgspec.Struct):
    command: str
    seq: int = 0
    arguments: msgspec.Raw = EMPTY_ARGUMENTS


class Response(msgspec.Struct, tag_field="type", tag="response", omit_defaults=True):
    request_seq: int
    command: str
    success: bool
    body: Any = None
    message: str = ""
    seq: int = 0


class Event(msgspec.Struct, tag_field="type", tag="event", omit_defaults=True):
    event: str
    body: Any = None
    seq: int = 0


class ProtocolObject(msgspec.Struct, rename="camel", omit_defaults=True):
    """An object of the protocol. Default values are omitted."""


class NoArguments(ProtocolObject):
    """The arguments of requests without arguments; any arguments are ignored."""


def parse_arguments(request: Request, arguments_type: type[_T]) -> _T:
    """Return the arguments of a request.

    :raises msgspec.DecodeError: if the arguments have a different structure.
    """
    # without nulls, since some clients send null for a missing value
    values = msgspec.json.decode(request.arguments)
    return msgspec.convert({} if values is None else _remove_nulls(values), type=arguments_type)


def _remove_nulls(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _remove_nulls(item) for name, item in value.items() if item is not None}
    return [_remove_nulls(item) for item in value] if isinstance(value, list) else value


class InitializeRequestArguments(ProtocolObject):
    lines_start_at1: bool = True
    columns_start_at1: bool = True
    supports_invalidated_event: bool = False


class LaunchRequestArguments(ProtocolObject):
    """The arguments of ``launch`` besides the options of the run.

    :param cwd: the folder to which paths are relative; empty for the folder of the adapter.
    :param stop_on_entry: whether to stop before the first rule.
    :param stop_in_rules: whether the run can stop within right-hand sides.
    :param no_debug: whether to run without any stop.
    """

    cwd: str = ""
    stop_on_entry: bool = False
    stop_in_rules: bool = True
    no_debug: bool = False


class Source(ProtocolObject):
    """A file."""

    name: str = ""
    path: str = ""


class SourceBreakpoint(ProtocolObject):
    """A requested breakpoint in a file."""

    line: int
    condition: str = ""
    hit_condition: str = ""
    log_message: str = ""


class SetBreakpointsArguments(ProtocolObject):
    source: Source
    breakpoints: list[SourceBreakpoint] = []


class FunctionBreakpoint(ProtocolObject):
    name: str
    condition: str = ""
    hit_condition: str = ""


class SetFunctionBreakpointsArguments(ProtocolObject):
    breakpoints: list[FunctionBreakpoint]


class SetExceptionBreakpointsArguments(ProtocolObject):
    filters: list[str]


class ThreadArguments(ProtocolObject):
    """Arguments of ``stackTrace``, and of the requests that pause or resume the run."""

    thread_id: int


class StepInArguments(ThreadArguments):
    target_id: int = 1  # the adapter's number of the step to the next rule


class FrameArguments(ProtocolObject):
    """Arguments of ``scopes`` and ``stepInTargets``."""

    frame_id: int


class VariablesArguments(ProtocolObject):
    variables_reference: int


class SetVariableArguments(ProtocolObject):
    variables_reference: int
    name: str
    value: str


class EvaluateArguments(ProtocolObject):
    expression: str
    frame_id: int | None = None
    context: str = ""


class Breakpoint(ProtocolObject):
    id: int
    verified: bool
    message: str = ""
    line: int = 0


class StackFrame(ProtocolObject):
    id: int
    name: str
    line: int
    column: int
    source: Source | None = None
    presentation_hint: str = ""


class Scope(ProtocolObject):
    """A group of variables."""

    name: str
    variables_reference: int
    expensive: bool
    presentation_hint: str = ""


class Variable(ProtocolObject):
    """A variable, possibly with child variables."""

    name: str
    value: str
    variables_reference: int
    type: str = ""
    evaluate_name: str = ""
    presentation_hint: dict[str, Any] = {}


class EvaluateBody(ProtocolObject):
    result: str
    variables_reference: int


class StoppedBody(ProtocolObject):
    reason: str
    description: str
    thread_id: int
    all_threads_stopped: bool = False
    hit_breakpoint_ids: list[int] = []
    text: str = ""
