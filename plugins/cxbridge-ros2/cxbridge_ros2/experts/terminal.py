"""The commands of plansys2_terminal about the domain, the problem and plans, for any experts.

:class:`Terminal` parses a line, requests services of cxbridge's or PlanSys2's experts, and yields the
output.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import Any, Final

from cxbridge.errors import Ros2Error
from cxbridge.executive.pddl import format_formula, parse_formula
from cxbridge.executive.pddl.ast import (
    Atom,
    Constant,
    Formula,
    FunctionTerm,
    Ground,
    TermComparison,
    make_ground,
    number_of,
)
from cxbridge.executive.pddl.printer import format_number
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.experts.client import ExpertClient
from cxbridge_ros2.experts.knowledge import format_ground
from cxbridge_ros2.experts.trees import (
    TreeCodec,
    TreeNodeKind,
    make_ground_node,
    make_param,
    parse_ground_node,
)
from cxbridge_ros2.messages import Message

PLANNING_TIMEOUT_S: Final = 120.0  # limit of planning in seconds, chosen freely

# Titles of the formulas in a plansys2_msgs/msg/DurativeAction, by field.
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


class Terminal:
    """Carries out commands.

    :param codec: the codec for the experts' distribution.
    :ivar is_over: whether the command `quit` was carried out.
    :ivar commands: the functions of the commands by name.
    """

    def __init__(self, client: ExpertClient, codec: TreeCodec) -> None:
        self._client = client
        self._codec = codec
        self.is_over = False
        self.commands: Mapping[str, CommandHandler] = {
            "get domain": lambda _argument: [self._request_domain("")["domain"].rstrip("\n")],
            "get model types": lambda _argument: self._request_domain("_types")["types"],
            "get model predicates": partial(self._show_names, "predicates"),
            "get model functions": partial(self._show_names, "functions"),
            "get model actions": self._show_actions,
            "get model predicate": partial(self._show_declaration, "predicate"),
            "get model function": partial(self._show_declaration, "function"),
            "get model action": self._show_action,
            "get problem": lambda _argument: [self._request_problem("get_problem")["problem"].rstrip("\n")],
            "get problem instances": self._show_instances,
            "get problem predicates": self._show_predicates,
            "get problem functions": self._show_functions,
            "get problem goal": self._show_goal,
            "get plan": self._show_plan,
            "set instance": self._set_instance,
            "set predicate": partial(self._change_ground, "add_problem_predicate", TreeNodeKind.PREDICATE),
            "set function": self._set_function,
            "set goal": self._set_goal,
            "remove instance": self._remove_instance,
            "remove predicate": partial(
                self._change_ground, "remove_problem_predicate", TreeNodeKind.PREDICATE
            ),
            "remove function": partial(self._change_ground, "remove_problem_function", TreeNodeKind.FUNCTION),
            "remove goal": self._remove_goal,
            "help": lambda _argument: HELP_LINES,
            "quit": self._quit,
        }

    def run_line(self, line: str) -> OutputLines:
        """Carry out a command and yield its output; nothing for an empty line.

        :raises Ros2Error: if the command is unknown, an argument is invalid, or the experts refuse or do not
            answer.
        :raises PddlError: if an argument is not a formula.
        """
        words = line.split()
        if not words:
            return
        # names of commands have up to 3 words; the longest first, since "get problem goal" begins with the
        # command "get problem"
        for count in (3, 2, 1):
            command = " ".join(words[:count])
            if count <= len(words) and command in self.commands:
                argument = " ".join(line.split(None, count)[count:]).strip()
                yield from self.commands[command](argument) or ()
                return
        first_words = dict.fromkeys(command.split()[0] for command in self.commands)
        similar_commands = [command for command in self.commands if command.split()[0] == words[0]]
        suggested_texts = similar_commands or [*first_words]
        raise Ros2Error(
            f"unknown command '{line.strip()}'",
            hint=did_you_mean(
                " ".join(words[:2]), suggested_texts, f"there are: {', '.join(suggested_texts)}"
            ),
        )

    def _request_domain(self, suffix: str, request: Mapping[str, Any] | None = None) -> Message:
        return self._client.request(f"/domain_expert/get_domain{suffix}", request)

    def _request_problem(self, service: str, request: Mapping[str, Any] | None = None) -> Message:
        return self._client.request(f"/problem_expert/{service}", request)

    # --- the domain

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
            titled_trees = [(title, action[field]) for field, title in _TIMED_FIELD_TITLES.items()]
        else:
            action = self._request_domain("_action_details", {"action": name})["action"]
            titled_trees = [("needs", action["preconditions"]), ("does", action["effects"])]
        yield _format_signature(action)
        for title, tree in titled_trees:
            # the experts send an empty tree or an empty conjunction for a missing formula
            if tree["nodes"] and (formula := self._format_tree(tree)) != "(and)":
                yield f"{title}: {formula}"

    def _format_tree(self, tree: Message) -> str:
        try:
            return format_formula(self._codec.decode_tree(tree, allows_changes=True))
        except Ros2Error as error:  # the rest of the output is of use without this formula
            return f"({error.message})"

    # --- the problem

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
            raise Ros2Error("an instance must have a name and a type", hint="set instance NAME TYPE")
        name, type_name = words
        self._request_problem("add_problem_instance", {"param": make_param(name, type_name)})

    def _remove_instance(self, argument: str) -> None:
        name = _parse_single_name(argument, "remove instance NAME")
        self._request_problem("remove_problem_instance", {"param": make_param(name)})

    def _change_ground(self, service: str, kind: TreeNodeKind, argument: str) -> None:
        formula = parse_formula(argument)
        # a function without a value parses as a predicate
        if not isinstance(formula, Atom):
            raise Ros2Error(f"'{argument}' is not a {kind.name.lower()}", hint="write (NAME INSTANCE...)")
        node = make_ground_node(kind, make_ground(formula.predicate, formula), {})
        self._request_problem(service, {"node": node})

    def _set_function(self, argument: str) -> None:
        ground, value = _parse_assignment(parse_formula(argument), argument)
        node = make_ground_node(TreeNodeKind.FUNCTION, ground, {}, value)
        self._request_problem("add_problem_function", {"node": node})

    def _set_goal(self, argument: str) -> None:
        self._request_problem(
            "add_problem_goal", {"tree": self._codec.encode_formula(parse_formula(argument), {})}
        )

    def _remove_goal(self, _argument: str) -> None:
        self._request_problem("remove_problem_goal")

    # --- plans, and commands about commands

    def _show_plan(self, _argument: str) -> OutputLines:
        request = {
            "domain": self._request_domain("")["domain"],
            "problem": self._request_problem("get_problem")["problem"],
        }
        plan = self._client.request("/planner/get_plan", request, PLANNING_TIMEOUT_S)["plan"]
        for item in plan["items"]:
            yield f"{item['time']:.3f}: {item['action']} [{item['duration']:.3f}]"

    def _quit(self, _argument: str) -> None:
        self.is_over = True


# Each command is in one of the lines.
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
    "help",
    "quit",
)


def _parse_single_name(argument: str, usage: str) -> str:
    words = argument.split()
    if len(words) != 1:
        raise Ros2Error(f"there must be one name, not {len(words)}", hint=usage)
    return words[0]


def _parse_assignment(formula: Formula, text: str) -> tuple[Ground, float]:
    """Return the function and its value in a formula such as ``(= (distance a b) 3)``.

    :param text: the text of the formula, for the error.
    :raises Ros2Error: if the formula has another form.
    """
    match formula:
        case TermComparison(operator="=", left=FunctionTerm() as call, right=Constant(name=number)) if (
            value := number_of(number)
        ) is not None:
            return make_ground(call.function, call), value
    raise Ros2Error(
        f"'{text}' does not assign a number to a function", hint="set function (= (distance a b) 3)"
    )


def _format_signature(message: Message) -> str:
    parameters = (f"{parameter['name']} - {parameter['type']}" for parameter in message["parameters"])
    return f"({' '.join((message['name'], *parameters))})"
