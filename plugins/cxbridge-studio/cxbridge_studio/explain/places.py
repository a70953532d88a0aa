"""The places in an agent's files for the complaints of a run."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from cxbridge.run.explainers import Places
from cxbridge.suggestions import nearest
from cxbridge_studio.agent.model import AgentModel, Found
from cxbridge_studio.agent.names import Name, NameKind, Use


class WrittenPlaces(Places):
    """Finds names in CLIPS files.

    :param files: those of the agent.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        self._model = AgentModel()
        for file in files:
            self._model.read(file)

    def of_action(self, action: str) -> str:
        """Return where plans get an action."""
        return _first(self._model.mentions(Name(NameKind.ACTION, action), Use.ASSERTED, Use.NAMED))

    def of_goal(self, goal_class: str, mode: str) -> str:
        """Return where a rule has brought goals of a class into a mode, or has made them."""
        of_class = Name(NameKind.GOAL_CLASS, goal_class)
        changed = re.compile(rf"\s+{re.escape(mode)}\s*\)")
        others = ""
        for found in self._model.mentions(Name(NameKind.SLOT, "mode", "goal"), Use.CHANGED):
            piece = found.file.piece_at(found.mention.start)
            if piece is None or not changed.match(found.file.text, found.mention.end):
                continue
            names = {mention.name for mention in piece.piece.mentions}
            if of_class in names:
                return _place(found)
            if not others and not any(name.kind is NameKind.GOAL_CLASS for name in names):
                others = _place(found)
        return others or _first(self._model.mentions(of_class, Use.ASSERTED))

    def of_interface(self, kind: str, name: str) -> str:
        """Return where rules open an interface."""
        for found in self._model.mentions(Name(NameKind.INTERFACE, kind), Use.NAMED):
            line = found.file.text[found.mention.end :].partition("\n")[0]
            if name in line:
                return _place(found)
        return ""

    def of_similar_fact(self, template: str) -> str:
        """Return where a fact is asserted whose name may be a misspelt one: ``NAME, which PLACE asserts``."""
        names = self._model.names(NameKind.TEMPLATE, Use.ASSERTED) - self._model.names(
            NameKind.TEMPLATE, Use.MATCHED
        )
        for name in nearest(template, names):
            place = _first(self._model.mentions(Name(NameKind.TEMPLATE, name), Use.ASSERTED))
            return f"did you mean ({name}), which {place} asserts?"
        return ""

    def rules_that_make_goals(self) -> list[str]:
        """Return the names of the rules that assert goals."""
        wanted = Name(NameKind.TEMPLATE, "goal")
        return [
            piece.name.text
            for file in self._model.files
            for _, piece in file.pieces
            if piece.name is not None and piece.name.kind is NameKind.RULE
            if any(mention.use is Use.ASSERTED and mention.name == wanted for mention in piece.mentions)
        ]


def _first(found: Iterator[Found]) -> str:
    return next(map(_place, found), "")


def _place(found: Found) -> str:
    return f"{found.file.path}:{found.file.lines.at(found.mention.start)}"
