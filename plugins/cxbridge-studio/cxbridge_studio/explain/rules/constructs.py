"""Reader of the constructs in CLIPS files, for runs whose environment no longer exists."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from cxbridge.clipstext.syntax import Definition, SyntaxNode, definitions, one_line
from cxbridge.errors import ClipsError
from cxbridge.executive.host.loading import Diagnostic
from cxbridge_studio.agent.rule import dependencies, parse_rule
from cxbridge_studio.explain.rules.snapshot import FactTemplate, Rulebook, Snapshot

_MULTI = ("multislot", "multifield")
_SINGLE = ("slot", "field")


@dataclass(frozen=True, slots=True)
class TextFile:
    """A CLIPS file.

    :param name: its path, or another name if the path is unknown.
    """

    name: str
    text: str


class Constructs:
    """The constructs of files.

    :param files: in loading order; the later of two constructs with one name counts.
    :param diagnostics: CLIPS' messages; refused rules are left out.
    :param folders: folders with further files of the agent.
    """

    def __init__(
        self,
        files: Iterable[TextFile],
        diagnostics: Sequence[Diagnostic] = (),
        folders: Sequence[str] = (),
    ) -> None:
        self._diagnostics = tuple(diagnostics)
        self._folders = tuple(folders)
        self._names: list[str] = []
        self._refused: dict[str, str] = {}
        refused = {(each.file, each.construct) for each in diagnostics}
        self.templates: dict[str, FactTemplate] = {}
        self._rules: dict[str, str] = {}
        self._places: dict[str, tuple[str, int]] = {}
        self._functions: dict[str, str] = {}
        self._globals: dict[str, str] = {}
        for file in files:
            self._names.append(file.name)
            for definition in definitions(file.text):
                if (file.name, f"{definition.kind} {definition.name}") not in refused:
                    self._take(definition, file.name)
                elif definition.kind == "defrule":
                    self._refused[definition.name] = definition.node.text

    def _take(self, definition: Definition, file: str) -> None:
        name, node = definition.name, definition.node
        match definition.kind:
            case "defrule":
                self._rules[name] = node.text
                self._places[name] = (file, definition.line)
            case "deftemplate":
                self.templates[name] = FactTemplate(name, tuple(_slots(node.arguments[1:])))
            case "deffunction":
                self._functions[name] = node.text
            case "defglobal":
                self._take_globals(node.arguments)

    def _take_globals(self, items: tuple[SyntaxNode, ...]) -> None:
        for index, item in enumerate(items[:-2]):
            if items[index + 1].text == "=":
                self._globals[item.text.strip("?*")] = one_line(items[index + 2].text)

    def rulebook(self) -> Rulebook:
        return Rulebook(
            frozenset(self._rules),
            tuple(self._names),
            self._diagnostics,
            self._folders,
            self._places,
            self._refused,
        )

    @property
    def global_texts(self) -> Mapping[str, str]:
        """The expressions of global variables by name, in the order of definition."""
        return self._globals

    def has_function(self, name: str) -> bool:
        return name in self._functions

    def rule_texts(self) -> Mapping[str, str]:
        return self._rules

    def snapshot(self, rule: str, env: str, time_us: int) -> Snapshot:
        """Return a rule without facts.

        :raises ClipsError: if there is no such rule.
        """
        if rule not in self._rules:
            raise ClipsError(f"there is no rule '{rule}'")
        text = self._rules[rule]
        needs = dependencies(parse_rule(text), self._functions.get)
        return Snapshot(
            env,
            time_us,
            text,
            self.templates,
            (),
            needs.functions,
            # the value of a global variable may depend on earlier ones
            global_texts=self._globals if needs.globals else {},
            all_facts=needs.all_facts,
        )


def _slots(items: tuple[SyntaxNode, ...]) -> Iterator[tuple[str, bool]]:
    for item in items:
        if item.head in (*_MULTI, *_SINGLE) and item.arguments:
            yield item.arguments[0].text, item.head in _MULTI
