"""The executor of a cleaning robot."""

from __future__ import annotations

import os
from pathlib import Path

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board import Progress, SkillCall, SkillExecutor, Steps


class Cleaner(SkillExecutor):
    """Executes ``sweep{room="hall"}``, ``mop{room="hall"}`` and ``fill{}``; settings: seconds by these names.

    ``world`` is a file that stands for the house: what happens is written there, by all robots, as
    ``MICROSECONDS ROBOT begins|ends|finds WORK``. Before it works the robot looks there: what is done
    already it finds, and does not do again. Without the file the house is dirty.
    """

    skills = ("sweep", "fill", "mop")
    known_settings = (*skills, "world")

    def execute(self, call: SkillCall) -> Steps:
        """Do the work."""
        work = " ".join([call.skill, *([call.text("room")] if call.skill != "fill" else [])])
        if call.skill != "fill" and any(line.endswith(f" ends {work}") for line in self._seen()):
            self._note(f"finds {work}")
            return
        self._note(f"begins {work}")
        needed_us = self.setting(call.skill, 4.0) * MICROSECONDS
        begin_us = self.clock.now_us()
        while (passed_us := self.clock.now_us() - begin_us) < needed_us:
            yield Progress(passed_us / needed_us, work)
        self._note(f"ends {work}")

    @property
    def _world(self) -> Path | None:
        name = self.setting("world", "")
        return self.folder / name if name else None

    def _seen(self) -> list[str]:
        world = self._world
        return world.read_text().splitlines() if world is not None and world.exists() else []

    def _note(self, what: str) -> None:
        """Note what happens; a short line is written whole, whoever writes at the same time."""
        self.log.info(f"{self.agent} {what}")
        if self._world is not None:
            file = os.open(self._world, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
            try:
                os.write(file, f"{self.clock.now_us()} {self.agent} {what}\n".encode())
            finally:
                os.close(file)
