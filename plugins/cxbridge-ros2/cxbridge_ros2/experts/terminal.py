"""The commands of plansys2_terminal, for the experts of cxbridge and of PlanSys2.

:class:`Terminal` parses a line, requests services of the experts, and yields the output. The names of the
commands and the forms of their output are those of plansys2_terminal.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

from cxbridge.errors import PddlError, Ros2Error
from cxbridge.executive.pddl import format_formula, parse_formula
from cxbridge.executive.pddl.ast import (
    Atom,
    Constant,
    Formula,
    FunctionTerm,
    Ground,
    TermComparison,
    number_of,
)
from cxbridge.executive.pddl.printer import format_number
from cxbridge.numbers import parse_decimal
from cxbridge.rights import Right
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.experts.client import ExpertClient
from cxbridge_ros2.experts.execution import PlanItem, execute_plan, parse_item, read_plan
from cxbridge_ros2.experts.knowledge import format_ground, make_ground
from cxbridge_ros2.experts.nodes import (
    NodeCodec,
    TreeNodeKind,
    make_ground_node,
    make_param,
    parse_ground_node,
)
from cxbridge_ros2.hub.protocol import PerformerState
from cxbridge_ros2.messages import Message
from cxbridge_ros2.plansys2 import PROTOCOL

PLANNING_TIMEOUT_S: Final = 120.0  # limit of planning in seconds

LISTENING_S: Final = 2.0  # seconds to listen for heartbeats of performers

# Titles of the formulas in a plansys2_msgs/msg/DurativeAction.
_TIMED_FIELD_TITLES: Final = {
    "at_start_requirements": "at start needs",
    "over_all_requirements": "over all needs",
    "at_end_requirements": "at end needs",
    "at_start_effects": "at start does",
    "at_end_effects": "at end does",
}

OutputLines = Iterator[str]

# Carries out a command with the rest of its line, and returns its output; None for no output.
CommandHandler = Callable[[str], Iterable[str] | None]


class UsageError(Ros2Error):
    """An invalid command."""


class Terminal:
    """Carries out commands.

    :param codec: the codec for the experts' distribution.
    :ivar is_over: whether the command `quit` was carried out.
    :ivar commands: the functions of the commands by name.
    """

    def __init__(self, client: ExpertClient, codec: NodeCodec) -> None:
        self._client = client
        self._codec = codec
        self.is_over = False
        self._is_sourcing = False  # whether a file of commands is read
        model: Mapping[str, CommandHandler] = {
            "types": self._show_types,
            "predicates": partial(self._show_names, "predicates"),
            "functions": partial(self._show_names, "functions"),
            "actions": self._show_actions,
            "predicate": partial(self._show_declaration, "predicate"),
            "function": partial(self._show_declaration, "function"),
            "action": self._show_action,
        }
        self.commands: Mapping[str, CommandHandler] = {
            "get domain": self._show_domain,
            # the terminals of different distributions say `model` or `domain`
            **{f"get {noun} {name}": model[name] for noun in ("model", "domain") for name in model},
            "get problem": self._show_problem,
            "get problem instances": self._show_instances,
            "get problem predicates": self._show_predicates,
            "get problem functions": self._show_functions,
            "get problem goal": self._show_goal,
            "get plan": self._show_plan,
            "set instance": self._set_instance,
            "set predicate": partial(self._change_predicate, "add_problem_predicate"),
            "set function": self._set_function,
            "set goal": self._set_goal,
            "remove instance": self._remove_instance,
            "remove predicate": partial(self._change_predicate, "remove_problem_predicate"),
            "remove function": self._remove_function,
            "remove goal": self._remove_goal,
            "check actors": self._show_performers,
            "run": self._run_plan,
            "source": self._run_file,
            "help": self._show_help,
            "?": self._show_help,
            "quit": self._quit,
        }

    def run_line(self, line: str) -> OutputLines:
        """Carry out a command and yield its output."""
        words = line.split()
        if not words:
            return
        # names of commands have up to 3 words; the longest first, since "get problem goal" begins with the
        # command "get problem"
        for count in (3, 2, 1):
            command = " ".join(words[:count])
            if count <= len(words) and command in self.commands:
                argument = " ".join(line.split(None, count)[count:]).strip()
                if argument and command in _ARGUMENTLESS_COMMANDS:
                    raise UsageError(f"'{command}' takes no argument, but got '{argument}'")
                try:
                    yield from self.commands[command](argument) or ()
                except PddlError as error:
                    raise UsageError(error.message, hint=error.hint) from None
                return
        first_words = dict.fromkeys(command.split()[0] for command in self.commands)
        similar = [command for command in self.commands if command.split()[0] == words[0]] or [*first_words]
        raise UsageError(
            f"unknown command '{line.strip()}'",
            hint=did_you_mean(" ".join(words[:2]), similar, f"there are: {', '.join(similar)}"),
        )

    def find_completions(self, line: str) -> list[str]:
        """Return the possible next words.

        :param line: the typed text; its last word may be incomplete.
        """
        *words, incomplete_word = line.split(" ")
        complete_words = [word for word in words if word]
        commands = (command.split() for command in self.commands)
        next_words = {
            command[len(complete_words)]
            for command in commands
            if command[: len(complete_words)] == complete_words and len(command) > len(complete_words)
        }
        return sorted(word for word in next_words if word.startswith(incomplete_word))

    def _request_domain(self, service: str, request: Mapping[str, Any] | None = None) -> Message:
        return self._client.request(f"/domain_expert/get_domain{service}", request)

    def _request_problem(self, service: str, request: Mapping[str, Any] | None = None) -> Message:
        return self._client.request(f"/problem_expert/{service}", request)

    # --- the domain

    def _show_domain(self, _argument: str) -> OutputLines:
        yield self._request_domain("")["domain"].rstrip("\n")

    def _show_types(self, _argument: str) -> OutputLines:
        yield from self._request_domain("_types")["types"]

    def _show_names(self, noun: str, _argument: str) -> OutputLines:
        yield from (node["name"] for node in self._request_domain(f"_{noun}")["states"])

    def _show_actions(self, _argument: str) -> OutputLines:
        yield from self._request_domain("_actions")["actions"]
        for name in self._request_domain("_durative_actions")["actions"]:
            yield f"{name} (durative)"

    def _show_declaration(self, noun: str, argument: str) -> OutputLines:
        name = _parse_single_name(argument, f"get model {noun} NAME")
        yield _format_signature(self._request_domain(f"_{noun}_details", {"expression": name})["node"])

    def _show_action(self, argument: str) -> OutputLines:
        name = _parse_single_name(argument, "get model action NAME")
        durative_names = self._request_domain("_durative_actions")["actions"]
        if name.lower() in map(str.lower, durative_names):
            request = {"durative_action": name}
            action = self._request_domain("_durative_action_details", request)["durative_action"]
            formulas = [(text, action[field]) for field, text in _TIMED_FIELD_TITLES.items()]
        else:
            action = self._request_domain("_action_details", {"action": name})["action"]
            formulas = [("needs", action["preconditions"]), ("does", action["effects"])]
        yield _format_signature(action)
        for noun, tree in formulas:
            if tree["nodes"] and (text := self._format_tree(tree)) != "(and)":
                yield f"{noun}: {text}"

    def _format_tree(self, tree: Message) -> str:
        try:
            return format_formula(self._codec.decode_tree(tree, allows_changes=True))
        except Ros2Error as error:  # the rest of the output is of use without this formula
            return f"({error.message})"

    # --- the problem

    def _show_problem(self, _argument: str) -> OutputLines:
        yield self._request_problem("get_problem")["problem"].rstrip("\n")

    def _show_instances(self, _argument: str) -> OutputLines:
        for instance in self._request_problem("get_problem_instances")["instances"]:
            yield f"{instance['name']} - {instance['type']}"

    def _show_predicates(self, _argument: str) -> OutputLines:
        for node in self._request_problem("get_problem_predicates")["states"]:
            yield format_ground(parse_ground_node(node))

    def _show_functions(self, _argument: str) -> OutputLines:
        for node in self._request_problem("get_problem_functions")["states"]:
            yield f"(= {format_ground(parse_ground_node(node))} {format_number(node['value'])})"

    def _show_goal(self, _argument: str) -> OutputLines:
        tree = self._request_problem("get_problem_goal")["tree"]
        yield self._format_tree(tree) if tree["nodes"] else "no goal"

    def _set_instance(self, argument: str) -> None:
        words = argument.split()
        if len(words) != 2:  # noqa: PLR2004 - NAME and TYPE
            raise UsageError("an instance must have a name and a type", hint="set instance NAME TYPE")
        self._request_problem("add_problem_instance", {"param": make_param(words[0], words[1])})

    def _remove_instance(self, argument: str) -> None:
        name = _parse_single_name(argument, "remove instance NAME")
        self._request_problem("remove_problem_instance", {"param": make_param(name)})

    def _change_predicate(self, service: str, argument: str) -> None:
        formula = parse_formula(argument)
        if not isinstance(formula, Atom):
            raise UsageError(f"'{argument}' is not a predicate", hint="set predicate (said PEGGY HELLO)")
        self._request_problem(
            service,
            {"node": make_ground_node(TreeNodeKind.PREDICATE, make_ground(formula.predicate, formula), {})},
        )

    def _set_function(self, argument: str) -> None:
        ground, value = _parse_assignment(parse_formula(argument), argument)
        node = make_ground_node(TreeNodeKind.FUNCTION, ground, {}, value)
        self._request_problem("add_problem_function", {"node": node})

    def _remove_function(self, argument: str) -> None:
        formula = parse_formula(_add_parentheses(argument))
        # the argument is `distance a b`, which parses as a predicate, or `(= (distance a b) 3)`
        if isinstance(formula, Atom):
            ground = make_ground(formula.predicate, formula)
        else:
            ground, _ = _parse_assignment(formula, argument)
        node = make_ground_node(TreeNodeKind.FUNCTION, ground, {})
        self._request_problem("remove_problem_function", {"node": node})

    def _set_goal(self, argument: str) -> None:
        self._request_problem(
            "add_problem_goal", {"tree": self._codec.encode_formula(parse_formula(argument), {})}
        )

    def _remove_goal(self, _argument: str) -> None:
        self._request_problem("remove_problem_goal")

    # --- plans, performers, and commands about commands

    def _show_plan(self, _argument: str) -> OutputLines:
        for item in self._make_plan():
            yield f"{item['time']:.3f}: {item['action']} [{item['duration']:.3f}]"

    def _make_plan(self) -> Sequence[PlanItem]:
        request = {
            "domain": self._request_domain("")["domain"],
            "problem": self._request_problem("get_problem")["problem"],
        }
        plan = self._client.request("/planner/get_plan", request, PLANNING_TIMEOUT_S)["plan"]
        items: Sequence[PlanItem] = plan["items"]
        return items

    def _show_performers(self, _argument: str) -> OutputLines:
        states: dict[str, tuple[str, int]] = {}

        def handle_heartbeat(message: Message) -> None:
            heartbeat = PROTOCOL.decode_heartbeat(message)
            states[heartbeat.node] = (heartbeat.action, heartbeat.state)

        topic = self._client.namespace + PROTOCOL.heartbeat_topic
        unsubscribe = self._client.node.subscribe(
            topic, PROTOCOL.heartbeat_type, handle_heartbeat, right=Right.LOOK
        )
        self._client.wait(lambda: False, LISTENING_S)
        unsubscribe()
        for node, (action, state) in sorted(states.items()):
            yield f"{node} {action} {PerformerState(state).name if state in list(PerformerState) else state}"

    def _run_plan(self, argument: str) -> OutputLines:
        mode, _, operand = argument.partition(" ")
        operand = operand.strip()
        if not mode:
            items = self._make_plan()
        elif mode == "num_actions" and (action_count := parse_decimal(operand)) is not None:
            items = self._make_plan()[:action_count]
        elif mode == "action" and (item := parse_item(f"0: {_add_parentheses(operand)}")):
            items = [item]
        elif mode == "plan-file" and operand:
            items = read_plan(Path(operand))
        else:
            raise UsageError(f"unknown command 'run {argument}'", hint="; ".join(_find_help("run")))
        yield from execute_plan(self._client, items)

    def _run_file(self, argument: str) -> OutputLines:
        name, is_shown = argument, False
        if argument.endswith((" 0", " 1")):
            name, is_shown = argument[:-2].rstrip(), argument.endswith("1")
        if self._is_sourcing or not name:
            problem = (
                "a file of commands cannot read another file" if self._is_sourcing else "the file is missing"
            )
            raise UsageError(problem, hint="source FILE [0|1]; 1 shows the commands")
        try:
            lines = Path(name).read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise UsageError(f"cannot read {name}: {error}") from None
        self._is_sourcing = True
        try:
            for line in lines:
                if is_shown:
                    yield line
                yield from self.run_line(line)
                if self.is_over:
                    break
        finally:
            self._is_sourcing = False

    def _show_help(self, argument: str) -> list[str]:
        help_lines = _find_help(argument)
        if not help_lines:
            raise UsageError(f"unknown command '{argument}'")
        return help_lines

    def _quit(self, _argument: str) -> None:
        self.is_over = True


# Help with at least one line for each command.
HELP_LINES: Final = (
    "get domain                                    the domain, as PDDL",
    "get model types|predicates|functions|actions  the names in the domain",
    "get model predicate|function|action NAME      its declaration",
    "get problem                                   the problem, as PDDL",
    "get problem instances|predicates|functions|goal",
    "get plan                                      a plan for the goal",
    "set instance NAME TYPE",
    "set predicate (PREDICATE INSTANCE...)",
    "set function (= (FUNCTION INSTANCE...) NUMBER)",
    "set goal FORMULA                              e.g. (and (at r2 hall) (not (open door)))",
    "remove instance NAME",
    "remove predicate (PREDICATE INSTANCE...)",
    "remove function (FUNCTION INSTANCE...)",
    "remove goal",
    "check actors                                  the action performers",
    "run                                           a plan for the goal is executed by PlanSys2's executor",
    "run num_actions NUMBER                        only the first actions of the plan",
    "run action (ACTION INSTANCE...)               one action",
    "run plan-file FILE                            a plan in the format of 'get plan'",
    "source FILE [0|1]                             commands from a file; 1 shows them",
    "help [COMMAND]",
    "quit",
)

# Commands with nothing after their names.
_ARGUMENTLESS_COMMANDS: Final = frozenset(
    {
        *("get domain", "get plan", "remove goal", "check actors", "quit"),
        *(
            f"get {noun} {name}"
            for noun in ("model", "domain")
            for name in ("types", "predicates", "functions", "actions")
        ),
        *("get problem", "get problem instances", "get problem predicates", "get problem functions"),
        "get problem goal",
    }
)


def _find_help(command: str) -> list[str]:
    """Return the help of the commands that begin with a word; of all commands for an empty text."""
    return [text for text in HELP_LINES if not command or text.split()[0] == command]


def _parse_single_name(argument: str, usage: str) -> str:
    words = argument.split()
    if len(words) != 1:
        raise UsageError(f"there must be one name, not {len(words)}", hint=usage)
    return words[0]


def _add_parentheses(text: str) -> str:
    return text if text.startswith("(") else f"({text})"


def _parse_assignment(formula: Formula, text: str) -> tuple[Ground, float]:
    """Return the function and its value in a formula such as ``(= (distance a b) 3)``.

    :param text: the text of the formula, for the error.
    """
    match formula:
        case TermComparison(operator="=", left=FunctionTerm() as call, right=Constant(name=number)):
            value = number_of(number)
            if value is not None:
                return make_ground(call.function, call), value
    raise UsageError(
        f"'{text}' does not assign a number to a function", hint="set function (= (distance a b) 3)"
    )


def _format_signature(message: Message) -> str:
    parameters = (f"{parameter['name']} - {parameter['type']}" for parameter in message["parameters"])
    return f"({' '.join((message['name'], *parameters))})"
