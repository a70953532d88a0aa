"""An executor in a separate process that is killed at a point: ``python dying.py POINT URL``.

POINT is ``responded``, ``confirmed``, ``running`` or ``finished``. The process survives further values.
"""

from __future__ import annotations

import os
import signal
import sys
from typing import Any

from cxbridge.daemon.services.executor import run_executor
from cxbridge.daemon.services.options import ExecutorOptions
from cxbridge.skiller.board import host
from cxbridge.skiller.board.protocol import ExecutorState
from cxbridge_ros2cx.executors import DummyExecutor

POINT = sys.argv[1] if __name__ == "__main__" else ""
STEPS_BEFORE_DEATH = 3


class Move(DummyExecutor):
    """A fast dummy."""

    skills = ("move",)
    period = 0.05


class Dying(host.ExecutorHost):
    """A host that kills its process at a point."""

    steps = 0

    def _at(self, point: str) -> None:
        if point == POINT:
            os.kill(os.getpid(), signal.SIGKILL)

    def _handle_request(self, message: Any) -> None:
        super()._handle_request(message)
        self._at("responded")

    def _handle_confirm(self, message: Any) -> None:
        self._at("confirmed")
        super()._handle_confirm(message)

    def step(self) -> None:
        super().step()
        self.steps += self.state is ExecutorState.BUSY
        if self.steps >= STEPS_BEFORE_DEATH:
            self._at("running")

    def _finish(self, *outcome: Any) -> None:
        super()._finish(*outcome)
        self._at("finished")


if __name__ == "__main__":
    host.ExecutorHost = Dying  # type: ignore[misc]
    run_executor(ExecutorOptions(target=f"{__file__}:Move", agent="default", url=sys.argv[2], name="e"))
