"""The commands of plansys2_terminal, for the experts of cxbridge and of PlanSys2."""

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
from cxbridge.rights import Right
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.experts.client import ExpertClient
from cxbridge_ros2.experts.execution import Item, execute, item_of, read_plan
from cxbridge_ros2.experts.knowledge import ground_of, ground_text
from cxbridge_ros2.experts.nodes import NodeCodec, TreeNodeKind, ground_in, ground_node, param
from cxbridge_ros2.hub.protocol import PerformerState
from cxbridge_ros2.messages import Message
from cxbridge_ros2.plansys2 import PROTOCOL

PLANNING_S: Final = 120.0  # limit of planning in seconds

LISTENING_S: Final = 2.0  # seconds to listen for heartbeats of performers

_TIME_POINTS: Final = {
    "at_start_requirements": "at start needs",
    "over_all_requirements": "over all needs",
    "at_end_requirements": "at end needs",
    "at_start_effects": "at start does",
    "at_end_effects": "at end does",
}

Lines = Iterator[str]

# Carries out a command with the rest of its line, and returns its output; None for no output.
Work = Callable[[str], Iterable[str] | None]


class UsageError(Ros2Error):
    """An invalid command."""


class Terminal:
    """Carries out commands.

    :param codec: the codec for the experts' distribution.
    """

    def __init__(self, client: ExpertClient, codec: NodeCodec) -> None:
        self._client = client
        self._codec = codec
        self.is_over = False  # whether the user has typed `quit`
        self._is_sourcing = False
        model: Mapping[str, Work] = {
            "types": self._types,
            "predicates": partial(self._declared_names, "predicates"),
            "functions": partial(self._declared_names, "functions"),
            "actions": self._actions,
            "predicate": partial(self._declaration, "predicate"),
            "function": partial(self._declaration, "function"),
            "action": self._action,
        }
        self.commands: Mapping[str, Work] = {
            "get domain": self._domain,
            # the terminals of different distributions say `model` or `domain`
            **{f"get {noun} {name}": model[name] for noun in ("model", "domain") for name in model},
            "get problem": self._problem,
            "get problem instances": self._instances,
            "get problem predicates": self._predicates,
            "get problem functions": self._functions,
            "get problem goal": self._goal,
            "get plan": self._plan,
            "set instance": self._set_instance,
            "set predicate": partial(self._change_predicate, "add_problem_predicate"),
            "set function": self._set_function,
            "set goal": self._set_goal,
            "remove instance": self._remove_instance,
            "remove predicate": partial(self._change_predicate, "remove_problem_predicate"),
            "remove function": self._remove_function,
            "remove goal": self._remove_goal,
            "check actors": self._performers,
            "run": self._run,
            "source": self._source,
            "help": self._help,
            "?": self._help,
            "quit": self._quit,
        }

    def do(self, line: str) -> Lines:
        """Carry out a command and yield its output."""
        words = line.split()
        if not words:
            return
        # try the longest command name first: "get problem goal" before "get problem"
        for count in (3, 2, 1):
            command = " ".join(words[:count])
            if count <= len(words) and command in self.commands:
                argument = " ".join(line.split(None, count)[count:]).strip()
                if argument and command in _WITHOUT_ARGUMENT:
                    raise UsageError(f"'{command}' takes nothing more, not '{argument}'")
                try:
                    yield from self.commands[command](argument) or ()
                except PddlError as error:
                    raise UsageError(error.message, hint=error.hint) from None
                return
        first_words = dict.fromkeys(command.split()[0] for command in self.commands)
        similar = [command for command in self.commands if command.split()[0] == words[0]] or [*first_words]
        raise UsageError(
            f"there is no command '{line.strip()}'",
            hint=did_you_mean(" ".join(words[:2]), similar, f"there are: {', '.join(similar)}"),
        )

    def completions(self, line: str) -> list[str]:
        """Return the possible next words.

        :param line: the typed text; its last word may be incomplete.
        """
        *typed_setting, incomplete = line.split(" ")
        complete = [word for word in typed_setting if word]
        commands = (command.split() for command in self.commands)
        words = {
            command[len(complete)]
            for command in commands
            if command[: len(complete)] == complete and len(command) > len(complete)
        }
        return sorted(word for word in words if word.startswith(incomplete))

    def _ask_domain(self, service: str, request: Mapping[str, Any] | None = None) -> Message:
        return self._client.request(f"/domain_expert/get_domain{service}", request)

    def _ask_problem(self, service: str, request: Mapping[str, Any] | None = None) -> Message:
        return self._client.request(f"/problem_expert/{service}", request)

    # --- the domain

    def _domain(self, _argument: str) -> Lines:
        yield self._ask_domain("")["domain"].rstrip("\n")

    def _types(self, _argument: str) -> Lines:
        yield from self._ask_domain("_types")["types"]

    def _declared_names(self, noun: str, _argument: str) -> Lines:
        yield from (node["name"] for node in self._ask_domain(f"_{noun}")["states"])

    def _actions(self, _argument: str) -> Lines:
        yield from self._ask_domain("_actions")["actions"]
        for name in self._ask_domain("_durative_actions")["actions"]:
            yield f"{name} (durative)"

    def _declaration(self, noun: str, argument: str) -> Lines:
        name = _single_name(argument, f"get model {noun} NAME")
        yield _signature(self._ask_domain(f"_{noun}_details", {"expression": name})["node"])

    def _action(self, argument: str) -> Lines:
        name = _single_name(argument, "get model action NAME")
        durative = self._ask_domain("_durative_actions")["actions"]
        if name.lower() in map(str.lower, durative):
            request = {"durative_action": name}
            action = self._ask_domain("_durative_action_details", request)["durative_action"]
            formulas = [(text, action[field]) for field, text in _TIME_POINTS.items()]
        else:
            action = self._ask_domain("_action_details", {"action": name})["action"]
            formulas = [("needs", action["preconditions"]), ("does", action["effects"])]
        yield _signature(action)
        for noun, tree in formulas:
            if tree["nodes"] and (text := self._formula_text(tree)) != "(and)":
                yield f"{noun}: {text}"

    def _formula_text(self, tree: Message) -> str:
        try:
            return format_formula(self._codec.formula(tree, effects=True))
        except Ros2Error as error:
            return f"({error.message})"

    # --- the problem

    def _problem(self, _argument: str) -> Lines:
        yield self._ask_problem("get_problem")["problem"].rstrip("\n")

    def _instances(self, _argument: str) -> Lines:
        for instance in self._ask_problem("get_problem_instances")["instances"]:
            yield f"{instance['name']} - {instance['type']}"

    def _predicates(self, _argument: str) -> Lines:
        for node in self._ask_problem("get_problem_predicates")["states"]:
            yield ground_text(ground_in(node))

    def _functions(self, _argument: str) -> Lines:
        for node in self._ask_problem("get_problem_functions")["states"]:
            yield f"(= {ground_text(ground_in(node))} {format_number(node['value'])})"

    def _goal(self, _argument: str) -> Lines:
        tree = self._ask_problem("get_problem_goal")["tree"]
        yield self._formula_text(tree) if tree["nodes"] else "no goal"

    def _set_instance(self, argument: str) -> None:
        words = argument.split()
        if len(words) != 2:  # noqa: PLR2004 - NAME and TYPE
            raise UsageError("an instance has a name and a type", hint="set instance NAME TYPE")
        self._ask_problem("add_problem_instance", {"param": param(words[0], words[1])})

    def _remove_instance(self, argument: str) -> None:
        name = _single_name(argument, "remove instance NAME")
        self._ask_problem("remove_problem_instance", {"param": param(name)})

    def _change_predicate(self, service: str, argument: str) -> None:
        formula = parse_formula(argument)
        if not isinstance(formula, Atom):
            raise UsageError(f"'{argument}' is no predicate", hint="set predicate (said PEGGY HELLO)")
        self._ask_problem(
            service, {"node": ground_node(TreeNodeKind.PREDICATE, ground_of(formula.predicate, formula), {})}
        )

    def _set_function(self, argument: str) -> None:
        ground, value = _assignment(parse_formula(argument), argument)
        node = ground_node(TreeNodeKind.FUNCTION, ground, {}, value)
        self._ask_problem("add_problem_function", {"node": node})

    def _remove_function(self, argument: str) -> None:
        formula = parse_formula(_in_parentheses(argument))
        # both `distance a b` and `(= (distance a b) 3)`; the former parses as a predicate
        if isinstance(formula, Atom):
            ground = ground_of(formula.predicate, formula)
        else:
            ground, _ = _assignment(formula, argument)
        node = ground_node(TreeNodeKind.FUNCTION, ground, {})
        self._ask_problem("remove_problem_function", {"node": node})

    def _set_goal(self, argument: str) -> None:
        self._ask_problem("add_problem_goal", {"tree": self._codec.tree(parse_formula(argument), {})})

    def _remove_goal(self, _argument: str) -> None:
        self._ask_problem("remove_problem_goal")

    # --- plans, performers, and the prompt itself

    def _plan(self, _argument: str) -> Lines:
        for item in self._make_plan():
            yield f"{item['time']:.3f}: {item['action']} [{item['duration']:.3f}]"

    def _make_plan(self) -> Sequence[Item]:
        request = {
            "domain": self._ask_domain("")["domain"],
            "problem": self._ask_problem("get_problem")["problem"],
        }
        plan = self._client.request("/planner/get_plan", request, PLANNING_S)["plan"]
        items: Sequence[Item] = plan["items"]
        return items

    def _performers(self, _argument: str) -> Lines:
        states: dict[str, tuple[str, int]] = {}

        def take_heartbeat(message: Message) -> None:
            heartbeat = PROTOCOL.decode_heartbeat(message)
            states[heartbeat.node] = (heartbeat.action, heartbeat.state)

        topic = self._client.namespace + PROTOCOL.heartbeat_topic
        end = self._client.node.subscribe(topic, PROTOCOL.heartbeat_type, take_heartbeat, right=Right.LOOK)
        self._client.wait(lambda: False, LISTENING_S)
        end()
        for node, (action, state) in sorted(states.items()):
            yield f"{node} {action} {PerformerState(state).name if state in list(PerformerState) else state}"

    def _run(self, argument: str) -> Lines:
        kind, _, operand = argument.partition(" ")
        operand = operand.strip()
        if not kind:
            items = self._make_plan()
        elif kind == "num_actions" and operand.isdecimal():
            items = self._make_plan()[: int(operand)]
        elif kind == "action" and (item := item_of(f"0: {_in_parentheses(operand)}")):
            items = [item]
        elif kind == "plan-file" and operand:
            items = read_plan(Path(operand))
        else:
            raise UsageError(f"there is no 'run {argument}'", hint="; ".join(_help_of("run")))
        yield from execute(self._client, items)

    def _source(self, argument: str) -> Lines:
        name, is_shown = argument, False
        if argument.endswith((" 0", " 1")):
            name, is_shown = argument[:-2].rstrip(), argument.endswith("1")
        if self._is_sourcing or not name:
            problem = "a file of commands names no other" if self._is_sourcing else "it takes a file"
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
                yield from self.do(line)
                if self.is_over:
                    break
        finally:
            self._is_sourcing = False

    def _help(self, argument: str) -> list[str]:
        help_lines = _help_of(argument)
        if not help_lines:
            raise UsageError(f"there is no command '{argument}'")
        return help_lines

    def _quit(self, _argument: str) -> None:
        self.is_over = True


# Help, with at least one line per command.
HELP: Final = (
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

_WITHOUT_ARGUMENT: Final = frozenset(
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


def _help_of(command: str) -> list[str]:
    """Return the help of commands that begin with a word; all if the word is empty."""
    return [text for text in HELP if not command or text.split()[0] == command]


def _single_name(argument: str, usage: str) -> str:
    words = argument.split()
    if len(words) != 1:
        raise UsageError(f"one name is wanted, not {len(words)}", hint=usage)
    return words[0]


def _in_parentheses(text: str) -> str:
    return text if text.startswith("(") else f"({text})"


def _assignment(formula: Formula, text: str) -> tuple[Ground, float]:
    """Return the function and the number of ``(= (distance a b) 3)``."""
    match formula:
        case TermComparison(operator="=", left=FunctionTerm() as call, right=Constant(name=number)):
            value = number_of(number)
            if value is not None:
                return ground_of(call.function, call), value
    raise UsageError(f"'{text}' is no value of a function", hint="set function (= (distance a b) 3)")


def _signature(message: Message) -> str:
    parameters = (f"{parameter['name']} - {parameter['type']}" for parameter in message["parameters"])
    return f"({' '.join((message['name'], *parameters))})"
