"""The part of the Debug Adapter Protocol that is spoken: messages, arguments, bodies.

Source of the names: the specification of the protocol, version 1.68.
"""

from __future__ import annotations

from typing import Any, Final

import msgspec

EMPTY: Final = msgspec.Raw(b"{}")


class Request(msgspec.Struct):
    """What a client asks for."""

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


class Shape(msgspec.Struct, rename="camel", omit_defaults=True):
    """An object of the protocol; what has its default is left out."""


class Nothing(Shape):
    """Arguments that nobody looks at."""


class InitializeArguments(Shape):
    """Of ``initialize``."""

    client_id: str = msgspec.field(default="", name="clientID")
    lines_start_at1: bool = True
    columns_start_at1: bool = True
    supports_invalidated_event: bool = False


class Source(Shape):
    """A file, by its path or by a reference of ours."""

    name: str = ""
    path: str = ""
    source_reference: int = 0


class SourceBreakpoint(Shape):
    """A breakpoint that a client wants in a file."""

    line: int
    condition: str | None = None
    hit_condition: str | None = None
    log_message: str | None = None


class SetBreakpointsArguments(Shape):
    """Of ``setBreakpoints``."""

    source: Source
    breakpoints: list[SourceBreakpoint] = []


class FunctionBreakpoint(Shape):
    """A breakpoint with a name."""

    name: str
    condition: str | None = None
    hit_condition: str | None = None


class SetFunctionBreakpointsArguments(Shape):
    """Of ``setFunctionBreakpoints``."""

    breakpoints: list[FunctionBreakpoint] = []


class SetExceptionBreakpointsArguments(Shape):
    """Of ``setExceptionBreakpoints``."""

    filters: list[str] = []


class BreakpointLocationsArguments(Shape):
    """Of ``breakpointLocations``."""

    source: Source
    line: int
    end_line: int | None = None


class ThreadArguments(Shape):
    """Of requests that go on, or stop, a thread."""

    thread_id: int = 0
    target_id: int | None = None


class StackTraceArguments(Shape):
    """Of ``stackTrace``."""

    thread_id: int
    start_frame: int = 0
    levels: int = 0


class FrameArguments(Shape):
    """Of ``scopes`` and ``stepInTargets``."""

    frame_id: int


class VariablesArguments(Shape):
    """Of ``variables``."""

    variables_reference: int
    start: int = 0
    count: int = 0


class SetVariableArguments(Shape):
    """Of ``setVariable``."""

    variables_reference: int
    name: str
    value: str


class EvaluateArguments(Shape):
    """Of ``evaluate``."""

    expression: str
    frame_id: int | None = None
    context: str = ""


class SourceArguments(Shape):
    """Of ``source``."""

    source_reference: int = 0
    source: Source | None = None


class Breakpoint(Shape):
    """How a breakpoint stands."""

    id: int
    verified: bool
    message: str = ""
    source: Source | None = None
    line: int = 0


class StackFrame(Shape):
    """A frame of a stack."""

    id: int
    name: str
    line: int
    column: int
    source: Source | None = None
    presentation_hint: str = ""


class Scope(Shape):
    """A group of variables."""

    name: str
    variables_reference: int
    expensive: bool
    presentation_hint: str = ""


class Variable(Shape):
    """A variable, or what has some."""

    name: str
    value: str
    variables_reference: int
    type: str = ""
    evaluate_name: str = ""
    named_variables: int = 0
    presentation_hint: dict[str, Any] = {}


class EvaluateBody(Shape):
    """The value of an expression."""

    result: str
    variables_reference: int
    type: str = ""


class StoppedBody(Shape):
    """The event ``stopped``."""

    reason: str
    description: str
    thread_id: int
    all_threads_stopped: bool = False
    hit_breakpoint_ids: list[int] = []
    text: str = ""
