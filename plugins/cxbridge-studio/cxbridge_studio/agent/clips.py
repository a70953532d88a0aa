"""Reads the names in CLIPS files: those that constructs define, match, assert, change and call.

CLIPS' syntax is regular: the head of a list, its first word, shows which words in the list are names. The
tables below list the functions and slots of CLIPS, the CX core and its features that have names as arguments
or values.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, literal, read_nodes, without_module
from cxbridge_studio.agent.condition import CE, GroupCE, TestCE, parse_elements, split_rule
from cxbridge_studio.agent.names import Mention, Name, NameKind, Piece, PlacedPiece, SourceFile, Use
from cxbridge_studio.agent.top_level import TopLevelList, split_top_level_lists

# The heads of conditional elements that contain patterns.
CONDITION_HEADS: Final = frozenset({"and", "or", "not", "exists", "forall", "logical"})

# Functions that query facts. Their first argument is `((?fact TEMPLATE) ...)`.
QUERY_FUNCTIONS: Final = frozenset(
    {"do-for-fact", "do-for-all-facts", "delayed-do-for-all-facts", "find-fact", "find-all-facts"}
    | {"any-factp"}
)

# Constructs and functions of CLIPS' object system. Their names are not read: no agent of Fawkes has classes.
_OBJECT_CONSTRUCTS: Final = frozenset({"defclass", "definstances", "defmessage-handler"})
_OBJECT_FUNCTIONS: Final = re.compile(r".*-instances?p?")

# Words that begin a list but are not functions: the branches of a switch.
_SWITCH_BRANCHES: Final = frozenset({"case", "default"})
# Words that begin the definition of a slot, and whether it is a multislot: `field` and `multifield` are old.
SLOT_KEYWORDS: Final = {"slot": False, "field": False, "multislot": True, "multifield": True}
# Functions that change a fact; the loader rewrites `modify` in the built-in core to `cx-modify-goal`.
CHANGE_FUNCTIONS: Final = frozenset({"modify", "duplicate", "cx-modify-goal"})
_LOOP_FUNCTIONS: Final = frozenset({"foreach", "progn$", "loop-for-count"})

# The kinds of the names that constructs define. `defglobal` is missing, because it defines several names.
CONSTRUCT_KINDS: Final[Mapping[str, NameKind]] = {
    "defrule": NameKind.RULE,
    "deftemplate": NameKind.TEMPLATE,
    "deffacts": NameKind.FACTS,
    "deffunction": NameKind.FUNCTION,
    "defgeneric": NameKind.FUNCTION,
    "defmethod": NameKind.FUNCTION,
    "defmodule": NameKind.MODULE,
}

# Slots of the core's templates that have names as values.
SLOT_VALUE_KINDS: Final[Mapping[tuple[str, str], NameKind]] = {
    ("goal", "class"): NameKind.GOAL_CLASS,
    ("plan-action", "action-name"): NameKind.ACTION,
    ("domain-operator", "name"): NameKind.ACTION,
    ("domain-operator-parameter", "operator-name"): NameKind.ACTION,
    ("grounded-pddl-formula", "name"): NameKind.ACTION,
    ("domain-fact", "name"): NameKind.PREDICATE,
    ("domain-predicate", "name"): NameKind.PREDICATE,
    ("domain-object", "type"): NameKind.OBJECT_TYPE,
    ("domain-object-type", "name"): NameKind.OBJECT_TYPE,
    ("executive-init-request", "name"): NameKind.FEATURE,
}

# Functions that have a name as their first argument.
FIRST_ARGUMENT_KINDS: Final[Mapping[str, NameKind]] = {
    **dict.fromkeys(
        ("path-load", "path-load*", "load", "load*", "path-batch", "path-batch*", "batch", "batch*"),
        NameKind.FILE,
    ),
    **dict.fromkeys(("path-resolve", "parse-pddl-domain"), NameKind.FILE),
    **dict.fromkeys(
        ("blackboard-preload", "blackboard-open", "blackboard-open-reading", "blackboard-open-writing"),
        NameKind.INTERFACE,
    ),
    "blackboard-create-msg": NameKind.INTERFACE,
    "ff-feature-request": NameKind.FEATURE,
    "plan-assert-action": NameKind.ACTION,
}


def read_clips(path: str, text: str, previous_file: SourceFile | None = None) -> SourceFile:
    """Read a CLIPS file.

    :param previous_file: the previous version of the file; the pieces of unchanged constructs are reused.
    """
    previous_pieces = {piece.text: piece for _, piece in previous_file.pieces} if previous_file else {}
    return SourceFile(
        path,
        text,
        tuple(
            PlacedPiece(top_list.start, _read_piece(top_list, previous_pieces.get(top_list.text)))
            for top_list in split_top_level_lists(text)
        ),
    )


def _read_piece(top_list: TopLevelList, previous_piece: Piece | None) -> Piece:
    """Return the piece of a top-level list.

    :param previous_piece: the piece with the same text in the previous version of the file; None if there is
        none.
    """
    # The same text may be a whole list in one version, and cut off by a new construct in the other version.
    if previous_piece is not None and previous_piece.is_closed is top_list.is_closed:
        return previous_piece
    node = read_nodes(top_list.text, close=True)[0]
    reader = _ConstructReader()
    try:
        reader.read_top_level(node)
    except RecursionError:  # CLIPS rejects text that is nested so deeply
        reader.mentions.clear()
    mentions = tuple(sorted(reader.mentions, key=lambda mention: mention.start))
    kind = CONSTRUCT_KINDS.get(node.head)
    defined_names = (
        mention.name for mention in mentions if mention.use is Use.DEFINED and mention.name.kind is kind
    )
    return Piece(node.head, next(defined_names, None), top_list.text, mentions, is_closed=top_list.is_closed)


def _is_variable(node: SyntaxNode) -> bool:
    return node.items is None and node.text.startswith(("?", "$?"))


def _find_rebound_variables(construct: SyntaxNode) -> Iterator[str]:
    """Yield the variables that a construct binds to a value other than a fact that it asserts or modifies."""
    for node in construct.walk():
        if node.head == "bind" and len(node.arguments) > 1 and node.arguments[1].head != "assert":
            variable, value = node.arguments[:2]
            # A changed fact has the same template: (bind ?f (modify ?f ...)).
            keeps_template = (
                value.head in CHANGE_FUNCTIONS
                and value.arguments
                and value.arguments[0].text == variable.text
            )
            if not keeps_template:
                yield variable.text
        elif node.head in _LOOP_FUNCTIONS and node.arguments:
            binding = node.arguments[0]  # ?x, or (?x VALUES)
            yield binding.items[0].text if binding.items else binding.text


class _ConstructReader:
    """Reads one construct, or one command of a batch file.

    :ivar mentions: the names in the construct so far.
    """

    def __init__(self) -> None:
        self.mentions: list[Mention] = []
        # The template of the fact that each variable holds; empty if it is ambiguous.
        self._templates_by_variable: dict[str, str] = {}
        # The variables that the construct also binds to a value other than a known fact.
        self._rebound_variables: frozenset[str] = frozenset()

    def read_top_level(self, node: SyntaxNode) -> None:
        """Read a top-level list."""
        self._rebound_variables = frozenset(_find_rebound_variables(node))
        readers: dict[str, Callable[[SyntaxNode], object]] = {
            "defrule": self._read_rule,
            "deftemplate": self._read_template,
            "deffacts": self._read_facts,
            "defglobal": self._read_globals,
            "deffunction": self._read_function,
            "defmethod": self._read_function,
            "defgeneric": self._read_function,
            "defmodule": self._read_definition,
        }
        if node.head in _OBJECT_CONSTRUCTS:
            return
        reader = readers.get(node.head)
        if reader is None:
            self._read_expression(node)
        elif node.arguments:
            reader(node)

    # ---- constructs

    def _read_definition(self, node: SyntaxNode) -> tuple[SyntaxNode, ...]:
        """Record the definition of a construct and return the nodes after its name."""
        name, *content = node.arguments
        if name.items is None and not name.text.startswith('"'):
            self._add_mention(NameKind(CONSTRUCT_KINDS[node.head]), name, Use.DEFINED)
        return tuple(content)

    def _read_rule(self, node: SyntaxNode) -> None:
        self._read_definition(node)
        condition, actions = split_rule(node)
        declarations = (node for item in condition if item.head == "declare" for node in item.arguments)
        self._read_expressions(value for declaration in declarations for value in declaration.arguments)
        self._read_conditions(parse_elements(condition))
        self._read_expressions(actions)

    def _read_template(self, node: SyntaxNode) -> None:
        slots = self._read_definition(node)
        owner = without_module(node.arguments[0].text)
        for slot in slots:
            if slot.head in SLOT_KEYWORDS and slot.arguments:
                self._add_mention(NameKind.SLOT, slot.arguments[0], Use.DEFINED, owner)
                self._read_expressions(value for facet in slot.arguments[1:] for value in facet.arguments)

    def _read_facts(self, node: SyntaxNode) -> None:
        for fact in self._read_definition(node):
            self._read_fact(fact)

    def _read_function(self, node: SyntaxNode) -> None:
        self._read_expressions(self._read_definition(node))

    def _read_globals(self, node: SyntaxNode) -> None:
        """Read ``(defglobal [MODULE] ?*NAME* = VALUE ...)``."""
        for name, sign, value in zip(node.arguments, node.arguments[1:], node.arguments[2:], strict=False):
            if sign.text == "=" and name.text.startswith("?*"):
                self._add_mention(NameKind.GLOBAL, name, Use.DEFINED)
                self._read_expression(value)

    # ---- conditions

    def _read_conditions(self, ces: Iterable[CE]) -> None:
        for ce in ces:
            if isinstance(ce, GroupCE):
                self._read_conditions(ce.items)
            elif isinstance(ce, TestCE):
                self._read_expressions(ce.node.arguments)
            elif ce.node.items and ce.node.items[0].items is None:
                self._read_slots(ce.node, Use.MATCHED)
                if ce.variable:
                    self._record_template(f"?{ce.variable}", without_module(ce.template))

    def _read_slots(self, node: SyntaxNode, use: Use) -> None:
        """Read a pattern or a fact: the template, and the slots or fields."""
        items = node.items or ()
        self._add_mention(NameKind.TEMPLATE, items[0], use)
        template = without_module(items[0].text)
        # A single word among the arguments makes the fact ordered. The lists in an ordered fact are calls.
        has_slots = all(item.head and not item.head.startswith(("?", "$?")) for item in node.arguments)
        for item in node.arguments:
            if has_slots:
                self._read_slot(item, template, use)
            else:
                self._read_expression(item)

    def _read_slot(self, node: SyntaxNode, template: str, use: Use) -> None:
        name = node.items[0] if node.items else node
        self._add_mention(NameKind.SLOT, name, use, template)
        kind = SLOT_VALUE_KINDS.get((template, name.text))
        for value in node.arguments:
            if kind is not None and literal(value):
                self._add_mention(kind, value, use)
            else:
                self._read_expression(value)
        self._record_multislot_names(node.arguments, template, name.text, use)

    def _record_multislot_names(
        self, values: tuple[SyntaxNode, ...], template: str, slot: str, use: Use
    ) -> None:
        """Record the names in multislots: action parameters, and predicates in keys of ``wm-fact``."""
        if (template, slot) == ("plan-action", "param-names"):
            for value in filter(literal, values):
                self._add_mention(NameKind.PARAMETER, value, use)
        elif (template, slot) == ("wm-fact", "key"):
            # (key domain fact PREDICATE args? PARAMETER VALUE ...)
            is_domain_key = [value.text for value in values[:2]] == ["domain", "fact"]
            for value in filter(literal, values[2:3] if is_domain_key else ()):
                self._add_mention(NameKind.PREDICATE, value, use)

    def _record_template(self, variable: str, template: str) -> None:
        """Record the template of the fact that a variable holds."""
        previous_template = self._templates_by_variable.setdefault(variable, template)
        if previous_template != template or variable in self._rebound_variables:
            self._templates_by_variable[variable] = ""

    # ---- expressions

    def _read_expression(self, node: SyntaxNode) -> None:
        if node.items is None:
            self._read_variable(node)
        elif node.items:
            head = node.items[0]
            if head.items is None and not _is_variable(head):
                self._read_call(node, head)
            else:
                self._read_expressions(node.items)

    def _read_expressions(self, nodes: Iterable[SyntaxNode]) -> None:
        for node in nodes:
            self._read_expression(node)

    def _read_variable(self, node: SyntaxNode) -> None:
        """Record a global variable, or the slot in ``?fact:slot``."""
        text = node.text
        if text.startswith(("?*", "$?*")):
            self._add_mention(NameKind.GLOBAL, node, Use.READ)
        elif text.startswith("?") and ":" in text:
            variable, _, slot = text.partition(":")
            if slot and (template := self._templates_by_variable.get(variable)):
                name = Name(NameKind.SLOT, slot, template)
                self.mentions.append(Mention(name, Use.QUERIED, node.end - len(slot), node.end))

    def _read_call(self, node: SyntaxNode, function: SyntaxNode) -> None:
        if function.text not in _SWITCH_BRANCHES:
            self._add_mention(NameKind.FUNCTION, function, Use.CALLED)
        arguments = node.arguments
        if function.text == "assert":
            for fact in arguments:
                self._read_fact(fact)
        elif function.text in CHANGE_FUNCTIONS and arguments:
            self._read_expression(arguments[0])
            template = self._templates_by_variable.get(arguments[0].text, "")
            for slot in arguments[1:]:
                if slot.head:
                    self._read_slot(slot, template, Use.CHANGED)
        elif function.text in QUERY_FUNCTIONS and arguments:
            self._read_query(arguments)
        elif not _OBJECT_FUNCTIONS.fullmatch(function.text):
            self._read_arguments(function.text, arguments)

    def _read_arguments(self, function: str, arguments: tuple[SyntaxNode, ...]) -> None:
        kind = FIRST_ARGUMENT_KINDS.get(function)
        for position, argument in enumerate(arguments):
            if position == 0 and kind is not None and literal(argument):
                self._add_mention(kind, argument, Use.NAMED)
            elif position == 0 and function == "bind" and argument.text.startswith("?*"):
                self._add_mention(NameKind.GLOBAL, argument, Use.SET)
            elif position == 1 and function == "bind":
                self._read_binding(arguments[0].text, argument)
            else:
                self._read_expression(argument)

    def _read_binding(self, variable: str, value: SyntaxNode) -> None:
        """Read the value of a ``bind``; record the template in ``(bind ?fact (assert (TEMPLATE ...)))``."""
        self._read_expression(value)
        if value.head == "assert" and value.arguments and value.arguments[0].head:
            self._record_template(variable, without_module(value.arguments[0].head))

    def _read_query(self, arguments: tuple[SyntaxNode, ...]) -> None:
        """Read ``((?VARIABLE TEMPLATE...)...) EXPRESSION...``."""
        # Up to the end of the query, its variables hide outer variables with the same names.
        outer_templates = dict(self._templates_by_variable)
        for member in arguments[0].items or ():
            templates = [argument for argument in member.arguments if argument.items is None]
            for template in templates:
                self._add_mention(NameKind.TEMPLATE, template, Use.QUERIED)
            if member.items:
                names = [without_module(template.text) for template in templates]
                self._templates_by_variable[member.items[0].text] = names[0] if len(names) == 1 else ""
        self._read_expressions(arguments[1:])
        self._templates_by_variable = outer_templates

    def _read_fact(self, node: SyntaxNode) -> None:
        if node.items and node.items[0].items is None and not _is_variable(node.items[0]):
            self._read_slots(node, Use.ASSERTED)
        else:
            self._read_expression(node)

    # ---- results

    def _add_mention(self, kind: NameKind, node: SyntaxNode, use: Use, owner: str = "") -> None:
        """Add a mention of the name in a node, without quotes, the marks of variables, and the module.

        :param owner: the template of a slot; empty for other names, and if the template is unknown.
        """
        text, start, end = node.text, node.start, node.end
        if text.startswith('"'):
            # An unclosed string may be a single quote: the end must not precede the start.
            text, start, end = text.strip('"'), start + 1, max(end - 1, start + 1)
            if kind is NameKind.INTERFACE:  # TYPE::ID: the type is the interface
                text = text.partition("::")[0]
                end = start + len(text)
        elif kind is NameKind.GLOBAL:
            text = text.strip("$?*")
        else:
            text = without_module(text)
        self.mentions.append(Mention(Name(kind, text, owner), use, start, end))
