"""The debug adapter: executes the requests of one client, an editor, and sends events to the client.

A thread reads the requests into a queue. The main thread executes them: before and after the run, between
its loops (:meth:`Adapter.handle_queued_requests`) and while it is stopped (:meth:`Adapter.serve_stop`), so
that rules and requests never use CLIPS at the same time.
"""

from __future__ import annotations

import queue
import threading
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import Any, Final

import msgspec

from cxbridge.errors import CxbridgeError
from cxbridge_studio.dap import protocol
from cxbridge_studio.dap.agent import StoppedEnvironment
from cxbridge_studio.dap.breakpoints import FILTERS, Breakpoints
from cxbridge_studio.dap.debugged_run import DebuggedRun
from cxbridge_studio.dap.launching import make_debugged_run
from cxbridge_studio.dap.phases import (
    AFTER_INITIALIZE,
    AFTER_LAUNCH,
    ANY_PHASE,
    STOPPED,
    SessionPhase,
    check_phase,
)
from cxbridge_studio.dap.stops import StopView
from cxbridge_studio.dap.wire import Wire, WireError

CAPABILITIES: Final = {
    "supportsConfigurationDoneRequest": True,
    "supportsFunctionBreakpoints": True,
    "supportsConditionalBreakpoints": True,
    "supportsHitConditionalBreakpoints": True,
    "supportsLogPoints": True,
    "supportsEvaluateForHovers": True,
    "supportsSetVariable": True,
    "supportsStepInTargetsRequest": True,
    "supportsTerminateRequest": True,
    "exceptionBreakpointFilters": [{"filter": name, "label": title} for name, (title, _) in FILTERS.items()],
}

# The time between two checks whether the stop is over. Chosen freely: a request ends the wait at once, so a
# check only notices that another thread has interrupted the run.
_POLL_PERIOD_S: Final = 0.2
# the targets of the request `stepIn`: the unit of the step and its title, by the number that the client sends
_STEP_TARGETS: Final = {
    1: ("rule", "the next rule"),
    2: ("line", "the next action of a right-hand side"),
}
_ENDING_REQUESTS: Final = ("disconnect", "terminate")


class Adapter:
    """A debug session with one client.

    :ivar problem: the error of the protocol or of the stream that ended the session; empty without an error.
    """

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._requests: queue.SimpleQueue[protocol.Request | None] = queue.SimpleQueue()
        self._breakpoints = Breakpoints()
        self._run: DebuggedRun | None = None
        self._stop_view: StopView | None = None
        self._phase = SessionPhase.NEW
        self._is_over = self._are_breakpoints_verified = self._sends_invalidated = False
        self.problem = ""
        # by request: the type of its arguments, its handler, and the phases in which the request is valid
        self._handlers: Mapping[str, tuple[type[Any], Callable[[Any], Any], SessionPhase]] = {
            "initialize": (protocol.InitializeRequestArguments, self._initialize, SessionPhase.NEW),
            "launch": (dict[str, Any], self._launch, SessionPhase.READY),
            "configurationDone": (protocol.NoArguments, self._configuration_done, SessionPhase.LAUNCHED),
            "setBreakpoints": (
                protocol.SetBreakpointsArguments,
                self._set_line_breakpoints,
                AFTER_INITIALIZE,
            ),
            "setFunctionBreakpoints": (
                protocol.SetFunctionBreakpointsArguments,
                self._set_function_breakpoints,
                AFTER_INITIALIZE,
            ),
            "setExceptionBreakpoints": (
                protocol.SetExceptionBreakpointsArguments,
                self._set_exception_filters,
                AFTER_INITIALIZE,
            ),
            "threads": (protocol.NoArguments, self._list_threads, AFTER_LAUNCH),
            "stackTrace": (protocol.ThreadArguments, self._get_stack_trace, STOPPED),
            "scopes": (protocol.FrameArguments, self._list_scopes, STOPPED),
            "variables": (protocol.VariablesArguments, self._list_variables, STOPPED),
            "setVariable": (protocol.SetVariableArguments, self._set_variable, STOPPED),
            "evaluate": (protocol.EvaluateArguments, self._evaluate, STOPPED),
            "stepInTargets": (protocol.FrameArguments, self._list_step_targets, STOPPED),
            "continue": (protocol.ThreadArguments, self._continue, STOPPED),
            "stepIn": (protocol.StepInArguments, self._step_in, STOPPED),
            "next": (
                protocol.ThreadArguments,
                partial(self._step, unit="transition"),
                STOPPED,
            ),
            "stepOut": (protocol.ThreadArguments, partial(self._step, unit="loop"), STOPPED),
            "pause": (protocol.ThreadArguments, self._pause, SessionPhase.RUNNING),
            "terminate": (protocol.NoArguments, self._terminate, AFTER_LAUNCH),
            "disconnect": (protocol.NoArguments, self._disconnect, ANY_PHASE),
        }

    def serve(self) -> None:
        """Serve until the client disconnects, its stream ends or has an error, or :meth:`end` is called."""
        threading.Thread(target=self._read_requests, name="dap", daemon=True).start()
        while not self._is_over:
            self._handle_request(self._requests.get())
            if self._phase is SessionPhase.RUNNING:
                self._execute_run()

    def _read_requests(self) -> None:
        """Read the client's messages, in a separate thread."""
        try:
            while (request := self._wire.read()) is not None:
                if request.command in _ENDING_REQUESTS and self._run is not None:
                    # at once, not from the queue: the main thread may run rules that never stop firing
                    self._run.interrupt()
                self._requests.put(request)
        except (WireError, OSError) as error:
            self.problem = str(error)
        finally:
            self.end()

    def end(self) -> None:
        """End the session as soon as possible. Any thread may call this."""
        self._requests.put(None)
        if self._run is not None:
            self._run.interrupt()

    def _execute_run(self) -> None:
        """Execute the run to its end and send its exit status."""
        try:
            status = self._current_run.run(self)
        except CxbridgeError as error:
            self.send_event("output", {"category": "stderr", "output": f"cxbridge: error: {error}\n"})
            status = error.exit_status
        self._phase = SessionPhase.OVER
        self.send_event("exited", {"exitCode": status})
        self.send_event("terminated")

    def _handle_request(self, request: protocol.Request | None) -> None:
        """Execute a request, and send the response.

        :param request: None ends the session.
        """
        if request is None:
            self._is_over = True
            return
        response = protocol.Response(request.seq, request.command, success=False)
        try:
            response.body = self._execute_request(request)
            response.success = True
        except CxbridgeError as error:
            response.message = str(error)
        except msgspec.DecodeError as error:
            response.message = f"the arguments are invalid: {error}"
        except Exception as error:  # noqa: BLE001 - a client waits for each response
            traceback.print_exc()
            response.message = f"an internal error of cxbridge: {type(error).__name__}: {error}"
        if not response.success:
            response.body = {"error": {"id": 1, "format": response.message, "showUser": True}}
        self._wire.write(response)
        # The client sends its breakpoints after this event, and only a launched run can verify them.
        if response.success and request.command == "launch":
            self.send_event("initialized")

    def _execute_request(self, request: protocol.Request) -> Any:
        """Execute a request, and return the body of the response.

        :raises CxbridgeError: if the request is unknown, is invalid in this phase, or fails.
        :raises msgspec.DecodeError: if the arguments are invalid.
        """
        if request.command not in self._handlers:
            raise CxbridgeError(f"there is no request '{request.command}'")
        arguments_type, handler, allowed_phases = self._handlers[request.command]
        arguments = protocol.parse_arguments(request, arguments_type)
        check_phase(request.command, allowed_phases, self._phase)
        return handler(arguments)

    # -- callbacks of the run

    def handle_queued_requests(self) -> None:
        """Execute the queued requests, and report breakpoints whose state has changed."""
        while not self._requests.empty():
            self._handle_request(self._requests.get())
        if not self._are_breakpoints_verified and self._current_run.is_loaded:
            self._are_breakpoints_verified = True
            for state in self._breakpoints.find_unreachable():
                self.send_event("breakpoint", {"reason": "changed", "breakpoint": state})

    def serve_stop(
        self, body: protocol.StoppedBody, stopped_env: StoppedEnvironment, is_over: Callable[[], bool]
    ) -> None:
        """Execute requests until a request resumes the run; see :class:`DebugClient`."""
        self._stop_view, self._phase = StopView(body.thread_id, stopped_env), STOPPED
        if any(map(self._breakpoints.is_exception_filter, body.hit_breakpoint_ids)):
            body.reason, body.text = "exception", body.description
        self.send_event("stopped", body)
        try:
            while not is_over() and not self._is_over:
                with suppress(queue.Empty):
                    self._handle_request(self._requests.get(timeout=_POLL_PERIOD_S))
        finally:
            self._stop_view, self._phase = None, SessionPhase.RUNNING

    def send_event(
        self, name: str, body: Mapping[str, object] | protocol.ProtocolObject | None = None
    ) -> None:
        self._wire.write(protocol.Event(name, body))

    # -- start and end

    @property
    def _current_run(self) -> DebuggedRun:
        assert self._run is not None, "the handlers that need a run are valid after `launch`"
        return self._run

    @property
    def _current_stop(self) -> StopView:
        assert self._stop_view is not None, "the handlers that need a stop are valid while the run is stopped"
        return self._stop_view

    def _initialize(self, arguments: protocol.InitializeRequestArguments) -> Mapping[str, Any]:
        if not (arguments.lines_start_at1 and arguments.columns_start_at1):
            raise CxbridgeError("lines and columns must be counted from 1")
        self._phase = SessionPhase.READY
        self._sends_invalidated = arguments.supports_invalidated_event
        return CAPABILITIES

    def _launch(self, arguments: dict[str, Any]) -> None:
        self._run, self._phase = make_debugged_run(arguments), SessionPhase.LAUNCHED
        if not arguments.get("noDebug"):
            self._breakpoints.attach(self._run)

    def _configuration_done(self, _arguments: protocol.NoArguments) -> None:
        self._phase = SessionPhase.RUNNING

    def _terminate(self, _arguments: protocol.NoArguments) -> None:
        # A run in progress has been interrupted by the reading thread, and its end sends this event.
        if self._phase is SessionPhase.LAUNCHED:
            self._phase = SessionPhase.OVER
            self.send_event("terminated")

    def _disconnect(self, _arguments: protocol.NoArguments) -> None:
        self._is_over = True

    # -- setting breakpoints

    def _set_line_breakpoints(self, arguments: protocol.SetBreakpointsArguments) -> Mapping[str, Any]:
        return {"breakpoints": self._breakpoints.set_line_breakpoints(arguments)}

    def _set_function_breakpoints(
        self, arguments: protocol.SetFunctionBreakpointsArguments
    ) -> Mapping[str, Any]:
        return {"breakpoints": self._breakpoints.set_function_breakpoints(arguments.breakpoints)}

    def _set_exception_filters(
        self, arguments: protocol.SetExceptionBreakpointsArguments
    ) -> Mapping[str, Any]:
        return {"breakpoints": self._breakpoints.set_exception_filters(arguments.filters)}

    # -- inspection

    def _check_thread(self, number: int) -> None:
        agents = self._current_run.agents
        if not 0 < number <= len(agents):
            threads = ", ".join(f"{thread} ({name})" for thread, name in enumerate(agents, start=1))
            raise CxbridgeError(f"there is no thread {number}", hint=f"the threads are {threads or 'none'}")

    def _list_threads(self, _arguments: protocol.NoArguments) -> Mapping[str, Any]:
        agents = () if self._phase is SessionPhase.OVER else self._current_run.agents
        return {"threads": [{"id": number, "name": name} for number, name in enumerate(agents, start=1)]}

    def _get_stack_trace(self, arguments: protocol.ThreadArguments) -> Mapping[str, Any]:
        self._check_thread(arguments.thread_id)
        stop = self._current_stop
        return {"stackFrames": stop.list_frames() if arguments.thread_id == stop.thread_id else []}

    def _list_scopes(self, arguments: protocol.FrameArguments) -> Mapping[str, Any]:
        return {"scopes": self._current_stop.list_scopes(arguments.frame_id)}

    def _list_variables(self, arguments: protocol.VariablesArguments) -> Mapping[str, Any]:
        return {"variables": self._current_stop.list_variables(arguments.variables_reference)}

    def _set_variable(self, arguments: protocol.SetVariableArguments) -> Mapping[str, Any]:
        value = self._current_stop.set_value(arguments.variables_reference, arguments.name, arguments.value)
        self._send_invalidated()
        return {"value": value}

    def _evaluate(self, arguments: protocol.EvaluateArguments) -> protocol.EvaluateBody:
        if arguments.frame_id is not None:
            self._current_stop.find_frame(arguments.frame_id)  # for its error
        body, output_lines = self._current_stop.evaluate(arguments.expression)
        for line in output_lines:
            self.send_event("output", {"category": "console", "output": f"{line}\n"})
        if arguments.context == "repl":
            self._send_invalidated()
        return body

    def _send_invalidated(self) -> None:
        if self._sends_invalidated:
            self.send_event("invalidated", {"areas": ["stacks", "variables"]})

    # -- stepping

    def _list_step_targets(self, arguments: protocol.FrameArguments) -> Mapping[str, Any]:
        self._current_stop.find_frame(arguments.frame_id)  # for its error
        return {
            "targets": [
                {"id": number, "label": title} for number, (_, title) in self._find_possible_steps().items()
            ]
        }

    def _find_possible_steps(self) -> dict[int, tuple[str, str]]:
        """Return the unit and the title of each target of `stepIn` that the run supports, by number."""
        has_lines = self._current_run.can_stop_at_actions
        return {
            number: (unit, title)
            for number, (unit, title) in _STEP_TARGETS.items()
            if has_lines or unit != "line"
        }

    def _continue(self, arguments: protocol.ThreadArguments) -> Mapping[str, Any]:
        self._check_thread(arguments.thread_id)
        self._current_run.go_on()
        return {"allThreadsContinued": True}

    def _step_in(self, arguments: protocol.StepInArguments) -> None:
        steps = self._find_possible_steps()
        if arguments.target_id not in steps:
            raise CxbridgeError(f"there is no target {arguments.target_id} to step into")
        unit, _ = steps[arguments.target_id]
        self._step(arguments, unit)

    def _step(self, arguments: protocol.ThreadArguments, unit: str) -> None:
        self._check_thread(arguments.thread_id)
        self._current_run.step(unit)

    def _pause(self, arguments: protocol.ThreadArguments) -> None:
        self._check_thread(arguments.thread_id)
        self._current_run.pause()
