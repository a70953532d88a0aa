"""The debug adapter: serves the requests of one client and sends it events.

A thread reads the requests into a queue. The main thread carries them out: before the run, between its loops
(:meth:`Adapter.pump`) and while it is stopped (:meth:`Adapter.serve_stop`), so that rules and requests never
use CLIPS at the same time.
"""

from __future__ import annotations

import queue
import threading
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
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

_POLL_S: Final = 0.2  # the seconds between two looks whether the stop is over
# The targets of `stepIn`, by the number that the client names: the unit of the step, and its title.
_STEP_TARGETS: Final = {
    1: ("rule", "the next rule"),
    2: ("line", "the next action of a right-hand side"),
}
_ENDING_REQUESTS: Final = ("disconnect", "terminate")


class Adapter:
    """A debug session with one client.

    :ivar problem: the protocol error that ended the client's stream; empty without an error.
    """

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._inbox: queue.SimpleQueue[protocol.Request | None] = queue.SimpleQueue()
        self._sources = Sources()
        self._breakpoints = Breakpoints(self._sources)
        self._target: Target | None = None
        self._stop: StopView | None = None
        self._run_phase = SessionPhase.LAUNCHED
        self._is_initialized = self._is_over = self._is_checked = False
        self._sends_invalidated = False
        self.problem = ""
        any_time, launched, stopped = phases.KNOWN, phases.LAUNCHED, SessionPhase.STOPPED
        thread, frame, nothing = protocol.ThreadArguments, protocol.FrameArguments, protocol.Nothing
        # By request: the type of its arguments, its handler, and the phases in which it is valid.
        self._handlers: Mapping[str, tuple[type[Any], Callable[[Any], Any], SessionPhase]] = {
            "initialize": (protocol.InitializeArguments, self._initialize, SessionPhase.NEW),
            "launch": (dict[str, Any], self._launch, SessionPhase.READY),
            "configurationDone": (nothing, self._configuration_done, SessionPhase.LAUNCHED),
            "setBreakpoints": (protocol.SetBreakpointsArguments, self._set_lines, any_time),
            "setFunctionBreakpoints": (
                protocol.FunctionBreakpointsArguments,
                self._set_functions,
                any_time,
            ),
            "setExceptionBreakpoints": (
                protocol.ExceptionBreakpointsArguments,
                self._set_filters,
                any_time,
            ),
            "breakpointLocations": (
                protocol.BreakpointLocationsArguments,
                self._breakpoint_locations,
                any_time,
            ),
            "threads": (nothing, self._threads, launched),
            "stackTrace": (protocol.StackTraceArguments, self._stack_trace, stopped),
            "scopes": (frame, self._scopes, stopped),
            "variables": (protocol.VariablesArguments, self._variables, stopped),
            "setVariable": (protocol.SetVariableArguments, self._set_variable, stopped),
            "evaluate": (protocol.EvaluateArguments, self._evaluate, stopped),
            "source": (protocol.SourceArguments, self._source, any_time),
            "loadedSources": (nothing, self._loaded_sources, launched),
            "stepInTargets": (frame, self._step_targets, stopped),
            "continue": (thread, self._continue, stopped),
            "stepIn": (protocol.StepInArguments, self._step_in, stopped),
            "next": (thread, lambda arguments: self._step(arguments, "transition"), stopped),
            "stepOut": (thread, lambda arguments: self._step(arguments, "loop"), stopped),
            "stepBack": (thread, lambda arguments: self._go_back(arguments, "rule"), stopped),
            "reverseContinue": (thread, lambda arguments: self._go_back(arguments, ""), stopped),
            "pause": (thread, self._pause, SessionPhase.RUNNING),
            "terminate": (nothing, self._terminate, launched),
            "disconnect": (nothing, self._disconnect, phases.ANY),
        }

    @property
    def _phase(self) -> SessionPhase:
        if self._stop is not None:
            return SessionPhase.STOPPED
        if self._target is not None:
            return self._run_phase
        return SessionPhase.READY if self._is_initialized else SessionPhase.NEW

    def serve(self) -> None:
        """Serve until the client disconnects, or :attr:`problem` describes its protocol error."""
        threading.Thread(target=self._read, name="dap", daemon=True).start()
        while not self._is_over:
            self._answer(self._inbox.get())
            if self._phase is SessionPhase.RUNNING:
                self._run()

    def _read(self) -> None:
        """Read the client's messages, in a separate thread."""
        try:
            while (request := self._wire.read()) is not None:
                if request.command in _ENDING_REQUESTS and self._target is not None:
                    self._target.interrupt()  # the rules may fire without end
                self._inbox.put(request)
        except (WireError, OSError) as error:
            self.problem = str(error)
        finally:
            self.end()

    def end(self) -> None:
        """End the session as soon as possible. Any thread may call this."""
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

    def _answer(self, request: protocol.Request | None) -> None:
        """Carry out a request and send the response.

        :param request: None ends the session.
        """
        if request is None:
            self._is_over = True
            return
        response = protocol.Response(request.seq, request.command, success=False)
        try:
            response.body = self._carry_out(request)
            response.success = True
        except CxbridgeError as error:
            response.message = str(error)
        except msgspec.DecodeError as error:
            response.message = f"the arguments are invalid: {error}"
        except Exception as error:  # noqa: BLE001 - a client waits for each response
            traceback.print_exc()
            response.message = f"a fault of cxbridge: {type(error).__name__}: {error}"
        if not response.success:
            response.body = {"error": {"id": 1, "format": response.message, "showUser": True}}
        self._wire.write(response)
        # The client sends its breakpoints after this event, and only a launched target can verify them.
        if response.success and request.command == "launch":
            self.send_event("initialized")

    def _carry_out(self, request: protocol.Request) -> Any:
        """Return the body of the response."""
        if request.command not in self._handlers:
            raise CxbridgeError(f"there is no request '{request.command}' here")
        arguments_type, handler, allowed_phases = self._handlers[request.command]
        arguments = protocol.arguments_of(request, arguments_type)
        check_phase(request.command, allowed_phases, self._phase)
        return handler(arguments)

    # -- callbacks of targets

    def pump(self) -> None:
        """Carry out the queued requests."""
        while not self._inbox.empty():
            self._answer(self._inbox.get())
        if not self._is_checked and self._current_target.is_loaded:
            self._is_checked = True
            for state in self._breakpoints.check():
                self.send_event("breakpoint", {"reason": "changed", "breakpoint": state})

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
                with suppress(queue.Empty):
                    self._answer(self._inbox.get(timeout=_POLL_S))
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
        self._is_initialized = True
        self._sends_invalidated = arguments.supports_invalidated_event
        return CAPABILITIES

    def _launch(self, arguments: dict[str, Any]) -> None:
        self._target = make_target(arguments)
        if not arguments.get("noDebug"):
            self._breakpoints.attach(self._target)
        if self._target.can_go_back:
            self.send_event("capabilities", {"capabilities": {"supportsStepBack": True}})

    def _configuration_done(self, _arguments: protocol.Nothing) -> None:
        self._run_phase = SessionPhase.RUNNING

    def _terminate(self, _arguments: protocol.Nothing) -> None:
        if self._phase is SessionPhase.LAUNCHED:  # nothing runs yet that could end by itself
            self._run_phase = SessionPhase.OVER
            self.send_event("terminated")

    def _disconnect(self, _arguments: protocol.Nothing) -> None:
        self._is_over = True

    # -- setting breakpoints

    def _set_lines(self, arguments: protocol.SetBreakpointsArguments) -> Mapping[str, Any]:
        return {"breakpoints": self._breakpoints.set_lines(arguments)}

    def _set_functions(self, arguments: protocol.FunctionBreakpointsArguments) -> Mapping[str, Any]:
        return {"breakpoints": self._breakpoints.set_functions(arguments.breakpoints)}

    def _set_filters(self, arguments: protocol.ExceptionBreakpointsArguments) -> Mapping[str, Any]:
        return {"breakpoints": self._breakpoints.set_filters(arguments)}

    def _breakpoint_locations(self, arguments: protocol.BreakpointLocationsArguments) -> Mapping[str, Any]:
        return {"breakpoints": [{"line": line} for line in self._breakpoints.lines_between(arguments)]}

    # -- inspection

    def _check_thread(self, number: int) -> None:
        agents = self._current_target.agents
        if not 0 < number <= len(agents):
            threads = ", ".join(f"{thread} ({name})" for thread, name in enumerate(agents, start=1))
            raise CxbridgeError(f"there is no thread {number}", hint=f"there are: {threads or 'none'}")

    def _threads(self, _arguments: protocol.Nothing) -> Mapping[str, Any]:
        agents = () if self._phase is SessionPhase.OVER else self._current_target.agents
        return {"threads": [{"id": number, "name": name} for number, name in enumerate(agents, start=1)]}

    def _stack_trace(self, arguments: protocol.StackTraceArguments) -> Mapping[str, Any]:
        self._check_thread(arguments.thread_id)
        if arguments.thread_id != self._current_stop.stopped.agent:
            return {"stackFrames": [], "totalFrames": 0}
        return self._current_stop.frames(arguments.start_frame, arguments.levels)

    def _scopes(self, arguments: protocol.FrameArguments) -> Mapping[str, Any]:
        return {"scopes": self._current_stop.scopes(arguments.frame_id)}

    def _variables(self, arguments: protocol.VariablesArguments) -> Mapping[str, Any]:
        reference, start, count = arguments.variables_reference, arguments.start, arguments.count
        variables = self._current_stop.variables(reference, start, count)
        # All our variables have names: a client that asks for indexed variables gets none.
        return {"variables": [] if arguments.filter == "indexed" else variables}

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
        _, text = self._sources.named(source)
        return {"content": text, "mimeType": "text/x-clips"}

    def _loaded_sources(self, _arguments: protocol.Nothing) -> Mapping[str, Any]:
        return {"sources": [self._sources.of(FileLine(file, 1)) for file in self._current_target.files()]}

    # -- stepping

    def _step_targets(self, arguments: protocol.FrameArguments) -> Mapping[str, Any]:
        self._current_stop.check_frame(arguments.frame_id)
        return {
            "targets": [
                {"id": number, "label": title} for number, (_, title) in self._possible_steps().items()
            ]
        }

    def _possible_steps(self) -> dict[int, tuple[str, str]]:
        """Return the step targets that the target supports: only some can stop within right-hand sides."""
        has_lines = self._current_target.can_stop_at_actions
        return {
            number: (unit, title)
            for number, (unit, title) in _STEP_TARGETS.items()
            if has_lines or unit != "line"
        }

    def _continue(self, arguments: protocol.ThreadArguments) -> Mapping[str, Any]:
        self._check_thread(arguments.thread_id)
        self._current_target.go_on()
        return {"allThreadsContinued": True}

    def _step_in(self, arguments: protocol.StepInArguments) -> None:
        target = 1 if arguments.target_id is None else arguments.target_id
        steps = self._possible_steps()
        if target not in steps:
            raise CxbridgeError(f"there is no target {target} to step into")
        unit, _ = steps[target]
        self._step(arguments, unit)

    def _step(self, arguments: protocol.ThreadArguments, unit: str) -> None:
        self._check_thread(arguments.thread_id)
        self._current_target.step(unit)

    def _go_back(self, arguments: protocol.ThreadArguments, unit: str) -> None:
        self._check_thread(arguments.thread_id)
        self._current_target.go_back(unit)

    def _pause(self, arguments: protocol.ThreadArguments) -> None:
        self._check_thread(arguments.thread_id)
        self._current_target.pause()
