"""The implemented part of the Debug Adapter Protocol: messages, arguments, bodies.

Names follow the specification of the protocol, version 1.68.
"""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, TypeVar

import msgspec

EMPTY: Final = msgspec.Raw(b"{}")

Count = Annotated[int, msgspec.Meta(ge=0)]
Number = Annotated[int, msgspec.Meta(ge=1)]  # a line or column, counted from 1

_T = TypeVar("_T")


class Request(msgspec.Struct):
    command: str
    seq: int = 0
    arguments: msgspec.Raw = EMPTY


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


class Nothing(ProtocolObject):
    """Arguments that are ignored."""


def arguments_of(request: Request, kind: type[_T]) -> _T:
    """Return the arguments of a request. Some clients write null for a missing value.

    :raises msgspec.DecodeError: if the arguments have another structure.
    """
    values = msgspec.json.decode(request.arguments)
    return msgspec.convert({} if values is None else _without_nulls(values), type=kind)


def _without_nulls(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _without_nulls(each) for name, each in value.items() if each is not None}
    return [_without_nulls(each) for each in value] if isinstance(value, list) else value


class InitializeArguments(ProtocolObject):
    adapter_id: str = msgspec.field(name="adapterID")
    client_id: str = msgspec.field(default="", name="clientID")
    client_name: str = ""
    locale: str = ""
    lines_start_at1: bool = True
    columns_start_at1: bool = True
    path_format: str = "path"
    supports_variable_type: bool = False
    supports_variable_paging: bool = False
    supports_run_in_terminal_request: bool = False
    supports_memory_references: bool = False
    supports_progress_reporting: bool = False
    supports_invalidated_event: bool = False
    supports_memory_event: bool = False
    supports_args_can_be_interpreted_by_shell: bool = False
    supports_start_debugging_request: bool = False
    supports_ansi_styling: bool = msgspec.field(default=False, name="supportsANSIStyling")


class EndArguments(ProtocolObject):
    """Arguments of ``disconnect`` and ``terminate``."""

    restart: bool = False
    terminate_debuggee: bool = False
    suspend_debuggee: bool = False


class Checksum(ProtocolObject):
    algorithm: Literal["MD5", "SHA1", "SHA256", "timestamp"]
    checksum: str


class Source(ProtocolObject):
    """A file, named by its path or by a reference number of the adapter."""

    name: str = ""
    path: str = ""
    source_reference: Count = 0
    presentation_hint: Literal["", "normal", "emphasize", "deemphasize"] = ""
    origin: str = ""
    sources: list[Source] = []
    adapter_data: Any = None
    checksums: list[Checksum] = []


class SourceBreakpoint(ProtocolObject):
    """A requested breakpoint in a file."""

    line: int
    column: int | None = None
    condition: str = ""
    hit_condition: str = ""
    log_message: str = ""
    mode: str = ""


class SetBreakpointsArguments(ProtocolObject):
    source: Source
    breakpoints: list[SourceBreakpoint] | None = None
    lines: list[int] = []
    source_modified: bool = False

    @property
    def wanted(self) -> list[SourceBreakpoint]:
        """The requested breakpoints. Old clients send only line numbers."""
        return (
            [SourceBreakpoint(line) for line in self.lines] if self.breakpoints is None else self.breakpoints
        )


class FunctionBreakpoint(ProtocolObject):
    name: str
    condition: str = ""
    hit_condition: str = ""


class SetFunctionBreakpointsArguments(ProtocolObject):
    breakpoints: list[FunctionBreakpoint]


class ExceptionFilterOptions(ProtocolObject):
    filter_id: str
    condition: str = ""
    mode: str = ""


class ExceptionPathSegment(ProtocolObject):
    names: list[str]
    negate: bool = False


class ExceptionOptions(ProtocolObject):
    """A tree of exceptions. The adapter has none."""

    break_mode: Literal["never", "always", "unhandled", "userUnhandled"]
    path: list[ExceptionPathSegment] = []


class SetExceptionBreakpointsArguments(ProtocolObject):
    filters: list[str]
    filter_options: list[ExceptionFilterOptions] = []
    exception_options: list[ExceptionOptions] = []


class BreakpointLocationsArguments(ProtocolObject):
    source: Source
    line: Number
    column: Number | None = None
    end_line: Number | None = None
    end_column: Number | None = None


class PauseArguments(ProtocolObject):
    thread_id: int


class ThreadArguments(ProtocolObject):
    """Arguments of the requests that resume the run."""

    thread_id: int
    single_thread: bool = False


class StepArguments(ThreadArguments):
    granularity: Literal["statement", "line", "instruction"] = "statement"


class StepInArguments(StepArguments):
    target_id: int | None = None


class ValueFormat(ProtocolObject):
    """Format of a value; ignored, since numbers of CLIPS are decimal."""

    hex: bool = False


class StackFrameFormat(ValueFormat):
    parameters: bool = False
    parameter_types: bool = False
    parameter_names: bool = False
    parameter_values: bool = False
    line: bool = False
    module: bool = False
    include_all: bool = False


class StackTraceArguments(ProtocolObject):
    thread_id: int
    start_frame: Count = 0
    levels: Count = 0
    format: StackFrameFormat | None = None


class FrameArguments(ProtocolObject):
    """Arguments of ``scopes`` and ``stepInTargets``."""

    frame_id: int


class VariablesArguments(ProtocolObject):
    variables_reference: int
    filter: Literal["", "indexed", "named"] = ""
    start: Count = 0
    count: Count = 0
    format: ValueFormat | None = None


class SetVariableArguments(ProtocolObject):
    variables_reference: int
    name: str
    value: str
    format: ValueFormat | None = None


class EvaluateArguments(ProtocolObject):
    expression: str
    frame_id: int | None = None
    line: int | None = None
    column: int | None = None
    source: Source | None = None
    context: str = ""
    format: ValueFormat | None = None


class SourceArguments(ProtocolObject):
    source_reference: Count
    source: Source | None = None


class Breakpoint(ProtocolObject):
    id: int
    verified: bool
    message: str = ""
    source: Source | None = None
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
    named_variables: int = 0
    presentation_hint: dict[str, Any] = {}


class EvaluateBody(ProtocolObject):
    result: str
    variables_reference: int
    type: str = ""


class StoppedBody(ProtocolObject):
    reason: str
    description: str
    thread_id: int
    all_threads_stopped: bool = False
    hit_breakpoint_ids: list[int] = []
    text: str = ""
