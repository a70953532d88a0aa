"""Places in an agent's files for the messages of a run. Files are read only after a mistake."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cxbridge.executive.executive import action_mapping
from cxbridge.run.explainers import Places, places
from cxbridge.suggestions import did_you_mean, nearest

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cxbridge.executive.executive import Executive
    from cxbridge.run.agent import Run

# The start of the core's error text for an action that no rule took.
_NOT_EXECUTED: Final = "No action executor"


def places_of(context: Run, executive: Executive) -> Places:
    """Return the name finder for the loaded files of an agent, without those of the core."""
    paths = context.paths
    core = (paths.cx, paths.library, *paths.before)
    files = dict.fromkeys(executive.env.loader.files)
    return places([file for file in files if not any(file.is_relative_to(folder) for folder in core)])


class UnexecutedActions:
    """Reports each action that fails for lack of an executor, once, with the place of the mistake."""

    def __init__(self, context: Run, executive: Executive) -> None:
        self._context, self._executive = context, executive
        self._reported: set[str] = set()
        executive.env.watcher.follow("plan-action", self._record_fact, ("action-name", "state", "error-msg"))

    def _record_fact(self, _template: str, slots: Mapping[str, str]) -> None:
        if slots.get("state") != "FAILED" or _NOT_EXECUTED not in slots.get("error-msg", ""):
            return
        action = slots["action-name"]
        if action not in self._reported:
            self._reported.add(action)
            self._executive.log.error(self._mistake(action))

    def _mistake(self, action: str) -> str:
        """Return the cause: a misspelt action, an unmapped action, or missing control of the Skiller."""
        context, of_action = self._context, places_of(self._context, self._executive).of_action
        facts = self._executive.env.facts("domain-operator")
        operators = {str(slots["name"]) for _, _, slots in facts}
        mapped = set(action_mapping(context.config, context.spec))
        if action not in operators:
            hint = did_you_mean(action, operators & mapped or operators | mapped)
            return _joined(of_action(action), f"the action '{action}' has no executor", hint)
        if action in mapped:
            why = f"'{action}' found no Skiller under control, and a monitor fails actions that wait for it"
            return _joined(of_action(action), why, "")
        wrong = nearest(action, mapped - operators)
        base = f"/clips-executive/specs/{context.spec}/action-mapping"
        values = [context.config.get(f"{base}/{wrong[0]}")] if wrong else context.config.search(base)
        place = next((f"{value.file}:{value.line}" for value in values if value.file), "")
        hint = f"is '{wrong[0]}' meant for it?" if wrong else ""
        return _joined(place or of_action(action), f"the action mapping lacks the action '{action}'", hint)


def _joined(place: str, text: str, hint: str) -> str:
    return (f"{place}: " if place else "") + text + (f"; {hint}" if hint else "")
