"""The running skills, from facts and the Skillers' interfaces: a run is not over before they end."""

from __future__ import annotations

from cxbridge.executive.host.environment import ClipsEnvironment

_RUNNING = "S_RUNNING"


class SkillWatch:
    """Follows what Skillers show to the rules.

    A ``skill`` fact alone does not tell: Fawkes' own rules leave one behind that is S_RUNNING forever when
    the action vanishes whose skill it is, since the Skiller then shows the id of the message that stopped it.
    The built-in rules retract it at once, while the Skiller has still to show that it has stopped.
    """

    def __init__(self, env: ClipsEnvironment) -> None:
        self._env = env
        self._shown: dict[str, tuple[str, str]] = {}
        self._called: dict[str, str] = {}
        env.watcher.follow("SkillerInterface", self._note, ("id", "msgid", "status"))
        env.watcher.follow("skill", self._note_call, ("skiller", "msgid", "status"))

    def _note(self, _template: str, slots: dict[str, str]) -> None:
        self._shown[slots.get("id", "").strip('"')] = slots.get("msgid", ""), slots.get("status", "")

    def _note_call(self, _template: str, slots: dict[str, str]) -> None:
        if slots.get("status") == _RUNNING:
            self._called[slots.get("skiller", "").strip('"')] = slots.get("msgid", "")

    @property
    def running(self) -> bool:
        """Whether a skill that rules have called runs."""
        return any(
            self._shown.get(skiller) == (msgid, _RUNNING) for skiller, msgid in self._called.items()
        ) or any(
            slots.get("status") == _RUNNING and str(slots.get("skiller", "")) not in self._shown
            for _, _, slots in self._env.facts("skill")
        )
