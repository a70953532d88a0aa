"""The prompt of ``cxbridge run --break``: reports stops of the rules, and executes commands from stdin."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, Final, TextIO

from cxbridge.cli.command_lines import CommandLines
from cxbridge.clock import MICROSECONDS
from cxbridge.daemon.operations.operation import OperationContext
from cxbridge.daemon.operations.table import carry_out, operations
from cxbridge.errors import CxbridgeError, ExecutiveError
from cxbridge.events import InterfaceWrite, LogLine, PlannerCall
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.history.tree import goal_lines
from cxbridge.printing import indent_lines
from cxbridge.rights import ALL_RIGHTS
from cxbridge.run.servers import RunServer
from cxbridge_studio.debugger.breakpoints import Breakpoint, Stop, parse_breakpoint
from cxbridge_studio.debugger.debugger import STEP_UNITS, debugger_of
from cxbridge_studio.debugger.fact_words import parse_fact_change, parse_number
from cxbridge_studio.debugger.names import BreakpointMistakes, OccurredNames
from cxbridge_studio.explain.answer import explain
from cxbridge_studio.explain.evidence import History
from cxbridge_studio.explain.rules.environment import read_fact_slots, read_rulebook
from cxbridge_studio.explain.rules.missing import explain_missing_rule
from cxbridge_studio.explain.scenario import EnvironmentEvidence

if TYPE_CHECKING:
    from cxbridge.run.agent import Run
    from cxbridge.run.result import RunResult
    from cxbridge.run.team import Team

_MAX_ROWS: Final = 200  # limit of the printed rows of a listing

HELP: Final = """\
c                               continue
s [rule|loop|transition]        continue for one rule, loop or transition
b [SPEC]                        add a breakpoint; without SPEC: list the breakpoints
d NUMBER...                     remove breakpoints
w                               show where the rules have stopped
facts [TEMPLATE]                list facts with their indices
agenda                          list the activations in the order of firing
goals                           list the goals
why [rule|goal] NAME            explain why a rule has not fired, or the outcome of a goal
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

    def __init__(self, specs: Sequence[str], commands: CommandLines, out: TextIO) -> None:
        self._specs = [parse_breakpoint(spec) for spec in specs]
        self._commands = commands
        self._out = out
        self._agents: list[_PromptAgent] = []
        # the mistakes in the breakpoints of each initialised agent, by breakpoint
        self._mistakes: list[dict[str, ExecutiveError]] = []
        self._is_quit = False

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
        agent.debugger.names.on_mistakes = lambda mistakes: self._check_mistakes(agent, mistakes)

    def _check_mistakes(self, agent: _PromptAgent, mistakes: BreakpointMistakes) -> None:
        """Store the mistakes in an agent's breakpoints, which are known after its initialisation.

        :raises ExecutiveError: if all agents are initialised, and none can reach a breakpoint.
        """
        self._mistakes.append({str(point): agent.add_cause(point, error) for point, error in mistakes})
        if len(self._mistakes) < len(self._agents):
            return
        for spec, error in self._mistakes[0].items():
            if all(spec in mistakes_of_agent for mistakes_of_agent in self._mistakes):
                raise error

    def finish(self, result: RunResult) -> None:  # noqa: ARG002 - the same for each result
        """Report the breakpoints at which the run has not stopped."""
        if self._is_quit:
            return
        for point in dict.fromkeys(point for agent in self._agents for point in agent.debugger.breakpoints):
            counts = [agent.debugger.counts(point.number) for agent in self._agents]
            reason = _explain_unreached(
                point,
                sum(hits for hits, _ in counts),
                sum(true_hits for _, true_hits in counts),
            )
            unknown_names = [agent.occurred_names.describe_missing_name(point) for agent in self._agents]
            if reason:
                detail = f": {unknown_names[0]}" if all(unknown_names) else ""
                self._say(f"breakpoint {point.number} ({point}) {reason}{detail}")
        self._out.flush()

    def _serve_stop(self, agent: _PromptAgent, stop: Stop) -> None:
        """Execute commands until a command resumes the run, or the run is interrupted."""
        agent.print_stop(stop, with_name=len(self._agents) > 1)
        env = agent.run.executive.env
        self._is_quit = True  # stays true if the run ends at this stop
        while agent.debugger.stopped is not None:
            if self._commands.is_terminal:
                self._out.write("(cxbridge) ")
                self._out.flush()
            line = self._commands.next(lambda: env.is_ended)
            if line is None:
                if env.is_ended:
                    return
                self._detach(agent)
            elif line:
                try:
                    agent.execute_command(line)
                except CxbridgeError as error:
                    self._say(f"error: {error}")
        self._is_quit = False
        self._out.flush()

    def _detach(self, agent: _PromptAgent) -> None:
        """Remove all breakpoints and resume the run, since the input has ended."""
        for other_agent in self._agents:
            other_agent.debugger.clear()
        agent.debugger.go_on()

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
        self._with_name = False
        env = run.executive.env
        self.occurred_names = OccurredNames()
        run.bus.subscribe(self.occurred_names.add_event, *TRANSITION_TYPES)
        self._history = History(env.name, find_facts=partial(read_fact_slots, env))
        run.bus.subscribe(self._history.add_event, *TRANSITION_TYPES, PlannerCall, LogLine, InterfaceWrite)
        self._commands: dict[str, Callable[[str], None]] = {
            "c": lambda _: self._execute_operation("go-on"),
            "s": lambda unit: self._execute_operation("step", what=unit or STEP_UNITS[0]),
            "b": self._change_breakpoints,
            "d": self._remove_breakpoints,
            "w": lambda _: self._print_last_stop(),
            "facts": self._print_facts,
            "agenda": lambda _: self._print_agenda(),
            "goals": lambda _: self._print_goals(),
            "why": self._print_explanation,
            "assert": lambda fact: self._say(f"f-{self._execute_operation('assert', fact=fact)}"),
            "retract": self._retract,
            "modify": self._modify,
            "q": lambda _: self._quit(),
            "h": lambda _: self._say(HELP),
        }
        for word in ("continue", "step", "break", "delete", "where", "quit", "help"):
            self._commands[word] = self._commands[word[0]]

    def execute_command(self, line: str) -> None:
        """Execute a command.

        :raises CxbridgeError: if there is no such command, or the command fails.
        """
        word, _, argument = line.partition(" ")
        if (command := self._commands.get(word)) is not None:
            command(argument.strip())
        elif (operation := operations().get(word)) is not None and operation.at_prompt:
            self._say(json.dumps(self._execute_operation(word, **operation.parse_words(argument.strip()))))
        else:
            raise CxbridgeError(f"there is no command '{word}'", hint="h lists all commands")

    def _execute_operation(self, name: str, **arguments: Any) -> Any:
        """Execute an operation on the environment of this agent."""
        return carry_out(self._context, name, **{"env": self.run.executive.env.name, **arguments})

    def print_stop(self, stop: Stop, *, with_name: bool) -> None:
        seconds = (stop.time_us - self._start_us) / MICROSECONDS
        number = f" (breakpoint {stop.breakpoint})" if stop.breakpoint else ""
        name = f"{self.run.name}: " if with_name else ""
        self._with_name = with_name
        self._say(
            f"{name}{seconds:.3f} s: stopped {stop.reason}{number}",
            f"  fired last: {stop.rule or '-'}; next: {stop.next_rule or '-'}",
        )

    def add_cause(self, point: Breakpoint, error: ExecutiveError) -> ExecutiveError:
        """Return the error about a breakpoint, with the reason why its rule is missing, if there is one."""
        book = read_rulebook(self.run.executive.env, self.run.paths.clips_dirs)
        cause = explain_missing_rule(point.name, book) if point.is_rule_breakpoint else ""
        return ExecutiveError(error.message, hint=cause) if cause else error

    def _quit(self) -> None:
        """End the run without firing further rules."""
        self.run.interrupt()
        raise KeyboardInterrupt

    def _print_last_stop(self) -> None:
        if self.debugger.stopped is not None:
            self.print_stop(self.debugger.stopped, with_name=self._with_name)

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
        # one row more than is printed shows whether there are further rows
        facts = self._execute_operation("facts", template=template, limit=_MAX_ROWS + 1)
        self._print_rows([f"f-{index} {text}" for index, text in facts])

    def _print_agenda(self) -> None:
        activations = self._execute_operation("agenda", limit=_MAX_ROWS + 1)
        self._print_rows([f"{salience:6} {rule}: {basis}" for salience, rule, basis in activations])

    def _print_rows(self, lines: Sequence[str]) -> None:
        self._say(*lines[:_MAX_ROWS])
        if len(lines) > _MAX_ROWS:
            self._say(f"... more than {_MAX_ROWS}")

    def _print_goals(self) -> None:
        goals = self.run.executive.goals.open_goals.values()
        self._say(*(line.text for line in goal_lines(goals, show_modes=True)))

    def _print_explanation(self, question: str) -> None:
        kind, _, name = question.rpartition(" ")
        if not name or kind not in ("", "rule", "goal"):
            raise CxbridgeError("why needs a name", hint="why [rule|goal] NAME")
        now_us = self.run.clock.now_us()
        where = f"{self.run.spec} at {(now_us - self._start_us) / MICROSECONDS:.3f} s"
        evidence = EnvironmentEvidence(
            where,
            (self._start_us, now_us),
            self._history,
            self.run.executive.env,
            self.run.paths.clips_dirs,
        )
        self._say(*explain(evidence, name, kind).lines)

    def _retract(self, indices: str) -> None:
        for word in indices.split():
            self._execute_operation("retract", index=parse_number(word))

    def _modify(self, arguments: str) -> None:
        index, slots = parse_fact_change(arguments)
        self._say(f"f-{self._execute_operation('modify', index=index, slots=slots)}")


def _explain_unreached(point: Breakpoint, hits: int, true_hits: int) -> str:
    """Return why a breakpoint has not stopped the run; empty if it may have stopped the run.

    :param hits: how often the run reached the breakpoint.
    :param true_hits: how often the condition of the breakpoint was true then.
    """
    if not hits:
        return "was never reached"
    if not true_hits:
        return f"was reached {_format_count(hits)}, but its condition was never true"
    if not any(point.is_due(hit) for hit in range(1, true_hits + 1)):
        return f"was reached {_format_count(true_hits)}, which does not meet its hit count"
    return ""


def _format_count(count: int) -> str:
    return "once" if count == 1 else f"{count} times"
