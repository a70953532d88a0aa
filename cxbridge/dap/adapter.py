"""The debug adapter: carries out the requests of one client, and reports what happens."""

from __future__ import annotations

import queue
import threading
import traceback
from collections.abc import Callable, Mapping
from typing import Any, Final

import msgspec

from cxbridge.dap import protocol
from cxbridge.dap.breaking import FILTERS, Breakpoints
from cxbridge.dap.launching import make_target
from cxbridge.dap.stops import Sources, Stop
from cxbridge.dap.target import Place, Stopped, Target
from cxbridge.dap.wire import Wire, WireError
from cxbridge.errors import CxbridgeError

CAPABILITIES: Final = {
    "supportsConfigurationDoneRequest": True,
    "supportsFunctionBreakpoints": True,
    "supportsConditionalBreakpoints": True,
    "supportsHitConditionalBreakpoints": True,
    "supportsLogPoints": True,
    "supportsBreakpointLocationsRequest": True,
    "supportsEvaluateForHovers": True,
    "supportsSetVariable": True,
    "supportsStepInTargetsRequest": True,
    "supportsLoadedSourcesRequest": True,
    "supportsTerminateRequest": True,
    "supportsDelayedStackTraceLoading": True,
    "exceptionBreakpointFilters": [{"filter": name, "label": title} for name, (title, _) in FILTERS.items()],
}

_SLICE_S: Final = 0.2
_TARGETS: Final = {1: "rule", 2: "line"}
_TARGET_TITLES: Final = {1: "the next rule", 2: "the next action of a right-hand side"}
_ENDING: Final = ("disconnect", "terminate")
_NOT_STOPPED: Final = "nothing is stopped now"


class Adapter:
    """Serves one client."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._inbox: queue.SimpleQueue[protocol.Request | None] = queue.SimpleQueue()
        self._sources = Sources()
        self._breakpoints = Breakpoints(self._sources)
        self._target: Target | None = None
        self._stop: Stop | None = None
        self._begun = self._is_over = self._checked = False
        self._tells_changes = False
        self.problem = ""
        """Why the client's stream cannot be read any further; empty while it can."""
        self._handlers: Mapping[str, tuple[type[Any], Callable[[Any], Any]]] = {
            "initialize": (protocol.InitializeArguments, self._initialize),
            "launch": (dict[str, Any], self._launch),
            "configurationDone": (protocol.Nothing, self._begin),
            "setBreakpoints": (protocol.SetBreakpointsArguments, self._set_lines),
            "setFunctionBreakpoints": (protocol.SetFunctionBreakpointsArguments, self._set_functions),
            "setExceptionBreakpoints": (protocol.SetExceptionBreakpointsArguments, self._set_filters),
            "breakpointLocations": (protocol.BreakpointLocationsArguments, self._locations),
            "threads": (protocol.Nothing, self._threads),
            "stackTrace": (protocol.StackTraceArguments, self._stack),
            "scopes": (protocol.FrameArguments, self._scopes),
            "variables": (protocol.VariablesArguments, self._variables),
            "setVariable": (protocol.SetVariableArguments, self._set_variable),
            "evaluate": (protocol.EvaluateArguments, self._evaluate),
            "source": (protocol.SourceArguments, self._source),
            "loadedSources": (protocol.Nothing, self._loaded),
            "stepInTargets": (protocol.FrameArguments, self._step_targets),
            "continue": (protocol.ThreadArguments, self._continue),
            "stepIn": (protocol.ThreadArguments, self._step_in),
            "next": (protocol.ThreadArguments, lambda _: self._step("transition")),
            "stepOut": (protocol.ThreadArguments, lambda _: self._step("loop")),
            "stepBack": (protocol.ThreadArguments, lambda _: self._go_back("rule")),
            "reverseContinue": (protocol.ThreadArguments, lambda _: self._go_back("")),
            "pause": (protocol.ThreadArguments, lambda _: self._there.pause()),
            "terminate": (protocol.Nothing, lambda _: None),
            "disconnect": (protocol.Nothing, self._disconnect),
        }

    def serve(self) -> None:
        """Serve until the client has gone, or :attr:`problem` says what is wrong with what it sends."""
        threading.Thread(target=self._read, name="dap", daemon=True).start()
        while not self._is_over:
            self._take(self._inbox.get())
            if self._begun:
                self._begun = False
                self._run()

    def _read(self) -> None:
        """Take what the client sends, in a thread of its own."""
        try:
            while (request := self._wire.read()) is not None:
                if request.command in _ENDING and self._target is not None:
                    self._target.interrupt()  # the rules may never come to rest
                self._inbox.put(request)
        except (WireError, OSError) as error:
            self.problem = str(error)
        self.end()

    def end(self) -> None:
        """End everything as soon as possible; from any thread."""
        if self._target is not None:
            self._target.interrupt()
        self._inbox.put(None)

    def _run(self) -> None:
        """Run the target to its end, and say so."""
        status = 0
        try:
            status = self._there.run(self)
        except CxbridgeError as error:
            self.tell("output", {"category": "stderr", "output": f"cxbridge: error: {error}\n"})
            status = error.exit_status
        self.tell("exited", {"exitCode": status})
        self.tell("terminated")

    def _take(self, request: protocol.Request | None) -> None:
        """Carry out a request, and answer it."""
        if request is None:
            self._is_over = True
            return
        answer = protocol.Response(request.seq, request.command, success=False)
        try:
            kind, carry_out = self._handlers.get(request.command, (protocol.Nothing, self._no_such(request)))
            answer.body = carry_out(msgspec.json.decode(request.arguments, type=kind))
            answer.success = True
        except CxbridgeError as error:
            answer.message = str(error)
        except msgspec.DecodeError as error:
            answer.message = f"the arguments make no sense: {error}"
        except Exception as error:  # noqa: BLE001 - a client cannot do without an answer
            traceback.print_exc()
            answer.message = f"a fault of cxbridge: {type(error).__name__}: {error}"
        if not answer.success:
            answer.body = {"error": {"id": 1, "format": answer.message, "showUser": True}}
        self._wire.write(answer)
        if answer.success and request.command == "launch":
            self.tell("initialized")

    @staticmethod
    def _no_such(request: protocol.Request) -> Callable[[Any], Any]:
        def refuse(_arguments: Any) -> None:
            raise CxbridgeError(f"there is no request '{request.command}' here")

        return refuse

    # -- what targets ask for

    def pump(self) -> None:
        """Carry out the requests that are there."""
        while not self._inbox.empty():
            self._take(self._inbox.get())
        if not self._checked and self._there.is_loaded:
            self._checked = True
            for each in self._breakpoints.check():
                self.tell("breakpoint", {"reason": "changed", "breakpoint": each})

    def stay(self, stopped: Stopped, is_over: Callable[[], bool]) -> None:
        """Carry out requests until one goes on."""
        self._stop = Stop(stopped, self._sources.of)
        reason = "exception" if self._breakpoints.is_filter(stopped.breakpoint) else stopped.reason
        numbers = [stopped.breakpoint] if stopped.breakpoint else []
        self.tell(
            "stopped",
            protocol.StoppedBody(
                reason,
                stopped.description,
                stopped.agent,
                all_threads_stopped=True,
                hit_breakpoint_ids=numbers,
                text=stopped.description if reason == "exception" else "",
            ),
        )
        try:
            while not is_over() and not self._is_over:
                try:
                    request = self._inbox.get(timeout=_SLICE_S)
                except queue.Empty:
                    continue
                self._take(request)
        finally:
            self._stop = None

    def tell(self, name: str, body: Mapping[str, object] | protocol.Shape | None = None) -> None:
        """Send an event."""
        self._wire.write(protocol.Event(name, body))

    # -- the beginning and the end

    @property
    def _there(self) -> Target:
        if self._target is None:
            raise CxbridgeError("nothing has been launched")
        return self._target

    @property
    def _here(self) -> Stop:
        if self._stop is None:
            raise CxbridgeError(_NOT_STOPPED)
        return self._stop

    def _initialize(self, arguments: protocol.InitializeArguments) -> Mapping[str, Any]:
        if not arguments.lines_start_at1 or not arguments.columns_start_at1:
            raise CxbridgeError("lines and columns are counted from 1 here")
        self._tells_changes = arguments.supports_invalidated_event
        return CAPABILITIES

    def _launch(self, arguments: dict[str, Any]) -> None:
        if self._target is not None:
            raise CxbridgeError("something has been launched already")
        self._target = make_target(arguments)
        if not arguments.get("noDebug"):
            self._breakpoints.attach(self._target)
        if self._target.can_go_back:
            self.tell("capabilities", {"capabilities": {"supportsStepBack": True}})

    def _begin(self, _arguments: protocol.Nothing) -> None:
        _ = self._there
        self._begun = True

    def _disconnect(self, _arguments: protocol.Nothing) -> None:
        self._is_over = True

    # -- where to stop

    def _set_lines(self, arguments: protocol.SetBreakpointsArguments) -> Mapping[str, Any]:
        return {"breakpoints": self._breakpoints.set_lines(arguments)}

    def _set_functions(self, arguments: protocol.SetFunctionBreakpointsArguments) -> Mapping[str, Any]:
        return {"breakpoints": self._breakpoints.set_functions(arguments.breakpoints)}

    def _set_filters(self, arguments: protocol.SetExceptionBreakpointsArguments) -> Mapping[str, Any]:
        return {"breakpoints": self._breakpoints.set_filters(arguments.filters)}

    def _locations(self, arguments: protocol.BreakpointLocationsArguments) -> Mapping[str, Any]:
        return {"breakpoints": [{"line": line} for line in self._breakpoints.lines_between(arguments)]}

    # -- looking

    def _threads(self, _arguments: protocol.Nothing) -> Mapping[str, Any]:
        agents = () if self._target is None else self._target.agents
        return {"threads": [{"id": number, "name": name} for number, name in enumerate(agents, start=1)]}

    def _stack(self, arguments: protocol.StackTraceArguments) -> Mapping[str, Any]:
        if arguments.thread_id != self._here.stopped.agent:
            return {"stackFrames": [], "totalFrames": 0}
        return self._here.frames(arguments.start_frame, arguments.levels)

    def _scopes(self, arguments: protocol.FrameArguments) -> Mapping[str, Any]:
        return {"scopes": self._here.scopes(arguments.frame_id)}

    def _variables(self, arguments: protocol.VariablesArguments) -> Mapping[str, Any]:
        found = self._here.variables(arguments.variables_reference, arguments.start, arguments.count)
        return {"variables": found}

    def _set_variable(self, arguments: protocol.SetVariableArguments) -> Mapping[str, Any]:
        value = self._here.change(arguments.variables_reference, arguments.name, arguments.value)
        self._tell_change()
        return {"value": value}

    def _evaluate(self, arguments: protocol.EvaluateArguments) -> protocol.EvaluateBody:
        body, printed = self._here.evaluate(arguments.expression)
        for line in printed:
            self.tell("output", {"category": "console", "output": f"{line}\n"})
        if arguments.context == "repl":
            self._tell_change()
        return body

    def _tell_change(self) -> None:
        if self._tells_changes:
            self.tell("invalidated", {"areas": ["stacks", "variables"]})

    def _source(self, arguments: protocol.SourceArguments) -> Mapping[str, Any]:
        wanted = arguments.source or protocol.Source(source_reference=arguments.source_reference)
        return {"content": self._sources.named(wanted)[1], "mimeType": "text/x-clips"}

    def _loaded(self, _arguments: protocol.Nothing) -> Mapping[str, Any]:
        files = () if self._target is None else self._target.files()
        return {"sources": [self._sources.of(Place(file, 1)) for file in files]}

    # -- going

    def _step_targets(self, arguments: protocol.FrameArguments) -> Mapping[str, Any]:
        _ = self._here.scopes(arguments.frame_id)
        known = [number for number in _TARGETS if number == 1 or self._there.can_stop_at_actions]
        return {"targets": [{"id": number, "label": _TARGET_TITLES[number]} for number in known]}

    def _continue(self, _arguments: protocol.ThreadArguments) -> Mapping[str, Any]:
        _ = self._here
        self._there.go_on()
        return {"allThreadsContinued": True}

    def _step_in(self, arguments: protocol.ThreadArguments) -> None:
        self._step(_TARGETS.get(arguments.target_id or 1, "rule"))

    def _step(self, what: str) -> None:
        _ = self._here
        self._there.step(what)

    def _go_back(self, what: str) -> None:
        _ = self._here
        self._there.go_back(what)
