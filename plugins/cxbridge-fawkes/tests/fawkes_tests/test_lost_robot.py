"""A run, a run through a gateway and a daemon lose their robot in each state of a skill string.

The table has the client, the disturbance of the robot, and the state of the skill string.
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

STATES = ("acquiring", "sent", "running", "ended")
CLIENT_KINDS = ("daemon", "run", "gateway")
DISTURBANCES = ("killed", "stopped briefly", "stopped long", "reloaded")
ALL_CASES = [
    (kind, disturbance, state) for kind in CLIENT_KINDS for disturbance in DISTURBANCES for state in STATES
]
CASES = [
    (kind, disturbance, state)
    for kind, disturbance, state in ALL_CASES
    if FULL
    or kind == "daemon"
    or (disturbance, state) in zip(DISTURBANCES, ("running", "running", "sent", "ended"), strict=True)
]


def disturb(disturbance: str, robot: Robot) -> None:
    """Disturb the robot; a killed robot stays away until `Robot.restart`."""
    match disturbance:
        case "killed":
            robot.kill()
        case "stopped briefly":
            robot.stall(TIMEOUT_S / 3)
        case "stopped long":
            robot.stall(2.5 * TIMEOUT_S)
        case "reloaded":
            robot.reload()


@pytest.mark.parametrize(("kind", "disturbance", "state"), share(CASES, 8))
def test_action_fails_with_lost_skiller_and_agent_continues_after_return(
    kind: str, disturbance: str, state: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    connect = partial(FawkesBlackBoard, timeout=TIMEOUT_S, silence=0.2)
    monkeypatch.setattr("cxbridge_fawkes.network.transport.FawkesBlackBoard", connect)
    robot = Robot(state)
    try:
        client = Client(kind, tmp_path, robot.url)
        client.start()
        eventually(robot.reached.is_set)
        disturb(disturbance, robot)
        lost = disturbance != "stopped briefly"
        if kind == "daemon":
            if disturbance == "killed":
                eventually(lambda: client.has_logged("SkillerInterface::Skiller is no longer mirrored"))
                if state == "running":
                    eventually(lambda: client.has_logged("Execution of act FAILED"))  # before the restart
                robot.restart()
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
        if kind == "daemon" or disturbance != "killed":
            eventually(lambda: robot.controller() == "")
    finally:
        robot.close()
