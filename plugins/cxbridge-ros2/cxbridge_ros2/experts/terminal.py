"""The commands of plansys2_terminal, for any experts: those of cxbridge and of PlanSys2."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from cxbridge.errors import PddlError, Ros2Error
from cxbridge.executive.pddl import format_formula, parse_formula
from cxbridge.executive.pddl.ast import Atom, Constant, Formula, FunctionTerm, TermComparison, number_of
from cxbridge.executive.pddl.printer import format_number
from cxbridge.rights import Right
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.experts.answers import shown
from cxbridge_ros2.experts.client import ExpertClient
from cxbridge_ros2.experts.execution import Item, execute, item_of, read_plan
from cxbridge_ros2.experts.knowledge import ground_of
from cxbridge_ros2.experts.nodes import NodeCodec, TreeNodeKind, ground_in, ground_node, param
from cxbridge_ros2.hub.words import Life
from cxbridge_ros2.messages import Message
from cxbridge_ros2.plansys2 import PROTOCOL

PLANNING_S: Final = 120.0  # limit of planning in seconds

LISTENING_S: Final = 2.0  # seconds to listen for heartbeats of performers

_PROBLEM: Final = "/problem_expert/"
_DOMAIN: Final = "/domain_expert/"
_OF_DURATIVE: Final = {
    "at_start_requirements": "at start needs",
    "over_all_requirements": "over all needs",
    "at_end_requirements": "at end needs",
    "at_start_effects": "at start does",
    "at_end_effects": "at end does",
}

_NOTHING: Final = "(and)"

Lines = Iterator[str]


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
        self._sourcing = False
        self._commands: Mapping[str, Callable[[str], Lines]] = {
            "get domain": self._domain,
            **{
                f"get {model} {noun}": work
                for model in ("model", "domain")
                for noun, work in self._of_model().items()
            },
            "get problem": lambda rest: self._whole("get problem", rest, _PROBLEM, "problem"),
            "get problem instances": self._instances,
            "get problem predicates": self._predicates,
            "get problem functions": self._functions,
            "get problem goal": self._goal,
            "get plan": self._plan,
            "set instance": self._set_instance,
            "set predicate": lambda rest: self._predicate("add_problem_predicate", rest),
            "set function": self._set_function,
            "set goal": self._set_goal,
            "remove instance": self._remove_instance,
            "remove predicate": lambda rest: self._predicate("remove_problem_predicate", rest),
            "remove function": self._remove_function,
            "remove goal": self._remove_goal,
            "check actors": self._actors,
            "run": self._run,
            "source": self._source,
            "help": self._help,
            "?": self._help,
            "quit": self._quit,
        }

    @property
    def commands(self) -> Sequence[str]:
        """The commands without arguments."""
        return [*self._commands]

    def do(self, line: str) -> Lines:
        """Carry out a command and yield its output."""
        words = line.split()
        if not words:
            return
        # Try the longest command name first: "get problem goal" before "get problem".
        for count in (3, 2, 1):
            work = self._commands.get(" ".join(words[:count]))
            if work is not None and count <= len(words):
                try:
                    yield from work(line.split(None, count)[count] if len(words) > count else "")
                except PddlError as error:
                    raise UsageError(error.message, hint=error.hint) from None
                return
        first = dict.fromkeys(each.split()[0] for each in self._commands)
        known = [each for each in self._commands if each.split()[0] == words[0]] or [*first]
        hint = did_you_mean(" ".join(words[:2]), known, f"there are: {', '.join(known)}")
        raise UsageError(f"there is no command '{line.strip()}'", hint=hint)

    def completions(self, line: str) -> list[str]:
        """Return the possible next words.

        :param line: the typed text; its last word may be incomplete.
        """
        *before, last = line.split(" ")
        typed_words = [word for word in before if word]
        commands = [each.split() for each in self._commands]
        words = [
            each[len(typed_words)]
            for each in commands
            if each[: len(typed_words)] == typed_words and len(each) > len(typed_words)
        ]
        return sorted({word for word in words if word.startswith(last)})

    # ---- the domain

    def _whole(self, command: str, rest: str, prefix: str, field: str) -> Lines:
        _no_more(command, rest)
        yield self._client.do(f"{prefix}get_{field}")[field].rstrip("\n")

    def _domain(self, rest: str) -> Lines:
        return self._whole("get domain", rest, _DOMAIN, "domain")

    def _of_model(self) -> Mapping[str, Callable[[str], Lines]]:
        return {
            "types": self._types,
            "predicates": lambda rest: self._names("predicates", rest),
            "functions": lambda rest: self._names("functions", rest),
            "actions": self._actions,
            "predicate": lambda rest: self._declared("predicate", rest),
            "function": lambda rest: self._declared("function", rest),
            "action": self._action,
        }

    def _types(self, rest: str) -> Lines:
        _no_more("get model types", rest)
        yield from self._client.do(f"{_DOMAIN}get_domain_types")["types"]

    def _names(self, noun: str, rest: str) -> Lines:
        _no_more(f"get model {noun}", rest)
        yield from (each["name"] for each in self._client.do(f"{_DOMAIN}get_domain_{noun}")["states"])

    def _actions(self, rest: str) -> Lines:
        _no_more("get model actions", rest)
        yield from self._client.do(f"{_DOMAIN}get_domain_actions")["actions"]
        for name in self._client.do(f"{_DOMAIN}get_domain_durative_actions")["actions"]:
            yield f"{name} (durative)"

    def _declared(self, noun: str, rest: str) -> Lines:
        name = _one(rest, f"get model {noun} NAME")
        node = self._client.do(f"{_DOMAIN}get_domain_{noun}_details", {"expression": name})["node"]
        yield _signature(node)

    def _action(self, rest: str) -> Lines:
        name = _one(rest, "get model action NAME")
        durative = self._client.do(f"{_DOMAIN}get_domain_durative_actions")["actions"]
        if name.lower() in map(str.lower, durative):
            request = {"durative_action": name}
            action = self._client.do(f"{_DOMAIN}get_domain_durative_action_details", request)[
                "durative_action"
            ]
            yield _signature(action)
            for field, text in _OF_DURATIVE.items():
                yield from self._about(text, action[field])
            return
        action = self._client.do(f"{_DOMAIN}get_domain_action_details", {"action": name})["action"]
        yield _signature(action)
        yield from self._about("needs", action["preconditions"])
        yield from self._about("does", action["effects"])

    def _about(self, noun: str, tree: Message) -> Lines:
        text = self._text(tree) if tree["nodes"] else _NOTHING
        if text != _NOTHING:
            yield f"{noun}: {text}"

    def _text(self, tree: Message) -> str:
        try:
            return format_formula(self._codec.formula(tree, effects=True))
        except Ros2Error as error:
            return f"({error.message})"

    # ---- the problem

    def _instances(self, rest: str) -> Lines:
        _no_more("get problem instances", rest)
        for each in self._client.do(f"{_PROBLEM}get_problem_instances")["instances"]:
            yield f"{each['name']} - {each['type']}"

    def _predicates(self, rest: str) -> Lines:
        _no_more("get problem predicates", rest)
        for each in self._client.do(f"{_PROBLEM}get_problem_predicates")["states"]:
            yield shown(ground_in(each))

    def _functions(self, rest: str) -> Lines:
        _no_more("get problem functions", rest)
        for each in self._client.do(f"{_PROBLEM}get_problem_functions")["states"]:
            yield f"(= {shown(ground_in(each))} {format_number(each['value'])})"

    def _goal(self, rest: str) -> Lines:
        _no_more("get problem goal", rest)
        tree = self._client.do(f"{_PROBLEM}get_problem_goal")["tree"]
        yield self._text(tree) if tree["nodes"] else "no goal"

    def _set_instance(self, rest: str) -> Lines:
        words = rest.split()
        if len(words) != 2:  # noqa: PLR2004
            raise UsageError("an instance has a name and a type", hint="set instance NAME TYPE")
        self._client.do(f"{_PROBLEM}add_problem_instance", {"param": param(words[0], words[1])})
        yield from ()

    def _remove_instance(self, rest: str) -> Lines:
        name = _one(rest, "remove instance NAME")
        self._client.do(f"{_PROBLEM}remove_problem_instance", {"param": param(name)})
        yield from ()

    def _predicate(self, service: str, rest: str) -> Lines:
        formula = parse_formula(rest)
        if not isinstance(formula, Atom):
            raise UsageError(f"'{rest}' is no predicate", hint="set predicate (said PEGGY HELLO)")
        node = ground_node(TreeNodeKind.PREDICATE, ground_of(formula.predicate, formula), {})
        self._client.do(_PROBLEM + service, {"node": node})
        yield from ()

    def _set_function(self, rest: str) -> Lines:
        call, value = _value_in(parse_formula(rest), rest)
        node = ground_node(TreeNodeKind.FUNCTION, ground_of(call.function, call), {}, value)
        self._client.do(f"{_PROBLEM}add_problem_function", {"node": node})
        yield from ()

    def _remove_function(self, rest: str) -> Lines:
        formula = parse_formula(rest if rest.lstrip().startswith("(") else f"({rest})")
        if isinstance(formula, Atom):
            ground = ground_of(formula.predicate, formula)
        else:
            call, _ = _value_in(formula, rest)
            ground = ground_of(call.function, call)
        self._client.do(
            f"{_PROBLEM}remove_problem_function", {"node": ground_node(TreeNodeKind.FUNCTION, ground, {})}
        )
        yield from ()

    def _set_goal(self, rest: str) -> Lines:
        tree = self._codec.tree(parse_formula(rest), {})
        self._client.do(f"{_PROBLEM}add_problem_goal", {"tree": tree})
        yield from ()

    def _remove_goal(self, rest: str) -> Lines:
        _no_more("remove goal", rest)
        self._client.do(f"{_PROBLEM}remove_problem_goal")
        yield from ()

    # ---- plans, performers, and the prompt itself

    def _plan(self, rest: str) -> Lines:
        _no_more("get plan", rest)
        for each in self._planned():
            yield f"{each['time']:.3f}: {each['action']} [{each['duration']:.3f}]"

    def _planned(self) -> Sequence[Item]:
        request = {
            "domain": self._client.do(f"{_DOMAIN}get_domain")["domain"],
            "problem": self._client.do(f"{_PROBLEM}get_problem")["problem"],
        }
        items: Sequence[Item] = self._client.do("/planner/get_plan", request, PLANNING_S)["plan"]["items"]
        return items

    def _actors(self, rest: str) -> Lines:
        _no_more("check actors", rest)
        signs: dict[str, tuple[str, int]] = {}

        def take_sign(message: Message) -> None:
            sign = PROTOCOL.sign(message)
            signs[sign.node] = (sign.action, sign.life)

        topic = self._client.namespace + PROTOCOL.signs_topic
        end = self._client.node.subscribe(topic, PROTOCOL.signs_type, take_sign, needs=Right.LOOK)
        self._client.wait(lambda: False, LISTENING_S)
        end()
        for node, (action, life) in sorted(signs.items()):
            yield f"{node} {action} {Life(life).name if life in list(Life) else life}"

    def _run(self, rest: str) -> Lines:
        kind, _, argument = rest.strip().partition(" ")
        argument = argument.strip()
        if not kind:
            items = self._planned()
        elif kind == "num_actions" and argument.isdecimal():
            items = self._planned()[: int(argument)]
        elif kind == "action" and (
            item := item_of(f"0: {argument if argument.startswith('(') else f'({argument})'}")
        ):
            items = [item]
        elif kind == "plan-file" and argument:
            items = read_plan(Path(argument))
        else:
            raise UsageError(f"there is no 'run {rest.strip()}'", hint="; ".join(_help_of("run")))
        yield from execute(self._client, items)

    def _source(self, rest: str) -> Lines:
        name, shown = rest.strip(), False
        if name.endswith((" 0", " 1")):
            name, shown = name[:-2].rstrip(), name.endswith("1")
        if self._sourcing or not name:
            nested = "a file of commands names no other" if self._sourcing else "it takes a file"
            raise UsageError(nested, hint="source FILE [0|1]; 1 shows the commands")
        try:
            lines = Path(name).read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise UsageError(f"cannot read {name}: {error}") from None
        self._sourcing = True
        try:
            for line in lines:
                if shown:
                    yield line
                yield from self.do(line)
                if self.is_over:
                    break
        finally:
            self._sourcing = False

    def _help(self, rest: str) -> Lines:
        help_lines = _help_of(rest.strip())
        if not help_lines:
            raise UsageError(f"there is no command '{rest.strip()}'")
        yield from help_lines

    def _quit(self, rest: str) -> Lines:
        _no_more("quit", rest)
        self.is_over = True
        yield from ()


# Help, with at least one line per command.
HELP: Final = (
    "get domain                                    the domain, as PDDL",
    "get model types|predicates|functions|actions  the names in the domain",
    "get model predicate|function|action NAME      one of them",
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
    "run num_actions NUMBER                        its first actions only",
    "run action (ACTION INSTANCE...)               one action",
    "run plan-file FILE                            what 'get plan' has printed",
    "source FILE [0|1]                             commands from a file; 1 shows them",
    "help [COMMAND]",
    "quit",
)


def _help_of(command: str) -> list[str]:
    """Return the help of commands that begin with a word; all if the word is empty."""
    return [text for text in HELP if not command or text.split()[0] == command]


def _no_more(command: str, rest: str) -> None:
    if rest.strip():
        raise UsageError(f"'{command}' takes nothing more, not '{rest.strip()}'")


def _one(rest: str, usage: str) -> str:
    words = rest.split()
    if len(words) != 1:
        raise UsageError(f"one name is wanted, not {len(words)}", hint=usage)
    return words[0]


def _value_in(formula: Formula, text: str) -> tuple[FunctionTerm, float]:
    match formula:
        case TermComparison(operator="=", left=FunctionTerm() as call, right=Constant(name=number)):
            value = number_of(number)
            if value is not None:
                return call, value
    raise UsageError(f"'{text}' is no value of a function", hint="set function (= (distance a b) 3)")


def _signature(message: Message) -> str:
    parameters = (f"{each['name']} - {each['type']}" for each in message["parameters"])
    return f"({' '.join((message['name'], *parameters))})"
