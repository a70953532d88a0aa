"""Positions in an agent's files, for reports about a run."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from cxbridge.run.explainers import Places
from cxbridge.suggestions import nearest
from cxbridge_studio.agent.model import AgentModel, Found
from cxbridge_studio.agent.names import Name, NameKind, Use


class WrittenPlaces(Places):
    """Finder of names in CLIPS files.

    :param files: the agent's files.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        self._model = AgentModel()
        for file in files:
            self._model.read(file)

    def of_action(self, action: str) -> str:
        """Return the position where an action is put into a plan."""
        return _first(self._model.mentions(Name(NameKind.ACTION, action), Use.ASSERTED, Use.NAMED))

    def of_goal(self, goal_class: str, mode: str) -> str:
        """Return the position where a rule sets a goal of a class to a mode, or asserts the goal."""
        of_class = Name(NameKind.GOAL_CLASS, goal_class)
        changed = re.compile(rf"\s+{re.escape(mode)}\s*\)")
        others = ""
        for change in self._model.mentions(Name(NameKind.SLOT, "mode", "goal"), Use.CHANGED):
            piece = change.file.piece_at(change.mention.start)
            if piece is None or not changed.match(change.file.text, change.mention.end):
                continue
            names = {mention.name for mention in piece.piece.mentions}
            if of_class in names:
                return _place(change)
            if not others and not any(name.kind is NameKind.GOAL_CLASS for name in names):
                others = _place(change)
        return others or _first(self._model.mentions(of_class, Use.ASSERTED))

    def of_interface(self, kind: str, name: str) -> str:
        """Return the position where rules open an interface."""
        for mention in self._model.mentions(Name(NameKind.INTERFACE, kind), Use.NAMED):
            line = mention.file.text[mention.mention.end :].partition("\n")[0]
            if name in line:
                return _place(mention)
        return ""

    def of_similar_fact(self, template: str) -> str:
        """Return the question whether an asserted fact of a similar name is meant, with its position."""
        names = self._model.names(NameKind.TEMPLATE, Use.ASSERTED) - self._model.names(
            NameKind.TEMPLATE, Use.MATCHED
        )
        for name in nearest(template, names):
            place = _first(self._model.mentions(Name(NameKind.TEMPLATE, name), Use.ASSERTED))
            return f"did you mean ({name}), which {place} asserts?"
        return ""

    def rules_that_make_goals(self) -> list[str]:
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


def _first(places: Iterator[Found]) -> str:
    return next(map(_place, places), "")


def _place(mention: Found) -> str:
    return f"{mention.file.path}:{mention.file.lines.at(mention.mention.start)}"
