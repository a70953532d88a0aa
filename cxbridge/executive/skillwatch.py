"""Which skills run, as facts and the Skillers' interfaces tell: a run is not over before they are."""

from __future__ import annotations

from cxbridge.executive.environment import ClipsEnvironment

_RUNNING = "S_RUNNING"


class SkillWatch:
    """Follows what Skillers show to the rules.

    A ``skill`` fact alone does not tell: Fawkes' own rules leave one behind that is S_RUNNING for ever when
    the action vanishes whose skill it is, since the Skiller then shows the id of the message that stopped it.
    """

    def __init__(self, env: ClipsEnvironment) -> None:
        self._env = env
        self._shown: dict[str, tuple[str, str]] = {}
        env.watcher.follow("SkillerInterface", self._note, ("id", "msgid", "status"))

    def _note(self, _template: str, slots: dict[str, str]) -> None:
        self._shown[slots.get("id", "").strip('"')] = slots.get("msgid", ""), slots.get("status", "")

    @property
    def running(self) -> bool:
        """Whether a skill that rules have called runs."""
        return any(
            slots.get("status") == _RUNNING
            and self._shows(str(slots.get("skiller", "")), str(slots.get("msgid", "")))
            for _, _, slots in self._env.facts("skill")
        )

    def _shows(self, skiller: str, msgid: str) -> bool:
        """Whether a Skiller runs what it was told by this message; also when it has shown nothing yet."""
        shown = self._shown.get(skiller)
        return shown is None or shown == (msgid, _RUNNING)
