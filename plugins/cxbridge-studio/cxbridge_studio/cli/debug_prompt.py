"""The prompt of ``cxbridge run --break``: reports stops of the rules, and executes commands from stdin."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, TextIO

from cxbridge.cli.input_lines import InputLines
from cxbridge.clock import MICROSECONDS
from cxbridge.daemon.operations.operation import OperationContext
from cxbridge.daemon.operations.table import carry_out
from cxbridge.errors import CxbridgeError, ExecutiveError
from cxbridge.history.tree import goal_lines
from cxbridge.printing import indent_lines
from cxbridge.rights import ALL_RIGHTS
from cxbridge.run.servers import RunServer
from cxbridge_studio.debugger.breakpoint_checker import BreakpointMistakes
from cxbridge_studio.debugger.breakpoints import Stop, parse_breakpoint
from cxbridge_studio.debugger.command_words import execute_command, parse_fact_change, parse_number
from cxbridge_studio.debugger.debugger import STEP_UNITS, debugger_of

if TYPE_CHECKING:
    from cxbridge.run.agent import Run
    from cxbridge.run.result import RunResult
    from cxbridge.run.team import Team

_MAX_ROWS: Final = 200  # limit of the printed rows of a listing; chosen freely

HELP: Final = """\
c                               continue
s [rule|loop|transition]        continue for one rule, loop or transition
b [SPEC]                        add a breakpoint; without SPEC: list the breakpoints
d NUMBER...                     remove breakpoints
facts [TEMPLATE]                list facts with their indices
agenda                          list the activations in the order of firing
goals                           list the goals
assert (FACT)                   assert a fact
retract INDEX...                retract facts
modify INDEX (SLOT VALUE)...    change slots of a fact
q                               end the run
h                               show this text"""


class DebugPrompt(RunServer):
    """Reports stops of the rules, and executes the commands that the user types.

    :param specs: the specifications of the first breakpoints.
    :param commands: the input; at its end, the prompt removes all breakpoints, and the run continues.
    :param out: the output.
    """

    def __init__(self, specs: Sequence[str], commands: InputLines, out: TextIO) -> None:
        self._specs = [parse_breakpoint(spec) for spec in specs]
        self._commands = commands
        self._out = out
        self._agents: list[_PromptAgent] = []
        # the mistakes in the breakpoints of each initialised agent, by breakpoint
        self._mistakes: list[dict[str, ExecutiveError]] = []
        self._is_at_stop = False  # stays true if the run ends at a stop

    @contextmanager
    def serve(self, run: Run | Team) -> Iterator[None]:
        for agent in run.agents:
            self._attach(agent)
        yield

    def _attach(self, run: Run) -> None:
        agent = _PromptAgent(run, self._say)
        self._agents.append(agent)
        for spec in self._specs:
            agent.debugger.add(spec)
        agent.debugger.on_stop = lambda stop: self._serve_stop(agent, stop)
        agent.debugger.breakpoint_checker.on_mistakes = self._add_mistakes

    def _add_mistakes(self, mistakes: BreakpointMistakes) -> None:
        """Store the mistakes in the breakpoints of one agent, which are known after its initialisation.

        :raises ExecutiveError: if all agents are initialised, and none can reach a breakpoint.
        """
        self._mistakes.append({str(point): error for point, error in mistakes})
        if len(self._mistakes) < len(self._agents):
            return
        for spec, error in self._mistakes[0].items():
            if all(spec in mistakes_of_agent for mistakes_of_agent in self._mistakes):
                raise error

    def finish(self, result: RunResult) -> None:  # noqa: ARG002 - the same for each result
        """Report the breakpoints that the run has not reached."""
        if self._is_at_stop:  # the breakpoints may lie ahead
            return
        for point in dict.fromkeys(point for agent in self._agents for point in agent.debugger.breakpoints):
            if not any(agent.debugger.count_hits(point.number) for agent in self._agents):
                self._say(f"breakpoint {point.number} ({point}) was never reached")
        self._out.flush()

    def _serve_stop(self, agent: _PromptAgent, stop: Stop) -> None:
        """Execute commands until the run is resumed, by a command or the end of the input, or interrupted."""
        agent.print_stop(stop, with_name=len(self._agents) > 1)
        env = agent.run.executive.env
        self._is_at_stop = True
        while agent.debugger.stopped is not None:
            if self._commands.is_terminal:
                self._out.write("(cxbridge) ")
                self._out.flush()
            line = self._commands.next(lambda: env.is_ended)
            if line is None:
                if env.is_ended:
                    return
                for attached_agent in self._agents:  # the input has ended
                    attached_agent.debugger.clear()
                agent.debugger.go_on()
            elif line:
                try:
                    agent.execute_command(line)
                except CxbridgeError as error:
                    self._say(f"error: {error}")
        self._is_at_stop = False
        self._out.flush()

    def _say(self, *lines: str) -> None:
        for line in lines:
            self._out.write(indent_lines(line) + "\n")


class _PromptAgent:
    """An agent of the run, and the commands about the agent.

    :param run: the run of the agent.
    :param say: prints lines.
    """

    def __init__(self, run: Run, say: Callable[..., None]) -> None:
        self.run = run
        self.debugger = debugger_of(run.executive)
        self._context = OperationContext(ALL_RIGHTS, lambda: run.executive)
        self._say = say
        self._start_us = run.clock.now_us()
        self._commands: dict[str, Callable[[str], None]] = {
            "c": lambda _: self._execute_operation("go-on"),
            "s": lambda unit: self._execute_operation("step", what=unit or STEP_UNITS[0]),
            "b": self._change_breakpoints,
            "d": self._remove_breakpoints,
            "facts": self._print_facts,
            "agenda": lambda _: self._print_agenda(),
            "goals": lambda _: self._print_goals(),
            "assert": lambda fact: self._say(f"f-{self._execute_operation('assert', fact=fact)}"),
            "retract": self._retract,
            "modify": self._modify,
            "q": lambda _: self._quit(),
            "h": lambda _: self._say(HELP),
        }

    def execute_command(self, line: str) -> None:
        """Execute a command.

        :raises CxbridgeError: if there is no such command, or the command fails.
        """
        execute_command(self._commands, line, "h lists all commands")

    def _execute_operation(self, name: str, **arguments: Any) -> Any:
        """Execute an operation on the environment of this agent, and return its result."""
        return carry_out(self._context, name, **{"env": self.run.executive.env.name, **arguments})

    def print_stop(self, stop: Stop, *, with_name: bool) -> None:
        seconds = (stop.time_us - self._start_us) / MICROSECONDS
        breakpoint_note = f" (breakpoint {stop.breakpoint})" if stop.breakpoint else ""
        name = f"{self.run.name}: " if with_name else ""
        self._say(
            f"{name}{seconds:.3f} s: stopped {stop.reason}{breakpoint_note}",
            f"  fired last: {stop.rule or '-'}; next: {stop.next_rule or '-'}",
        )

    def _quit(self) -> None:
        """End the run without firing further rules.

        :raises KeyboardInterrupt: always, so that the run ends as after Ctrl-C.
        """
        self.run.interrupt()
        raise KeyboardInterrupt

    def _change_breakpoints(self, spec: str) -> None:
        rows = (
            self._execute_operation("break-add", specs=[spec])
            if spec
            else self._execute_operation("break-list")
        )
        self._say(*(f"{row['number']}  {row['spec']}" for row in rows))

    def _remove_breakpoints(self, numbers: str) -> None:
        for word in numbers.split():
            self._execute_operation("break-remove", numbers=[parse_number(word)])

    def _print_facts(self, template: str) -> None:
        facts = self._execute_operation("facts", template=template, limit=_MAX_ROWS)
        self._say(*(f"f-{index} {text}" for index, text in facts))

    def _print_agenda(self) -> None:
        activations = self._execute_operation("agenda", limit=_MAX_ROWS)
        self._say(*(f"{salience:6} {rule}: {basis}" for salience, rule, basis in activations))

    def _print_goals(self) -> None:
        goals = self.run.executive.goals.open_goals.values()
        self._say(*(line.text for line in goal_lines(goals, show_modes=True)))

    def _retract(self, indices: str) -> None:
        for word in indices.split():
            self._execute_operation("retract", index=parse_number(word))

    def _modify(self, arguments: str) -> None:
        index, slots = parse_fact_change(arguments)
        self._say(f"f-{self._execute_operation('modify', index=index, slots=slots)}")
