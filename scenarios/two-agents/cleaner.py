"""The executor of a cleaning robot."""

from __future__ import annotations

import os
from pathlib import Path

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board import Progress, SkillCall, SkillExecutor, Steps


class Cleaner(SkillExecutor):
    """Executes ``sweep{room="hall"}``, ``mop{room="hall"}`` and ``fill{}``.

    The settings ``sweep``, ``mop`` and ``fill`` are the durations of the skills in seconds, by default 4.

    The setting ``world`` names a file that stands for the house. All robots append a line for each event:
    ``MICROSECONDS ROBOT begins|ends|finds WORK``. A robot reads the file before it sweeps or mops, and does
    not repeat finished work. Without the file, all rooms are dirty.
    """

    skills = ("sweep", "fill", "mop")
    known_settings = (*skills, "world")

    def execute(self, call: SkillCall) -> Steps:
        """Yield the progress of the work until its duration is over; finished work ends at once."""
        work = " ".join([call.skill, *([call.text("room")] if call.skill != "fill" else [])])
        if call.skill != "fill" and any(line.endswith(f" ends {work}") for line in self._read_world()):
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
        """The file of the house; None without the setting."""
        name = self.setting("world", "")
        return self.folder / name if name else None

    def _read_world(self) -> list[str]:
        """Return the lines of the file; empty without a file."""
        world = self._world
        return world.read_text().splitlines() if world is not None and world.exists() else []

    def _note(self, event: str) -> None:
        """Log an event, and append it to the file of the house, if any."""
        self.log.info(f"{self.agent} {event}")
        if self._world is not None:
            # a single write in append mode, because several robots write at the same time
            file = os.open(self._world, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
            try:
                os.write(file, f"{self.clock.now_us()} {self.agent} {event}\n".encode())
            finally:
                os.close(file)
