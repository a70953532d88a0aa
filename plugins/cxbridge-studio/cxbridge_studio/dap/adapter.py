"""The debug adapter: serves the requests of one client and sends it events."""

from __future__ import annotations

import queue
import threading
import traceback
from collections.abc import Callable, Mapping
from typing import Any, Final

import msgspec

from cxbridge.errors import CxbridgeError
from cxbridge_studio.dap import phases, protocol
from cxbridge_studio.dap.breaking import FILTERS, Breakpoints
from cxbridge_studio.dap.launching import make_target
from cxbridge_studio.dap.phases import SessionPhase, check_phase
from cxbridge_studio.dap.stops import Sources, StopView
from cxbridge_studio.dap.target import FileLine, Stopped, Target
from cxbridge_studio.dap.wire import Wire, WireError

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

_SLICE_S: Final = 0.2  # seconds without a request after which the target is polled
_TARGETS: Final = {1: "rule", 2: "line"}
_TARGET_TITLES: Final = {1: "the next rule", 2: "the next action of a right-hand side"}
_ENDING: Final = ("disconnect", "terminate")


class Adapter:
    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._inbox: queue.SimpleQueue[protocol.Request | None] = queue.SimpleQueue()
        self._sources = Sources()
        self._breakpoints = Breakpoints(self._sources)
        self._target: Target | None = None
        self._stop: StopView | None = None
        self._run_phase = SessionPhase.LAUNCHED
        self._is_known = self._is_over = self._checked = False
        self._sends_invalidated = False
        self.problem = ""  # protocol error that ended the client's stream; empty without an error
        any_time, stopped = phases.KNOWN, SessionPhase.STOPPED
        launched = phases.LAUNCHED
        self._handlers: Mapping[str, tuple[type[Any], Callable[[Any], Any], SessionPhase]] = {
            "initialize": (protocol.InitializeArguments, self._initialize, SessionPhase.NEW),
            "launch": (dict[str, Any], self._launch, SessionPhase.READY),
            "configurationDone": (protocol.Nothing, self._begin, SessionPhase.LAUNCHED),
            "setBreakpoints": (protocol.SetBreakpointsArguments, self._set_lines, any_time),
            "setFunctionBreakpoints": (
                protocol.SetFunctionBreakpointsArguments,
                self._set_functions,
                any_time,
            ),
            "setExceptionBreakpoints": (
                protocol.SetExceptionBreakpointsArguments,
                self._set_filters,
                any_time,
            ),
            "breakpointLocations": (protocol.BreakpointLocationsArguments, self._locations, any_time),
            "threads": (protocol.Nothing, self._threads, launched),
            "stackTrace": (protocol.StackTraceArguments, self._stack, stopped),
            "scopes": (protocol.FrameArguments, self._scopes, stopped),
            "variables": (protocol.VariablesArguments, self._variables, stopped),
            "setVariable": (protocol.SetVariableArguments, self._set_variable, stopped),
            "evaluate": (protocol.EvaluateArguments, self._evaluate, stopped),
            "source": (protocol.SourceArguments, self._source, any_time),
            "loadedSources": (protocol.Nothing, self._loaded, launched),
            "stepInTargets": (protocol.FrameArguments, self._step_targets, stopped),
            "continue": (protocol.ThreadArguments, self._continue, stopped),
            "stepIn": (protocol.StepInArguments, self._step_in, stopped),
            "next": (protocol.StepArguments, lambda arguments: self._step(arguments, "transition"), stopped),
            "stepOut": (protocol.StepArguments, lambda arguments: self._step(arguments, "loop"), stopped),
            "stepBack": (protocol.StepArguments, lambda arguments: self._go_back(arguments, "rule"), stopped),
            "reverseContinue": (
                protocol.ThreadArguments,
                lambda arguments: self._go_back(arguments, ""),
                stopped,
            ),
            "pause": (protocol.PauseArguments, self._pause, SessionPhase.RUNNING),
            "terminate": (protocol.EndArguments, self._terminate, launched),
            "disconnect": (protocol.EndArguments, self._disconnect, phases.ANY),
        }

    @property
    def _phase(self) -> SessionPhase:
        if self._stop is not None:
            return SessionPhase.STOPPED
        if self._target is not None:
            return self._run_phase
        return SessionPhase.READY if self._is_known else SessionPhase.NEW

    def serve(self) -> None:
        """Serve until the client disconnects, or :attr:`problem` describes its protocol error."""
        threading.Thread(target=self._read, name="dap", daemon=True).start()
        while not self._is_over:
            self._take(self._inbox.get())
            if self._phase is SessionPhase.RUNNING:
                self._run()

    def _read(self) -> None:
        """Read the client's messages, in a separate thread."""
        try:
            while (request := self._wire.read()) is not None:
                if request.command in _ENDING and self._target is not None:
                    self._target.interrupt()  # the rules may fire without end
                self._inbox.put(request)
        except (WireError, OSError) as error:
            self.problem = str(error)
        finally:
            self.end()

    def end(self) -> None:
        """End the session as soon as possible; called from any thread."""
        self._inbox.put(None)
        if self._target is not None:
            self._target.interrupt()

    def _run(self) -> None:
        """Run the target to its end and send its exit status."""
        status = 0
        try:
            status = self._current_target.run(self)
        except CxbridgeError as error:
            self.send_event("output", {"category": "stderr", "output": f"cxbridge: error: {error}\n"})
            status = error.exit_status
        self._run_phase = SessionPhase.OVER
        self.send_event("exited", {"exitCode": status})
        self.send_event("terminated")

    def _take(self, request: protocol.Request | None) -> None:
        """Carry out a request and send the response."""
        if request is None:
            self._is_over = True
            return
        answer = protocol.Response(request.seq, request.command, success=False)
        try:
            answer.body = self._carry_out(request)
            answer.success = True
        except CxbridgeError as error:
            answer.message = str(error)
        except msgspec.DecodeError as error:
            answer.message = f"the arguments are invalid: {error}"
        except Exception as error:  # noqa: BLE001 - a client waits for each response
            traceback.print_exc()
            answer.message = f"a fault of cxbridge: {type(error).__name__}: {error}"
        if not answer.success:
            answer.body = {"error": {"id": 1, "format": answer.message, "showUser": True}}
        self._wire.write(answer)
        if answer.success and request.command == "launch":
            self.send_event("initialized")

    def _carry_out(self, request: protocol.Request) -> Any:
        """Return the body of the response."""
        known = self._handlers.get(request.command)
        if known is None:
            raise CxbridgeError(f"there is no request '{request.command}' here")
        kind, carry_out, allowed = known
        arguments = protocol.arguments_of(request, kind)
        check_phase(request.command, allowed, self._phase)
        return carry_out(arguments)

    # -- callbacks of targets

    def pump(self) -> None:
        """Carry out the queued requests."""
        while not self._inbox.empty():
            self._take(self._inbox.get())
        if not self._checked and self._current_target.is_loaded:
            self._checked = True
            for each in self._breakpoints.check():
                self.send_event("breakpoint", {"reason": "changed", "breakpoint": each})

    def serve_stop(self, stopped: Stopped, is_over: Callable[[], bool]) -> None:
        """Carry out requests until one resumes the run."""
        self._stop = StopView(stopped, self._sources.of)
        reason = "exception" if self._breakpoints.is_filter(stopped.breakpoint) else stopped.reason
        numbers = [stopped.breakpoint] if stopped.breakpoint else []
        self.send_event(
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

    def send_event(
        self, name: str, body: Mapping[str, object] | protocol.ProtocolObject | None = None
    ) -> None:
        self._wire.write(protocol.Event(name, body))

    # -- start and end

    @property
    def _current_target(self) -> Target:
        assert self._target is not None, "requests that need it come later"
        return self._target

    @property
    def _current_stop(self) -> StopView:
        assert self._stop is not None, "requests that need it come while it is stopped"
        return self._stop

    def _initialize(self, arguments: protocol.InitializeArguments) -> Mapping[str, Any]:
        if not arguments.lines_start_at1 or not arguments.columns_start_at1:
            raise CxbridgeError("lines and columns are counted from 1 here")
        if arguments.path_format != "path":
            raise CxbridgeError(f"files are named by their paths here, not as '{arguments.path_format}'")
        self._is_known = True
        self._sends_invalidated = arguments.supports_invalidated_event
        return CAPABILITIES

    def _launch(self, arguments: dict[str, Any]) -> None:
        self._target = make_target(arguments)
        if not arguments.get("noDebug"):
            self._breakpoints.attach(self._target)
        if self._target.can_go_back:
            self.send_event("capabilities", {"capabilities": {"supportsStepBack": True}})

    def _begin(self, _arguments: protocol.Nothing) -> None:
        self._run_phase = SessionPhase.RUNNING

    def _terminate(self, _arguments: protocol.EndArguments) -> None:
        if self._phase is SessionPhase.LAUNCHED:  # nothing runs yet that could end by itself
            self._run_phase = SessionPhase.OVER
            self.send_event("terminated")

    def _disconnect(self, _arguments: protocol.EndArguments) -> None:
        self._is_over = True

    # -- setting breakpoints

    def _set_lines(self, arguments: protocol.SetBreakpointsArguments) -> Mapping[str, Any]:
        return {"breakpoints": self._breakpoints.set_lines(arguments)}

    def _set_functions(self, arguments: protocol.SetFunctionBreakpointsArguments) -> Mapping[str, Any]:
        return {"breakpoints": self._breakpoints.set_functions(arguments.breakpoints)}

    def _set_filters(self, arguments: protocol.SetExceptionBreakpointsArguments) -> Mapping[str, Any]:
        return {"breakpoints": self._breakpoints.set_filters(arguments)}

    def _locations(self, arguments: protocol.BreakpointLocationsArguments) -> Mapping[str, Any]:
        return {"breakpoints": [{"line": line} for line in self._breakpoints.lines_between(arguments)]}

    # -- inspection

    def _check_thread(self, number: int) -> None:
        if not 0 < number <= len(self._current_target.agents):
            thread_list = ", ".join(
                f"{each} ({name})" for each, name in enumerate(self._current_target.agents, start=1)
            )
            raise CxbridgeError(f"there is no thread {number}", hint=f"there are: {thread_list or 'none'}")

    def _threads(self, _arguments: protocol.Nothing) -> Mapping[str, Any]:
        agents = () if self._phase is SessionPhase.OVER else self._current_target.agents
        return {"threads": [{"id": number, "name": name} for number, name in enumerate(agents, start=1)]}

    def _stack(self, arguments: protocol.StackTraceArguments) -> Mapping[str, Any]:
        self._check_thread(arguments.thread_id)
        if arguments.thread_id != self._current_stop.stopped.agent:
            return {"stackFrames": [], "totalFrames": 0}
        return self._current_stop.frames(arguments.start_frame, arguments.levels)

    def _scopes(self, arguments: protocol.FrameArguments) -> Mapping[str, Any]:
        return {"scopes": self._current_stop.scopes(arguments.frame_id)}

    def _variables(self, arguments: protocol.VariablesArguments) -> Mapping[str, Any]:
        found = self._current_stop.variables(arguments.variables_reference, arguments.start, arguments.count)
        return {"variables": [] if arguments.filter == "indexed" else found}

    def _set_variable(self, arguments: protocol.SetVariableArguments) -> Mapping[str, Any]:
        value = self._current_stop.change(arguments.variables_reference, arguments.name, arguments.value)
        self._send_invalidated()
        return {"value": value}

    def _evaluate(self, arguments: protocol.EvaluateArguments) -> protocol.EvaluateBody:
        if arguments.frame_id is not None:
            self._current_stop.check_frame(arguments.frame_id)
        body, printed = self._current_stop.evaluate(arguments.expression)
        for line in printed:
            self.send_event("output", {"category": "console", "output": f"{line}\n"})
        if arguments.context == "repl":
            self._send_invalidated()
        return body

    def _send_invalidated(self) -> None:
        if self._sends_invalidated:
            self.send_event("invalidated", {"areas": ["stacks", "variables"]})

    def _source(self, arguments: protocol.SourceArguments) -> Mapping[str, Any]:
        source = arguments.source or protocol.Source(source_reference=arguments.source_reference)
        return {"content": self._sources.named(source)[1], "mimeType": "text/x-clips"}

    def _loaded(self, _arguments: protocol.Nothing) -> Mapping[str, Any]:
        return {"sources": [self._sources.of(FileLine(file, 1)) for file in self._current_target.files()]}

    # -- stepping

    def _step_targets(self, arguments: protocol.FrameArguments) -> Mapping[str, Any]:
        self._current_stop.check_frame(arguments.frame_id)
        return {"targets": [{"id": each, "label": _TARGET_TITLES[each]} for each in self._step_kinds]}

    @property
    def _step_kinds(self) -> list[int]:
        return [number for number in _TARGETS if number == 1 or self._current_target.can_stop_at_actions]

    def _continue(self, arguments: protocol.ThreadArguments) -> Mapping[str, Any]:
        self._check_thread(arguments.thread_id)
        self._current_target.go_on()
        return {"allThreadsContinued": True}

    def _step_in(self, arguments: protocol.StepInArguments) -> None:
        target = 1 if arguments.target_id is None else arguments.target_id
        if target not in self._step_kinds:
            raise CxbridgeError(f"there is no target {target} to step into")
        self._step(arguments, _TARGETS[target])

    def _step(self, arguments: protocol.StepArguments, unit: str) -> None:
        self._check_thread(arguments.thread_id)
        self._current_target.step(unit)

    def _go_back(self, arguments: protocol.ThreadArguments, unit: str) -> None:
        self._check_thread(arguments.thread_id)
        self._current_target.go_back(unit)

    def _pause(self, arguments: protocol.PauseArguments) -> None:
        self._check_thread(arguments.thread_id)
        self._current_target.pause()
