"""A debugged run: ``cxbridge run`` in the thread that executes the client's requests."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol

from cxbridge.events import Event, Level, LogLine
from cxbridge.mainloop import Hook
from cxbridge.run.run import run_scenario
from cxbridge_studio.dap.agent import DebuggedAgent, StoppedEnvironment
from cxbridge_studio.dap.expressions import expand_known_variables
from cxbridge_studio.dap.protocol import StoppedBody
from cxbridge_studio.explain.rules.environment import read_rulebook
from cxbridge_studio.explain.rules.missing import explain_missing_rule

if TYPE_CHECKING:
    from cxbridge.run.agent import Run
    from cxbridge.run.options import RunOptions
    from cxbridge_studio.dap.protocol import ProtocolObject
    from cxbridge_studio.debugger.breakpoints import Breakpoint, Stop

# the protocol's reasons by the kind of a stop; those of the other kinds are `breakpoint`
_STOP_REASONS: Final = {"step": "step", "asked": "pause", "transition": "function breakpoint"}
_INTERRUPTED_STATUS: Final = 130  # the exit status of shells for SIGINT: 128 + 2
_OUTPUT_CATEGORIES: Final = {Level.ERROR: "stderr", Level.WARN: "stderr"}


class DebugClient(Protocol):
    """The interface of a client that a run uses."""

    def handle_queued_requests(self) -> None:
        """Execute the queued requests."""

    def serve_stop(
        self, body: StoppedBody, stopped_env: StoppedEnvironment, is_over: Callable[[], bool]
    ) -> None:
        """Execute requests until a request resumes the run.

        :param body: the body of the event ``stopped``.
        :param stopped_env: the state of the stopped agent.
        :param is_over: returns whether the stop is over.
        """

    def send_event(self, name: str, body: Mapping[str, object] | ProtocolObject | None = None) -> None: ...


class DebuggedRun:
    """A debugged run. The serving thread calls all methods except :meth:`interrupt`.

    :param stop_on_entry: whether to stop before the first rule.
    :param can_stop_at_actions: whether the run can stop within right-hand sides.
    :raises CxbridgeError: if an option is invalid.
    """

    def __init__(
        self, options: RunOptions, *, stop_on_entry: bool = False, can_stop_at_actions: bool = True
    ) -> None:
        options.check()
        self._options = options
        self._stop_on_entry = stop_on_entry
        self.can_stop_at_actions = can_stop_at_actions
        self._agents: list[DebuggedAgent] = []
        # by group: the breakpoints by the client's numbers
        self._breakpoint_groups: dict[str, Mapping[int, Breakpoint]] = {}
        self._is_interrupted = False

    @property
    def agents(self) -> Sequence[str]:
        """The names of the agents. Each agent is a thread of the protocol."""
        return [agent.run.name for agent in self._agents]

    def run(self, client: DebugClient) -> int:
        """Run the scenario, send its log and its result to the client, and return the exit status.

        :returns: the status of ``cxbridge run``; 130 if :meth:`interrupt` has ended the run.
        :raises CxbridgeError: if the scenario is invalid.
        :raises BaseException: any error that occurred while a right-hand side was stopped.
        """

        def send_line(event: Event) -> None:
            if isinstance(event, LogLine):
                category = _OUTPUT_CATEGORIES.get(event.level, "stdout")
                client.send_event(
                    "output", {"category": category, "output": f"{event.component}: {event.text}\n"}
                )

        result = run_scenario(
            self._options, send_line, lambda run: self._attach(run, client), interactive=True
        )
        for agent in self._agents:
            agent.raise_error()
        reason = "ended by the client" if self._is_interrupted else result.reason
        client.send_event("output", {"category": "console", "output": f"{reason}\n"})
        return _INTERRUPTED_STATUS if self._is_interrupted else result.status

    def _attach(self, run: Run, client: DebugClient) -> None:
        """Attach a debugger with all breakpoints to an agent before its start."""
        agent = DebuggedAgent(run, can_stop_at_actions=self.can_stop_at_actions)
        self._agents.append(agent)
        thread_id = len(self._agents)
        for group, breakpoints in self._breakpoint_groups.items():
            agent.set_breakpoints(group, breakpoints)
        agent.debugger.on_stop = lambda stop: self._serve_stop(client, thread_id, stop)
        agent.debugger.expand = lambda text, stop: expand_known_variables(
            text, StoppedEnvironment(agent, stop)
        )

        def handle_queued_requests() -> None:
            agent.renew_watch()
            client.handle_queued_requests()
            if self._is_interrupted:  # by an interrupt before the start of the loop
                run.loop.stop()

        run.loop.add(Hook.PRE_LOOP, handle_queued_requests)
        client.send_event("thread", {"reason": "started", "threadId": thread_id})
        if self._stop_on_entry:
            agent.debugger.stop()
        if self._is_interrupted:
            run.interrupt()

    def _serve_stop(self, client: DebugClient, thread_id: int, stop: Stop) -> None:
        agent = self._agents[thread_id - 1]
        reason = _STOP_REASONS.get(stop.kind, "breakpoint")
        # a stop on entry is made like a pause: only its position is special
        if reason == "pause" and self._stop_on_entry and stop.loop == 1 and stop.fired == 0:
            reason = "entry"
        number = agent.client_numbers.get(stop.breakpoint)
        body = StoppedBody(
            reason,
            f"Stopped {stop.reason}",
            thread_id,
            all_threads_stopped=True,
            hit_breakpoint_ids=[] if number is None else [number],
        )
        client.serve_stop(
            body,
            StoppedEnvironment(agent, stop),
            lambda: agent.debugger.stopped is None or agent.env.is_ended,
        )
        if agent.debugger.stopped is not None:  # the session is over; go_on() would discard a requested step
            agent.debugger.go_on()

    def interrupt(self) -> None:
        """End the run as soon as possible. Any thread may call this."""
        self._is_interrupted = True
        for agent in self._agents:
            agent.run.loop.stop()
            agent.run.interrupt()

    def set_breakpoints(self, group: str, breakpoints: Mapping[int, Breakpoint]) -> None:
        """Replace the breakpoints of a group, given by the client's numbers."""
        self._breakpoint_groups[group] = breakpoints  # for agents that start later
        for agent in self._agents:
            agent.set_breakpoints(group, breakpoints)

    def go_on(self) -> None:
        """Resume until the next breakpoint."""
        for agent in self._agents:
            agent.debugger.go_on()

    def step(self, unit: str) -> None:
        """Resume until a ``rule``, ``loop``, ``transition`` or ``line`` of any agent."""
        for agent in self._agents:
            agent.debugger.step(unit)

    def pause(self) -> None:
        """Stop as soon as possible."""
        for agent in self._agents:
            agent.debugger.stop()

    @property
    def is_loaded(self) -> bool:
        """Whether the rules of all agents are known."""
        return bool(self._agents) and all(agent.run.executive.is_initialized for agent in self._agents)

    def explain_no_stop(self, rule: str, file: Path) -> str:
        """Return why no agent can stop at a rule of a file; empty if any agent can."""
        reasons = [self._explain_missing(agent, rule, file) for agent in self._agents]
        return reasons[0] if all(reasons) else ""

    @staticmethod
    def _explain_missing(agent: DebuggedAgent, rule: str, file: Path) -> str:
        """Return why an agent lacks a rule of a file; empty if it has the rule."""
        rule_position = agent.find_rule_position(rule)
        if rule_position is not None and rule_position.file != file:
            return f"the loaded rule {rule} is defined in {rule_position.file}:{rule_position.line}"
        rulebook = read_rulebook(agent.env, agent.run.paths.clips_dirs)
        if rule in rulebook.rules:
            return ""
        return explain_missing_rule(rule, rulebook) or f"the spec does not load {file.name}"

    def explain_unreachable(self, tested_breakpoint: Breakpoint) -> str:
        """Return why no agent can reach a breakpoint; empty if any agent can."""
        checkers = (agent.debugger.breakpoint_checker for agent in self._agents)
        mistakes = [checker.find_mistake(tested_breakpoint) for checker in checkers]
        return str(mistakes[0]) if all(mistakes) else ""
