"""The running skills, from facts and Skiller interfaces. A run must wait for them."""

from __future__ import annotations

from cxbridge.executive.host.environment import ClipsEnvironment

_RUNNING = "S_RUNNING"


class SkillWatch:
    """Follows the skills that rules have called."""

    def __init__(self, env: ClipsEnvironment) -> None:
        self._env = env
        # a fact skill alone is not enough: when the action of a skill vanishes, Fawkes' rules leave its fact
        # S_RUNNING forever, because the Skiller then shows the id of the stop message; the built-in rules
        # retract the fact immediately, while the Skiller has not stopped yet
        self._shown: dict[str, tuple[str, str]] = {}
        self._called: dict[str, str] = {}
        env.watcher.follow("SkillerInterface", self._record_fact, ("id", "msgid", "status"))
        env.watcher.follow("skill", self._note_call, ("skiller", "msgid", "status"))

    def _record_fact(self, _template: str, slots: dict[str, str]) -> None:
        self._shown[slots.get("id", "").strip('"')] = slots.get("msgid", ""), slots.get("status", "")

    def _note_call(self, _template: str, slots: dict[str, str]) -> None:
        if slots.get("status") == _RUNNING:
            self._called[slots.get("skiller", "").strip('"')] = slots.get("msgid", "")

    @property
    def running(self) -> bool:
        """Whether a skill called by rules is running."""
        return any(
            self._shown.get(skiller) == (msgid, _RUNNING) for skiller, msgid in self._called.items()
        ) or any(
            slots.get("status") == _RUNNING and str(slots.get("skiller", "")) not in self._shown
            for _, _, slots in self._env.facts("skill")
        )
