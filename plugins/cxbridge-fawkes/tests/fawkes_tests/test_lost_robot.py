"""A robot comes and goes while its Skiller is at work for a run, a run through a gateway, a daemon.

The table: what happens to the robot, in which state of a skill string, and who drives it.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from cxbridge.run.result import COMPLETED, FAULT
from cxbridge_fawkes.network.client import FawkesBlackBoard
from fawkes_tests.lost_robot import TIMEOUT_S, Client, Robot
from tests.blackboard.zmq.support import eventually
from tests.support import FULL, share

STATES = ("asked", "sent", "running", "ended")
WAYS = ("daemon", "run", "gateway")
FATES = ("killed", "stopped for a moment", "stopped for long", "reloaded")
TABLE = [(way, fate, state) for way in WAYS for fate in FATES for state in STATES]
USUAL = [
    (way, fate, state)
    for way, fate, state in TABLE
    if FULL
    or way == "daemon"
    or (fate, state) in zip(FATES, ("running", "running", "sent", "ended"), strict=True)
]


def befall(fate: str, robot: Robot) -> None:
    """Let the robot go and come back."""
    match fate:
        case "killed":
            robot.kill()
        case "stopped for a moment":
            robot.stand_still(TIMEOUT_S / 3)
        case "stopped for long":
            robot.stand_still(2.5 * TIMEOUT_S)
        case "reloaded":
            robot.reload()


@pytest.mark.parametrize(("way", "fate", "state"), share(USUAL, 8))
def test_an_action_fails_when_the_skiller_is_lost_and_the_agent_goes_on_when_it_is_back(
    way: str, fate: str, state: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    connect = partial(FawkesBlackBoard, timeout=TIMEOUT_S, silence=0.2)
    monkeypatch.setattr("cxbridge_fawkes.network.transport.FawkesBlackBoard", connect)
    robot = Robot(state)
    try:
        client = Client(way, tmp_path, robot.url)
        client.start()
        eventually(robot.reached.is_set)
        befall(fate, robot)
        lost = fate != "stopped for a moment"
        if way == "daemon":
            if fate == "killed":
                eventually(lambda: client.has_logged("SkillerInterface::Skiller is no longer mirrored"))
                if state == "running":
                    eventually(lambda: client.has_logged("Execution of act FAILED"))  # before it is back
                robot.come_back()
            eventually(lambda: client.has_logged("TRY has COMPLETED"))
            assert robot.tries <= 2 if lost else robot.tries == 1
        else:
            client.join(20)
            reason = client.result.reason
            if not lost or (state == "ended" and client.result.status == COMPLETED):
                assert (client.result.status, robot.tries) == (COMPLETED, 1), reason
            else:
                assert client.result.status == FAULT, reason
                assert "is gone, and with it the skills under way" in reason
        client.close()
        if way == "daemon" or fate != "killed":
            eventually(lambda: robot.controller() == "")
    finally:
        robot.close()
