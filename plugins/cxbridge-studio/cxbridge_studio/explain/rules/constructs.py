"""Reads the constructs of CLIPS files from their text, for recorded runs whose environment is gone."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from cxbridge.clipstext.syntax import Definition, SyntaxNode, definitions, one_line
from cxbridge.errors import ClipsError
from cxbridge.executive.host.loading import Diagnostic
from cxbridge_studio.agent.rule import find_dependencies, parse_rule
from cxbridge_studio.explain.rules.snapshot import FactTemplate, Rulebook, Snapshot

_MULTI_SLOTS = ("multislot", "multifield")
_SINGLE_SLOTS = ("slot", "field")


@dataclass(frozen=True, slots=True)
class TextFile:
    """The text of a CLIPS file.

    :param name: the path, or another name if the path is unknown.
    """

    name: str
    text: str


class Constructs:
    """The constructs of files.

    :param files: the files in loading order; of two constructs with the same name, the later counts.
    :param diagnostics: CLIPS' messages about the files; the constructs that CLIPS refused are left out.
    :param folders: the folders with further files of the agent.
    """

    def __init__(
        self,
        files: Iterable[TextFile],
        diagnostics: Sequence[Diagnostic] = (),
        folders: Sequence[str] = (),
    ) -> None:
        self.templates: dict[str, FactTemplate] = {}
        self._rules: dict[str, str] = {}
        self._functions: dict[str, str] = {}
        self._globals: dict[str, str] = {}
        positions: dict[str, tuple[str, int]] = {}
        refused_rules: dict[str, str] = {}
        names: list[str] = []
        # Only the diagnostics tell whether CLIPS has refused a construct.
        refused_constructs = {(diagnostic.file, diagnostic.construct) for diagnostic in diagnostics}
        for file in files:
            names.append(file.name)
            for definition in definitions(file.text):
                is_rule = definition.kind == "defrule"
                if (file.name, f"{definition.kind} {definition.name}") not in refused_constructs:
                    self._add_definition(definition)
                    positions |= {definition.name: (file.name, definition.line)} if is_rule else {}
                elif is_rule:
                    refused_rules[definition.name] = definition.node.text
        self._rulebook = Rulebook(
            frozenset(self._rules), tuple(names), tuple(diagnostics), tuple(folders), positions, refused_rules
        )

    def _add_definition(self, definition: Definition) -> None:
        name, node = definition.name, definition.node
        match definition.kind:
            case "defrule":
                self._rules[name] = node.text
            case "deftemplate":
                self.templates[name] = FactTemplate(name, tuple(_read_template_slots(node.arguments[1:])))
            case "deffunction":
                self._functions[name] = node.text
            case "defglobal":
                # After an optional module name come a name, a `=` and an expression for each variable.
                arguments = node.arguments
                for variable, sign, expression in zip(arguments, arguments[1:], arguments[2:], strict=False):
                    if sign.text == "=":
                        self._globals[variable.text.strip("?*")] = one_line(expression.text)

    def read_rulebook(self) -> Rulebook:
        return self._rulebook

    def read_rule_texts(self) -> Mapping[str, str]:
        return self._rules

    def take_snapshot(self, rule: str, env: str, time_us: int) -> Snapshot:
        """Return a rule without facts.

        :raises ClipsError: if there is no such rule.
        """
        if rule not in self._rules:
            raise ClipsError(f"there is no rule '{rule}'")
        text = self._rules[rule]
        dependencies = find_dependencies(parse_rule(text), self._functions.get)
        return Snapshot(
            env,
            time_us,
            text,
            self.templates,
            (),
            dependencies.functions,
            # The value of a global variable may depend on earlier variables, so all are copied.
            global_texts=self._globals if dependencies.globals else {},
            needs_all_facts=dependencies.needs_all_facts,
        )


def _read_template_slots(nodes: tuple[SyntaxNode, ...]) -> Iterator[tuple[str, bool]]:
    """Yield the name of each slot of a deftemplate, and whether the slot is a multislot."""
    for slot in nodes:
        if slot.head in (*_MULTI_SLOTS, *_SINGLE_SLOTS) and slot.arguments:
            yield slot.arguments[0].text, slot.head in _MULTI_SLOTS
