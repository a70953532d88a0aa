"""Finds names in an agent's CLIPS files, so that a report about a run can point to ``FILE:LINE``.

The names come from :class:`AgentModel`, which records for each name in a file how the file uses the name:
whether a rule asserts, matches or changes it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from cxbridge.suggestions import nearest_names
from cxbridge_studio.agent.model import AgentModel, FileMention
from cxbridge_studio.agent.names import Name, NameKind, Use


class SourcePositions:
    """The positions of names in source files, as ``FILE:LINE``; empty for a name that the files lack.

    :param files: the agent's files.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        self._model = AgentModel()
        for file in files:
            self._model.read(file)

    def find_action_position(self, action: str) -> str:
        """Return the position where an action is put into a plan."""
        return _find_first_position(
            self._model.find_mentions(Name(NameKind.ACTION, action), Use.ASSERTED, Use.NAMED)
        )

    def find_goal_position(self, goal_class: str, mode: str) -> str:
        """Return the position where a rule sets a goal of a class to a mode, or asserts the goal."""
        class_name = Name(NameKind.GOAL_CLASS, goal_class)
        mode_value = re.compile(rf"\s+{re.escape(mode)}\s*\)")
        position_without_class = ""
        for change in self._model.find_mentions(Name(NameKind.SLOT, "mode", "goal"), Use.CHANGED):
            rule = change.file.piece_at(change.mention.start)
            if rule is None or not mode_value.match(change.file.text, change.mention.end):
                continue
            names = {mention.name for mention in rule.piece.mentions}
            if class_name in names:
                return _format_position(change)
            # A rule without any class may change this goal, but a later rule may name its class.
            if not any(name.kind is NameKind.GOAL_CLASS for name in names):
                position_without_class = position_without_class or _format_position(change)
        return position_without_class or _find_first_position(
            self._model.find_mentions(class_name, Use.ASSERTED)
        )

    def find_interface_position(self, interface_type: str, interface_id: str) -> str:
        """Return the position where rules open an interface."""
        for file_mention in self._model.find_mentions(Name(NameKind.INTERFACE, interface_type), Use.NAMED):
            # The id follows the type: "TYPE::ID", or as the next argument of the call.
            rest_of_line = file_mention.file.text[file_mention.mention.end :].partition("\n")[0]
            if interface_id in rest_of_line:
                return _format_position(file_mention)
        return ""

    def make_similar_fact_hint(self, template: str) -> str:
        """Return ``did you mean (NAME), which FILE:LINE asserts?``; empty without a similar asserted fact."""
        # A template that rules match is not misspelt.
        unmatched_templates = self._model.find_names(
            NameKind.TEMPLATE, Use.ASSERTED
        ) - self._model.find_names(NameKind.TEMPLATE, Use.MATCHED)
        for name in nearest_names(template, unmatched_templates):
            position = _find_first_position(
                self._model.find_mentions(Name(NameKind.TEMPLATE, name), Use.ASSERTED)
            )
            return f"did you mean ({name}), which {position} asserts?"
        return ""

    def find_deffacts(self) -> Iterator[tuple[str, str]]:
        """Yield the name and the position of each deffacts."""
        for definition in self._model.find_definitions_of_kind(NameKind.FACTS):
            yield definition.mention.name.text, _format_position(definition)

    def find_goal_asserting_rules(self) -> list[str]:
        """Return the rules that assert goals."""
        goal_template = Name(NameKind.TEMPLATE, "goal")
        return [
            piece.name.text
            for file in self._model.files
            for _, piece in file.pieces
            if piece.name is not None and piece.name.kind is NameKind.RULE
            if any(
                mention.use is Use.ASSERTED and mention.name == goal_template for mention in piece.mentions
            )
        ]


def _find_first_position(mentions: Iterator[FileMention]) -> str:
    return next(map(_format_position, mentions), "")


def _format_position(file_mention: FileMention) -> str:
    return f"{file_mention.file.path}:{file_mention.file.lines.line_at(file_mention.mention.start)}"
