"""Where the files of an agent say what a run complains of; read again only when something is wrong."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from functools import cached_property
from typing import TYPE_CHECKING, Final

from cxbridge.executive.executive import action_mapping
from cxbridge.suggestions import did_you_mean, nearest
from cxbridge_studio.agent.named_files import Found, NamedFiles
from cxbridge_studio.agent.names import Name, NameKind, Use

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cxbridge.executive.executive import Executive
    from cxbridge.run.agent import Run

_NOT_EXECUTED: Final = "No action executor"
"""How the error of an action begins that the core fails because no rule took it."""


class AgentPlaces:
    """Finds names in the files that an agent has loaded by now, those of the core left out.

    Each place is ``FILE:LINE``; empty when no file has it: a goal or an action may be made of variables.

    :param context: of the agent.
    :param executive: of the agent.
    """

    def __init__(self, context: Run, executive: Executive) -> None:
        self._context, self._executive = context, executive

    @cached_property
    def named(self) -> NamedFiles:
        """The files, and the names in them."""
        from cxbridge_studio.agent.clips import read_clips  # noqa: PLC0415 - a good run needs none

        paths, named = self._context.paths, NamedFiles()
        core = (paths.cx, paths.library, *paths.before)
        for file in dict.fromkeys(self._executive.env.loader.files):
            if not any(file.is_relative_to(folder) for folder in core):
                with suppress(OSError):
                    text = file.read_text("utf-8", "surrogateescape")
                    named.take(read_clips(str(file), text))
        return named

    def of_action(self, action: str) -> str:
        """Return where plans get an action."""
        return _first(self.named.mentions(Name(NameKind.ACTION, action), Use.ASSERTED, Use.NAMED))

    def of_goal(self, goal_class: str, mode: str) -> str:
        """Return where a rule of the agent has brought goals of a class into a mode, or has made them."""
        of_class = Name(NameKind.GOAL_CLASS, goal_class)
        changed = re.compile(rf"\s+{re.escape(mode)}\s*\)")
        others = ""
        for found in self.named.mentions(Name(NameKind.SLOT, "mode", "goal"), Use.CHANGED):
            piece = found.file.piece_at(found.mention.start)
            if piece is None or not changed.match(found.file.text, found.mention.end):
                continue
            names = {mention.name for mention in piece.piece.mentions}
            if of_class in names:
                return _place(found)
            if not others and not any(name.kind is NameKind.GOAL_CLASS for name in names):
                others = _place(found)
        return others or _first(self.named.mentions(of_class, Use.ASSERTED))

    def of_interface(self, kind: str, name: str) -> str:
        """Return where rules open an interface."""
        for found in self.named.mentions(Name(NameKind.INTERFACE, kind), Use.NAMED):
            line = found.file.text[found.mention.end :].partition("\n")[0]
            if name in line:
                return _place(found)
        return ""

    def of_rule(self, rule: str) -> str:
        """Return where a rule begins."""
        found = self._executive.env.loader.place_of(rule)
        return "" if found is None else f"{found[0]}:{found[1]}"

    def of_similar_fact(self, template: str) -> str:
        """Return where a fact is asserted whose name may be a misspelt one: ``NAME, which PLACE asserts``."""
        names = self.named.names(NameKind.TEMPLATE, Use.ASSERTED) - self.named.names(
            NameKind.TEMPLATE, Use.MATCHED
        )
        for name in nearest(template, names):
            place = _first(self.named.mentions(Name(NameKind.TEMPLATE, name), Use.ASSERTED))
            return f"did you mean ({name}), which {place} asserts?"
        return ""

    def rules_that_make_goals(self) -> list[str]:
        """Return the names of the rules that assert goals."""
        wanted = Name(NameKind.TEMPLATE, "goal")
        return [
            piece.name.text
            for file in self.named.files
            for _, piece in file.pieces
            if piece.name is not None and piece.name.kind is NameKind.RULE
            if any(mention.use is Use.ASSERTED and mention.name == wanted for mention in piece.mentions)
        ]


class UnexecutedActions:
    """Reports each action once that fails because nobody executes it, and where the mistake is.

    :param context: of the agent.
    :param executive: of the agent; its facts are followed from now on.
    """

    def __init__(self, context: Run, executive: Executive) -> None:
        self._context, self._executive = context, executive
        self._reported: set[str] = set()
        self._places = AgentPlaces(context, executive)
        executive.env.watcher.follow("plan-action", self._note, ("action-name", "state", "error-msg"))

    def _note(self, _template: str, slots: Mapping[str, str]) -> None:
        if slots.get("state") != "FAILED" or _NOT_EXECUTED not in slots.get("error-msg", ""):
            return
        action = slots["action-name"]
        if action not in self._reported:
            self._reported.add(action)
            self._executive.log.error(self._mistake(action))

    def _mistake(self, action: str) -> str:
        """Return the mistake: a wrong name in plan or action mapping, an action not mapped, no control."""
        context = self._context
        facts = self._executive.env.facts("domain-operator")
        operators = {str(slots["name"]) for _, _, slots in facts}
        mapped = set(action_mapping(context.config, context.spec))
        if action not in operators:
            hint = did_you_mean(action, operators & mapped or operators | mapped)
            return _joined(self._places.of_action(action), f"nobody executes the action '{action}'", hint)
        if action in mapped:
            why = f"'{action}' found no Skiller under control, and a monitor fails actions that wait for it"
            return _joined(self._places.of_action(action), why, "")
        wrong = nearest(action, mapped - operators)
        base = f"/clips-executive/specs/{context.spec}/action-mapping"
        values = [context.config.get(f"{base}/{wrong[0]}")] if wrong else context.config.search(base)
        place = next((f"{value.file}:{value.line}" for value in values if value.file), "")
        hint = f"is '{wrong[0]}' meant for it?" if wrong else ""
        return _joined(
            place or self._places.of_action(action), f"the action mapping lacks the action '{action}'", hint
        )


def _joined(place: str, text: str, hint: str) -> str:
    return (f"{place}: " if place else "") + text + (f"; {hint}" if hint else "")


def _first(found: Iterator[Found]) -> str:
    return next(map(_place, found), "")


def _place(found: Found) -> str:
    return f"{found.file.path}:{found.file.lines.at(found.mention.start)}"
