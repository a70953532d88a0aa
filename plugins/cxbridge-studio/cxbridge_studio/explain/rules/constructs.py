"""Reads the constructs of CLIPS files from their text, for recorded runs whose environment is gone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cxbridge.clipstext.syntax import Definition, compact, definitions
from cxbridge.errors import ClipsError
from cxbridge.executive.host.facts.copying import FactTemplate
from cxbridge.executive.host.loading import Diagnostic
from cxbridge_studio.agent.clips import SLOT_KEYWORDS
from cxbridge_studio.agent.rule import find_dependencies, parse_rule
from cxbridge_studio.explain.rules.snapshot import Rulebook, Snapshot


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
    :ivar rule_texts: the defrules by name, as the files define them.
    """

    def __init__(
        self,
        files: Sequence[TextFile],
        diagnostics: Sequence[Diagnostic] = (),
        folders: Sequence[str] = (),
    ) -> None:
        self.templates: dict[str, FactTemplate] = {}
        self.rule_texts: dict[str, str] = {}
        self._functions: dict[str, str] = {}
        self._globals: dict[str, str] = {}
        positions: dict[str, tuple[str, int]] = {}
        refused_rules: dict[str, str] = {}
        # Only the diagnostics tell whether CLIPS has refused a construct.
        refused_constructs = {(diagnostic.file, diagnostic.construct) for diagnostic in diagnostics}
        for file in files:
            for definition in definitions(file.text):
                is_rule = definition.kind == "defrule"
                if (file.name, f"{definition.kind} {definition.name}") not in refused_constructs:
                    self._add_definition(definition)
                    positions |= {definition.name: (file.name, definition.line)} if is_rule else {}
                elif is_rule:
                    refused_rules[definition.name] = definition.node.text
        self.rulebook = Rulebook(
            frozenset(self.rule_texts),
            tuple(file.name for file in files),
            tuple(diagnostics),
            tuple(folders),
            positions,
            refused_rules,
        )

    def _add_definition(self, definition: Definition) -> None:
        name, node = definition.name, definition.node
        match definition.kind:
            case "defrule":
                self.rule_texts[name] = node.text
            case "deftemplate":
                self.templates[name] = FactTemplate(
                    name,
                    tuple(
                        (slot.arguments[0].text, SLOT_KEYWORDS[slot.head])
                        for slot in node.arguments[1:]
                        if slot.head in SLOT_KEYWORDS and slot.arguments
                    ),
                )
            case "deffunction":
                self._functions[name] = node.text
            case "defglobal":
                # After an optional module name come a name, a `=` and an expression for each variable.
                arguments = node.arguments
                for variable, sign, expression in zip(arguments, arguments[1:], arguments[2:], strict=False):
                    if sign.text == "=":
                        self._globals[variable.text.strip("?*")] = compact(expression.text)

    def take_snapshot(self, rule: str, env: str, time_us: int) -> Snapshot:
        """Return the snapshot of a rule without facts.

        :raises ClipsError: if there is no such rule, it cannot be parsed, or its calls are nested too deeply.
        """
        if rule not in self.rule_texts:
            raise ClipsError(f"there is no rule '{rule}'")
        text = self.rule_texts[rule]
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
