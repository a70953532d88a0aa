"""The part of the Debug Adapter Protocol that is spoken: messages, arguments, bodies.

Source of the names: the specification of the protocol, version 1.68.
"""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, TypeVar

import msgspec

EMPTY: Final = msgspec.Raw(b"{}")

Count = Annotated[int, msgspec.Meta(ge=0)]
Number = Annotated[int, msgspec.Meta(ge=1)]
"""Of a line or a column."""

_T = TypeVar("_T")


class Request(msgspec.Struct):
    """A request of a client."""

    command: str
    seq: int = 0
    arguments: msgspec.Raw = EMPTY


class Response(msgspec.Struct, tag_field="type", tag="response", omit_defaults=True):
    """The answer to a request."""

    request_seq: int
    command: str
    success: bool
    body: Any = None
    message: str = ""
    seq: int = 0


class Event(msgspec.Struct, tag_field="type", tag="event", omit_defaults=True):
    """What happens without a request."""

    event: str
    body: Any = None
    seq: int = 0


class ProtocolObject(msgspec.Struct, rename="camel", omit_defaults=True):
    """An object of the protocol; default values are left out."""


class Nothing(ProtocolObject):
    """Arguments that are ignored."""


def arguments_of(request: Request, kind: type[_T]) -> _T:
    """Return the arguments of a request. A null counts as left out: some clients write it so.

    :raises msgspec.DecodeError: when they are not of that kind.
    """
    given = msgspec.json.decode(request.arguments)
    return msgspec.convert({} if given is None else _without_nulls(given), type=kind)


def _without_nulls(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _without_nulls(each) for name, each in value.items() if each is not None}
    return [_without_nulls(each) for each in value] if isinstance(value, list) else value


class InitializeArguments(ProtocolObject):
    """Of ``initialize``."""

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
    """Of ``disconnect`` and ``terminate``."""

    restart: bool = False
    terminate_debuggee: bool = False
    suspend_debuggee: bool = False


class Checksum(ProtocolObject):
    """Of a file."""

    algorithm: Literal["MD5", "SHA1", "SHA256", "timestamp"]
    checksum: str


class Source(ProtocolObject):
    """A file, by its path or by a reference of ours."""

    name: str = ""
    path: str = ""
    source_reference: Count = 0
    presentation_hint: Literal["", "normal", "emphasize", "deemphasize"] = ""
    origin: str = ""
    sources: list[Source] = []
    adapter_data: Any = None
    checksums: list[Checksum] = []


class SourceBreakpoint(ProtocolObject):
    """A breakpoint that a client wants in a file."""

    line: int
    column: int | None = None
    condition: str = ""
    hit_condition: str = ""
    log_message: str = ""
    mode: str = ""


class SetBreakpointsArguments(ProtocolObject):
    """Of ``setBreakpoints``."""

    source: Source
    breakpoints: list[SourceBreakpoint] | None = None
    lines: list[int] = []
    source_modified: bool = False

    @property
    def wanted(self) -> list[SourceBreakpoint]:
        """The breakpoints; those of old clients are lines."""
        return (
            [SourceBreakpoint(line) for line in self.lines] if self.breakpoints is None else self.breakpoints
        )


class FunctionBreakpoint(ProtocolObject):
    """A breakpoint with a name."""

    name: str
    condition: str = ""
    hit_condition: str = ""


class SetFunctionBreakpointsArguments(ProtocolObject):
    """Of ``setFunctionBreakpoints``."""

    breakpoints: list[FunctionBreakpoint]


class ExceptionFilterOptions(ProtocolObject):
    """A filter with a condition."""

    filter_id: str
    condition: str = ""
    mode: str = ""


class ExceptionPathSegment(ProtocolObject):
    """A part of a tree of exceptions."""

    names: list[str]
    negate: bool = False


class ExceptionOptions(ProtocolObject):
    """A tree of exceptions; there is none here."""

    break_mode: Literal["never", "always", "unhandled", "userUnhandled"]
    path: list[ExceptionPathSegment] = []


class SetExceptionBreakpointsArguments(ProtocolObject):
    """Of ``setExceptionBreakpoints``."""

    filters: list[str]
    filter_options: list[ExceptionFilterOptions] = []
    exception_options: list[ExceptionOptions] = []


class BreakpointLocationsArguments(ProtocolObject):
    """Of ``breakpointLocations``."""

    source: Source
    line: Number
    column: Number | None = None
    end_line: Number | None = None
    end_column: Number | None = None


class PauseArguments(ProtocolObject):
    """Of ``pause``."""

    thread_id: int


class ThreadArguments(ProtocolObject):
    """The arguments of requests that continue the run."""

    thread_id: int
    single_thread: bool = False


class StepArguments(ThreadArguments):
    """Of requests that step."""

    granularity: Literal["statement", "line", "instruction"] = "statement"


class StepInArguments(StepArguments):
    """Of ``stepIn``."""

    target_id: int | None = None


class ValueFormat(ProtocolObject):
    """How a value is to be shown; numbers of CLIPS are decimal."""

    hex: bool = False


class StackFrameFormat(ValueFormat):
    """How a frame is to be shown; there is one way."""

    parameters: bool = False
    parameter_types: bool = False
    parameter_names: bool = False
    parameter_values: bool = False
    line: bool = False
    module: bool = False
    include_all: bool = False


class StackTraceArguments(ProtocolObject):
    """Of ``stackTrace``."""

    thread_id: int
    start_frame: Count = 0
    levels: Count = 0
    format: StackFrameFormat | None = None


class FrameArguments(ProtocolObject):
    """Of ``scopes`` and ``stepInTargets``."""

    frame_id: int


class VariablesArguments(ProtocolObject):
    """Of ``variables``."""

    variables_reference: int
    filter: Literal["", "indexed", "named"] = ""
    start: Count = 0
    count: Count = 0
    format: ValueFormat | None = None


class SetVariableArguments(ProtocolObject):
    """Of ``setVariable``."""

    variables_reference: int
    name: str
    value: str
    format: ValueFormat | None = None


class EvaluateArguments(ProtocolObject):
    """Of ``evaluate``."""

    expression: str
    frame_id: int | None = None
    line: int | None = None
    column: int | None = None
    source: Source | None = None
    context: str = ""
    format: ValueFormat | None = None


class SourceArguments(ProtocolObject):
    """Of ``source``."""

    source_reference: Count
    source: Source | None = None


class Breakpoint(ProtocolObject):
    """How a breakpoint stands."""

    id: int
    verified: bool
    message: str = ""
    source: Source | None = None
    line: int = 0


class StackFrame(ProtocolObject):
    """A frame of a stack."""

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
    """A variable, or a value that has variables."""

    name: str
    value: str
    variables_reference: int
    type: str = ""
    evaluate_name: str = ""
    named_variables: int = 0
    presentation_hint: dict[str, Any] = {}


class EvaluateBody(ProtocolObject):
    """The value of an expression."""

    result: str
    variables_reference: int
    type: str = ""


class StoppedBody(ProtocolObject):
    """The event ``stopped``."""

    reason: str
    description: str
    thread_id: int
    all_threads_stopped: bool = False
    hit_breakpoint_ids: list[int] = []
    text: str = ""
