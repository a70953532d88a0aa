"""Calls of skills from the same process, by name or as skill strings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from cxbridge.errors import SkillError
from cxbridge.skiller.board.master import Master
from cxbridge.skiller.board.protocol import SkillCall
from cxbridge.skiller.board.watch import ExecutorInfo
from cxbridge.skiller.skillstring import parse_skill_string

if TYPE_CHECKING:
    from cxbridge.skiller.board.board import SkillBoard


class LocalSkillCalls:
    """The skill board as the executive's feature ``skill-board`` uses it.

    :param skills: the board.
    """

    def __init__(self, skills: SkillBoard) -> None:
        self._skills = skills
        self._open: dict[int, Master] = {}

    @property
    def version(self) -> int:
        """Another number whenever some executor came, left or wrote."""
        return self._skills.version

    @property
    def executors(self) -> Iterable[ExecutorInfo]:
        """The executors that exist, in the order they appeared."""
        return self._skills.executors

    def ask(
        self,
        skill: str,
        parameters: Mapping[str, Any],
        agent: str,
        on_change: Callable[[Master], None],
        name: str = "",
    ) -> Master:
        """Have a skill executed.

        :param name: the name of the master, for people.
        :raises SkillError: when names or parameters do not fit into messages.
        """
        return self._ask(SkillCall(skill, agent, parameters, name), on_change)

    def ask_for(self, skill_string: str, agent: str, on_change: Callable[[Master], None]) -> Master:
        """Have a skill string with one call executed.

        :raises SkillError: when it is none, or names or parameters do not fit into messages.
        """
        calls = calls_of(skill_string, agent)
        if len(calls) != 1:
            raise SkillError(f"the skill string '{skill_string}' has {len(calls)} calls, expected one")
        return self._ask(calls[0], on_change)

    def stop(self, number: int) -> bool:
        """Cancel an action; return whether there was something to cancel."""
        master = self._open.get(number)
        return master is not None and self._skills.cancel(master)

    def _ask(self, call: SkillCall, on_change: Callable[[Master], None]) -> Master:
        def changed(master: Master) -> None:
            if master.is_over:
                self._open.pop(master.number, None)
            on_change(master)

        master = self._skills.request(call, changed)
        if not master.is_over:
            self._open[master.number] = master
        return master


def calls_of(text: str, agent: str) -> list[SkillCall]:
    """Return the calls in a skill string.

    :raises SkillError: when it is not of the usual form.
    """
    return [
        SkillCall(call.name, agent, {str(key): _with_names(value) for key, value in call.args.items()})
        for call in parse_skill_string(text)
    ]


def _with_names(value: Any) -> Any:
    """Return an argument as it can go over the board, where all keys are texts."""
    if isinstance(value, dict):
        return {str(key): _with_names(item) for key, item in value.items()}
    return value
