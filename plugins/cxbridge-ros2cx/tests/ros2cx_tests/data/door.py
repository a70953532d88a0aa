"""An executor whose door is closed."""

from collections.abc import Generator

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board import Progress, SkillCall, SkillExecutor, SkillFailedError


class Door(SkillExecutor):
    """An executor that fails after a second."""

    skills = ("move",)

    def execute(self, call: SkillCall) -> Generator[Progress | None, None, None]:
        end_us = self.clock.now_us() + MICROSECONDS
        yield Progress(0.5, "on the way")
        while self.clock.now_us() < end_us:
            yield None
        raise SkillFailedError("door closed", progress=0.7)
