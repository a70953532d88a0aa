"""Constructs as they stand in CLIPS files, for environments that are not there any more."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from cxbridge.errors import ClipsError
from cxbridge.explain.lhs import called, named_globals, parse_rule
from cxbridge.explain.lookup import Place
from cxbridge.explain.sexpr import Node, one_line, read
from cxbridge.explain.snapshot import QUERIES, Rulebook, Snapshot, Template

_MULTI = ("multislot", "multifield")
_SINGLE = ("slot", "field")


@dataclass(frozen=True, slots=True)
class TextFile:
    """A CLIPS file.

    :param name: what it is called; its path, where that is known.
    """

    name: str
    text: str


class Constructs:
    """The constructs of files.

    :param files: in the order they were loaded; of two constructs of one name the later counts.
    """

    def __init__(self, files: Iterable[TextFile]) -> None:
        self.files = tuple(files)
        self.rules: dict[str, tuple[Place, str]] = {}
        self.templates: dict[str, Template] = {}
        self._functions: dict[str, Node] = {}
        self._globals: dict[str, str] = {}
        for file in self.files:
            line, counted = 1, 0
            for node in read(file.text):
                line += file.text.count("\n", counted, node.start)
                counted = node.start
                self._take(node, Place(file.name, line))

    def _take(self, node: Node, place: Place) -> None:
        if node.items is None or len(node.items) < 2:  # noqa: PLR2004
            return
        name = node.items[1].text.rpartition("::")[2]
        if node.head == "defrule":
            self.rules[name] = (place, node.text)
        elif node.head == "deftemplate":
            self.templates[name] = Template(name, tuple(_slots(node.items[2:])))
        elif node.head == "deffunction":
            self._functions[name] = node
        elif node.head == "defglobal":
            self._take_globals(node.items[1:])

    def _take_globals(self, items: tuple[Node, ...]) -> None:
        for place, item in enumerate(items[:-2]):
            if items[place + 1].text == "=":
                self._globals[item.text.strip("?*")] = one_line(items[place + 2].text)

    def rulebook(self) -> Rulebook:
        """Return which rules there are."""
        places = {name: (place.file, place.line) for name, (place, _) in self.rules.items()}
        return Rulebook(frozenset(self.rules), (), places=places)

    def rule_texts(self) -> Mapping[str, str]:
        """Return all defrules by name."""
        return {name: text for name, (_, text) in self.rules.items()}

    def snapshot(self, rule: str, env: str, time_us: int) -> tuple[Snapshot, bool]:
        """Return a rule without facts, and whether its condition may ask for any fact.

        :raises ClipsError: when there is no such rule.
        """
        if rule not in self.rules:
            raise ClipsError(f"there is no rule '{rule}'")
        text = self.rules[rule][1]
        condition = parse_rule(text)
        names: dict[str, str] = {}
        global_names = set(condition.globals)
        words = set(condition.functions)

        def visit(functions: frozenset[str]) -> None:
            for name in sorted(functions - names.keys()):
                node = self._functions.get(name)
                if node is None:
                    continue
                names[name] = ""
                global_names.update(named_globals((node,)))
                inner = called((node,))
                words.update(inner)
                visit(inner)
                del names[name]
                names[name] = node.text

        try:
            visit(condition.functions)
        except RecursionError:
            raise ClipsError(f"the functions of '{rule}' call one another too deep") from None
        everything = any(word.startswith(QUERIES) for word in words)
        # a global variable may begin with the value of one before it
        values = dict(self._globals) if global_names else {}
        made = Snapshot(
            env,
            time_us,
            text,
            self.templates,
            (),
            tuple(filter(None, names.values())),
            global_texts=values,
        )
        return made, everything


def _slots(items: tuple[Node, ...]) -> Iterable[tuple[str, bool]]:
    for item in items:
        if item.head in (*_MULTI, *_SINGLE) and item.items is not None and len(item.items) > 1:
            yield item.items[1].text, item.head in _MULTI
