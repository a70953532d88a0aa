"""The facts of an agent, cached by deftemplate until they change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from cxbridge.clipstext.values import value_text

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value

Slots = Mapping[str, "Value"]  # values by slot


class FactTables:
    """The facts of an agent by deftemplate.

    Monitors read the facts after each loop, and most loops change no fact. The facts of followed deftemplates
    are therefore read from CLIPS only after a change.
    """

    def __init__(self, env: ClipsEnvironment) -> None:
        self.env = env
        self._facts: dict[str, list[Slots]] = {}
        self._change_flags: dict[str, list[ChangeFlag]] = {}

    @property
    def name(self) -> str:
        """The name of the environment, which is the name of the agent."""
        return self.env.name

    @property
    def is_initialized(self) -> bool:
        """Whether the agent is loaded."""
        return next(self.env.facts("executive-initialized"), None) is not None

    def follow(self, template: str, change_flag: ChangeFlag | None = None) -> None:
        """Cache the facts of a deftemplate until they change. Facts of other deftemplates are read each time.

        :param change_flag: records the changes.
        """
        if template not in self._change_flags:
            self._change_flags[template] = []
            self.env.watcher.follow(template, self._handle_change, ())
            self.env.watcher.follow_retractions(template, self._handle_change, ())
        if change_flag is not None:
            self._change_flags[template].append(change_flag)

    def _handle_change(self, template: str, _slots: Mapping[str, str]) -> None:
        self._facts.pop(template, None)
        for change_flag in self._change_flags[template]:
            change_flag.is_pending = True

    def facts(self, template: str) -> Sequence[Slots]:
        """Return the facts of a deftemplate."""
        facts = self._facts.get(template)
        if facts is None:
            facts = [slots for _, _, slots in self.env.facts(template)]
            if template in self._change_flags:
                self._facts[template] = facts
        return facts

    def printed_facts(self, template: str) -> Sequence[Mapping[str, str]]:
        """Return the facts of a deftemplate, with the values as CLIPS prints them."""
        return [{name: value_text(value) for name, value in slots.items()} for slots in self.facts(template)]


class ChangeFlag:
    """Records whether facts of some deftemplates have changed since the last query.

    :ivar is_pending: whether they have changed; true before the first query.
    """

    def __init__(self) -> None:
        self.is_pending = True

    def take_pending(self) -> bool:
        """Return `is_pending`, and reset it."""
        was_pending, self.is_pending = self.is_pending, False
        return was_pending
