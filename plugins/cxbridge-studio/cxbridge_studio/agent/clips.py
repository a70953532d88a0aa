"""Reads the names in CLIPS files: those that constructs define, match, assert, change and call.

CLIPS' syntax is regular: the head of a list shows which words in the list are names. The tables below list
the functions and slots of CLIPS, the CX core and its features that have names as arguments or values.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, literal, read, without_module
from cxbridge_studio.agent.condition import CE, GroupCE, TestCE, elements, sides
from cxbridge_studio.agent.names import Mention, Name, NameKind, Piece, PlacedPiece, SourceFile, Use
from cxbridge_studio.agent.top_level import TopLevelList, top_level_lists

# Conditional elements that contain patterns.
CONDITIONS: Final = frozenset({"and", "or", "not", "exists", "forall", "logical"})

# Functions that query facts or instances. Their first argument is `((?fact TEMPLATE) ...)`.
QUERIES: Final[Mapping[str, NameKind]] = {
    **dict.fromkeys(
        ("do-for-fact", "do-for-all-facts", "delayed-do-for-all-facts", "find-fact", "find-all-facts"),
        NameKind.TEMPLATE,
    ),
    "any-factp": NameKind.TEMPLATE,
    **dict.fromkeys(
        ("do-for-instance", "do-for-all-instances", "delayed-do-for-all-instances", "find-instance"),
        NameKind.CLASS,
    ),
    **dict.fromkeys(("find-all-instances", "any-instancep"), NameKind.CLASS),
}

# Functions with arguments that are slots of an instance, `(SLOT VALUE...)`.
_MAKES_INSTANCES: Final = frozenset(
    f"{active}{change}-instance"
    for change in ("make", "initialize", "modify", "duplicate", "message-modify", "message-duplicate")
    for active in ("", "active-")
)

# Words that begin a list but are not functions: the branches of a switch.
_SWITCH_BRANCHES: Final = frozenset({"case", "default"})
# Words that begin the definition of a slot: `field` and `multifield` are old, `single-slot` is for classes.
_SLOTS: Final = frozenset({"slot", "multislot", "single-slot", "field", "multifield"})
# Functions that change a fact; the loader rewrites `modify` in the built-in core to `cx-modify-goal`.
_CHANGES: Final = frozenset({"modify", "duplicate", "cx-modify-goal"})
_LOOPS: Final = frozenset({"foreach", "progn$", "loop-for-count"})

# Kinds of the names that constructs define. `defglobal` is missing: a defglobal defines several names.
DEFINES: Final[Mapping[str, NameKind]] = {
    "defrule": NameKind.RULE,
    "deftemplate": NameKind.TEMPLATE,
    "deffacts": NameKind.FACTS,
    "deffunction": NameKind.FUNCTION,
    "defgeneric": NameKind.FUNCTION,
    "defmethod": NameKind.FUNCTION,
    "defclass": NameKind.CLASS,
    "definstances": NameKind.FACTS,
    "defmodule": NameKind.MODULE,
}

# Slots of the core's templates that have names as values.
SLOT_VALUES: Final[Mapping[tuple[str, str], NameKind]] = {
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
    ("protobuf-msg", "type"): NameKind.PROTO_MESSAGE,
}

# Functions that have a name as their first argument.
ARGUMENTS: Final[Mapping[str, NameKind]] = {
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
    **dict.fromkeys(("pb-create", "pb-register-type"), NameKind.PROTO_MESSAGE),
    "plan-assert-action": NameKind.ACTION,
}

# Functions that have a protobuf message and the name of a field as their first two arguments.
FIELD_FUNCTIONS: Final = frozenset(
    f"pb-{function}"
    for function in (
        *("field-type", "field-label", "has-field", "field-is-list", "field-value", "field-list"),
        *("set-field", "add-list"),
    )
)


def read_clips(path: str, text: str, previous: SourceFile | None = None) -> SourceFile:
    """Read a CLIPS file.

    :param previous: the previous version of the file; the pieces of unchanged constructs are reused.
    """
    pieces = {} if previous is None else {placed.piece.text: placed.piece for placed in previous.pieces}
    lists = top_level_lists(text)
    return SourceFile(
        path,
        text,
        tuple(PlacedPiece(top_list.start, _piece(top_list, pieces.get(top_list.text))) for top_list in lists),
    )


def _piece(top_list: TopLevelList, previous: Piece | None) -> Piece:
    # The same text may be closed in one version of the file and cut by a new construct in the other.
    if previous is not None and previous.closed is top_list.closed:
        return previous
    nodes = read(top_list.text, close=True)
    if not nodes:
        return Piece("", None, top_list.text, (), closed=top_list.closed)
    reader = _Reader()
    try:
        reader.top(nodes[0])
    except RecursionError:  # CLIPS rejects text that is nested this deep
        reader.mentions.clear()
    mentions = tuple(sorted(reader.mentions, key=lambda mention: mention.start))
    kind = DEFINES.get(nodes[0].head)
    defined_names = (
        mention.name for mention in mentions if mention.use is Use.DEFINED and mention.name.kind is kind
    )
    return Piece(nodes[0].head, next(defined_names, None), top_list.text, mentions, closed=top_list.closed)


def _is_variable(node: SyntaxNode) -> bool:
    return node.items is None and node.text.startswith(("?", "$?"))


def _rebound(construct: SyntaxNode) -> Iterator[str]:
    """Yield the variables that a construct binds to anything but a fact that it asserts or modifies."""
    for node in construct.walk():
        if node.head == "bind" and len(node.arguments) > 1 and node.arguments[1].head != "assert":
            variable, value = node.arguments[:2]
            # A changed fact has the same template: (bind ?f (modify ?f ...)).
            keeps_template = (
                value.head in _CHANGES and value.arguments and value.arguments[0].text == variable.text
            )
            if not keeps_template:
                yield variable.text
        elif node.head in _LOOPS and node.arguments:
            loop = node.arguments[0]
            yield loop.items[0].text if loop.items else loop.text


class _Reader:
    """Reader of one construct, or of one command of a batch file."""

    def __init__(self) -> None:
        self.mentions: list[Mention] = []
        self._templates: dict[str, str] = {}  # template by variable, for variables that hold a fact
        # The variables that the construct binds to other values somewhere: they may hold no fact.
        self._rebound: frozenset[str] = frozenset()
        self._messages: dict[str, str] = {}  # type of the protobuf message by variable

    def top(self, node: SyntaxNode) -> None:
        """Read a top-level list."""
        self._rebound = frozenset(_rebound(node))
        readers: dict[str, Callable[[SyntaxNode], object]] = {
            "defrule": self._rule,
            "deftemplate": self._template,
            "deffacts": self._facts,
            "defglobal": self._globals,
            "deffunction": self._function,
            "defmethod": self._function,
            "defgeneric": self._function,
            "defclass": self._template,
            "defmessage-handler": self._handler,
            "definstances": self._instances,
            "defmodule": self._module,
        }
        reader = readers.get(node.head)
        if reader is None:
            self._expression(node)
        elif node.arguments:
            reader(node)

    # ---- constructs

    def _define(self, node: SyntaxNode) -> tuple[SyntaxNode, ...]:
        """Record the definition of a construct and return the nodes after its name."""
        name, *content = node.arguments
        if name.items is None and not name.text.startswith('"'):
            self._add(NameKind(DEFINES[node.head]), name, Use.DEFINED)
        return tuple(content)

    def _rule(self, node: SyntaxNode) -> None:
        self._define(node)
        condition, actions = sides(node)
        declared = (entry for item in condition if item.head == "declare" for entry in item.arguments)
        for entry in declared:
            for item in entry.arguments:
                self._expression(item)
        self._conditions(elements(condition))
        for item in actions:
            self._expression(item)

    def _template(self, node: SyntaxNode) -> None:
        """Read a deftemplate or a defclass."""
        slots = self._define(node)
        owner = without_module(node.arguments[0].text)
        for slot in slots:
            if slot.head == "is-a":
                for name in slot.arguments:
                    self._add(NameKind.CLASS, name, Use.NAMED)
            elif slot.head in _SLOTS and slot.arguments:
                self._add(NameKind.SLOT, slot.arguments[0], Use.DEFINED, owner)
                for facet in slot.arguments[1:]:
                    for value in facet.arguments:
                        self._expression(value)

    def _facts(self, node: SyntaxNode) -> None:
        for fact in self._define(node):
            self._fact(fact)

    def _module(self, node: SyntaxNode) -> None:
        for item in self._define(node):
            if item.head == "import" and item.arguments:
                self._add(NameKind.MODULE, item.arguments[0], Use.NAMED)

    def _instances(self, node: SyntaxNode) -> None:
        for instance in self._define(node):
            self._instance(instance.items or ())

    def _instance(self, items: tuple[SyntaxNode, ...]) -> None:
        """Read ``[NAME] of CLASS (SLOT VALUE...)...``; calls such as ``modify-instance`` have no class."""
        for previous, item in zip((None, *items), items, strict=False):
            if previous is not None and previous.text == "of" and literal(item):
                self._add(NameKind.CLASS, item, Use.NAMED)
            elif item.head and previous is not None:
                for value in item.arguments:
                    self._expression(value)
            else:
                self._expression(item)

    def _handler(self, node: SyntaxNode) -> None:
        """Read ``(defmessage-handler CLASS MESSAGE [TYPE] "comment" (PARAMETER...) ACTION...)``."""
        name, *content = node.arguments
        self._add(NameKind.CLASS, name, Use.NAMED)
        for item in content:
            self._expression(item)

    def _function(self, node: SyntaxNode) -> None:
        for item in self._define(node):
            self._expression(item)

    def _globals(self, node: SyntaxNode) -> None:
        """Read ``(defglobal [MODULE] ?*NAME* = VALUE ...)``."""
        for name, sign, value in zip(node.arguments, node.arguments[1:], node.arguments[2:], strict=False):
            if sign.text == "=" and name.text.startswith("?*"):
                self._add(NameKind.GLOBAL, name, Use.DEFINED)
                self._expression(value)

    # ---- conditions

    def _conditions(self, ces: Iterable[CE]) -> None:
        for ce in ces:
            if isinstance(ce, GroupCE):
                self._conditions(ce.items)
            elif isinstance(ce, TestCE):
                for item in ce.node.arguments:
                    self._expression(item)
            elif ce.node.items and ce.node.items[0].items is None:
                self._slots(ce.node, Use.MATCHED)
                if ce.variable:
                    self._record_template(f"?{ce.variable}", without_module(ce.template))

    def _slots(self, node: SyntaxNode, use: Use) -> None:
        """Read a pattern or a fact: the template, and the slots or fields."""
        items = node.items or ()
        self._add(NameKind.TEMPLATE, items[0], use)
        template = without_module(items[0].text)
        # A single word among the arguments makes the fact ordered; the lists in an ordered fact are calls.
        has_slots = all(item.head and not item.head.startswith(("?", "$?")) for item in node.arguments)
        if template == "protobuf-msg":
            self._message(node.arguments)
        for item in node.arguments:
            if has_slots:
                self._slot(item, template, use)
            else:
                self._expression(item)

    def _message(self, slots: Iterable[SyntaxNode]) -> None:
        """Record the message type of the variable that the slot ``ptr`` of a ``protobuf-msg`` binds."""
        values = {slot.head: slot.arguments[0] for slot in slots if slot.arguments}
        if "type" in values and "ptr" in values and literal(values["type"]):
            self._messages[values["ptr"].text] = literal(values["type"])

    def _slot(self, node: SyntaxNode, template: str, use: Use) -> None:
        name = node.items[0] if node.items else node
        self._add(NameKind.SLOT, name, use, template)
        kind = SLOT_VALUES.get((template, name.text))
        for value in node.arguments:
            if kind is not None and literal(value):
                self._add(kind, value, use)
            else:
                self._expression(value)
        self._multislot(node.arguments, template, name.text, use)

    def _multislot(self, values: tuple[SyntaxNode, ...], template: str, slot: str, use: Use) -> None:
        """Record the names in multislots: action parameters, and predicates in keys of ``wm-fact``."""
        if (template, slot) == ("plan-action", "param-names"):
            for value in filter(literal, values):
                self._add(NameKind.PARAMETER, value, use)
        elif (template, slot) == ("wm-fact", "key"):
            words = [value.text for value in values[:2]]
            if words == ["domain", "fact"] and len(values) > len(words) and literal(values[2]):
                self._add(NameKind.PREDICATE, values[2], use)

    def _record_template(self, variable: str, template: str) -> None:
        """Record the template of the fact in a variable; an ambiguous template is recorded as empty."""
        recorded = self._templates.setdefault(variable, template)
        if recorded != template or variable in self._rebound:
            self._templates[variable] = ""

    # ---- expressions

    def _expression(self, node: SyntaxNode) -> None:
        if node.items is None:
            self._variable(node)
        elif node.items:
            first = node.items[0]
            if first.items is None and not _is_variable(first):
                self._call(node, first)
            else:
                for item in node.items:
                    self._expression(item)

    def _variable(self, node: SyntaxNode) -> None:
        """Record a global variable, or the slot in ``?fact:slot``."""
        text = node.text
        if text.startswith(("?*", "$?*")):
            self._add(NameKind.GLOBAL, node, Use.READ)
        elif text.startswith("?") and ":" in text:
            variable, _, slot = text.partition(":")
            if slot and (template := self._templates.get(variable)):
                name = Name(NameKind.SLOT, slot, template)
                self.mentions.append(Mention(name, Use.QUERIED, node.end - len(slot), node.end))

    def _call(self, node: SyntaxNode, first: SyntaxNode) -> None:
        if first.text not in _SWITCH_BRANCHES:
            self._add(NameKind.FUNCTION, first, Use.CALLED)
        arguments = node.arguments
        if first.text == "assert":
            for fact in arguments:
                self._fact(fact)
        elif first.text in _CHANGES and arguments:
            self._expression(arguments[0])
            template = self._templates.get(arguments[0].text, "")
            for slot in arguments[1:]:
                if slot.head:
                    self._slot(slot, template, Use.CHANGED)
        elif first.text in QUERIES and arguments:
            self._query(arguments, QUERIES[first.text])
        elif first.text in _MAKES_INSTANCES:
            self._instance(node.items or ())
        else:
            self._arguments(first.text, arguments)

    def _arguments(self, function: str, arguments: tuple[SyntaxNode, ...]) -> None:
        kind = ARGUMENTS.get(function)
        for position, argument in enumerate(arguments):
            if position == 0 and kind is not None and literal(argument):
                self._add(kind, argument, Use.NAMED)
            elif position == 0 and function == "bind" and argument.text.startswith("?*"):
                self._add(NameKind.GLOBAL, argument, Use.SET)
            elif position == 1 and function in FIELD_FUNCTIONS and literal(argument):
                if owner := self._messages.get(arguments[0].text):
                    self._add(NameKind.PROTO_FIELD, argument, Use.NAMED, owner)
            elif position == 1 and function == "bind":
                self._binding(arguments[0].text, argument)
            else:
                self._expression(argument)

    def _binding(self, variable: str, value: SyntaxNode) -> None:
        """Read ``(bind ?fact (assert (TEMPLATE ...)))`` or ``(bind ?message (pb-create TYPE))``."""
        if value.head == "pb-create" and value.arguments:
            self._messages[variable] = literal(value.arguments[0])
        self._expression(value)
        if value.head == "assert" and value.arguments and value.arguments[0].head:
            self._record_template(variable, without_module(value.arguments[0].head))

    def _query(self, arguments: tuple[SyntaxNode, ...], kind: NameKind) -> None:
        # A variable of a query hides a variable of the same name outside, up to the end of the query.
        outer_templates = dict(self._templates)
        for member in arguments[0].items or ():
            templates = [argument for argument in member.arguments if argument.items is None]
            for template in templates:
                self._add(kind, template, Use.QUERIED)
            if member.items:
                has_one_template = len(templates) == 1 and kind is NameKind.TEMPLATE
                template_name = without_module(templates[0].text) if has_one_template else ""
                self._templates[member.items[0].text] = template_name
        for item in arguments[1:]:
            self._expression(item)
        self._templates = outer_templates

    def _fact(self, node: SyntaxNode) -> None:
        if node.items and node.items[0].items is None and not _is_variable(node.items[0]):
            self._slots(node, Use.ASSERTED)
        else:
            self._expression(node)

    # ---- results

    def _add(self, kind: NameKind, node: SyntaxNode, use: Use, owner: str = "") -> None:
        """Add a mention of the name in a node, without quotes, the marks of variables, and the module."""
        text = node.text
        start, end = node.start, node.end
        if text.startswith('"'):
            text, start, end = text.strip('"'), start + 1, max(end - 1, start + 1)
            if kind is NameKind.INTERFACE:  # TYPE::ID: the type is the interface
                text = text.partition("::")[0]
                end = start + len(text)
        elif kind is NameKind.GLOBAL:
            text = text.strip("$?*")
        else:
            text = without_module(text)
        self.mentions.append(Mention(Name(kind, text, owner), use, start, end))
