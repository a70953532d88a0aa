"""The component that serves the Skiller as an action of ROS 2."""

from __future__ import annotations

from collections import deque

from cxbridge.errors import CxbridgeError
from cxbridge.mainloop import Hook
from cxbridge.rights import EXEC_SKILL as EXEC_SKILL_MESSAGE
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge.skiller.calls import CallOutcome, SkillerCall
from cxbridge_ros2.actions import AbortedError, ActionServer, Execution, ServedGoal
from cxbridge_ros2.interfaces.definitions import ACTION_DEFINITIONS, EXEC_SKILL_TYPE
from cxbridge_ros2.names import check_ros_name
from cxbridge_ros2.settings import locate_errors, read_node_section, typed_setting

_SECTION = "/ros2/skiller"
_SUBJECT = "the Skiller for ROS 2"


class Ros2Skiller(Component):
    """Serves a Skiller on the blackboard as an action whose goals are skill strings."""

    hooks = (Hook.SKILL,)
    description = "The Skiller as an action of ROS 2"

    def __init__(self, context: Run) -> None:
        self._board = context.board
        values, settings = read_node_section(
            context.config, _SECTION, ("action", "skiller"), context.paths.confdir, _SUBJECT
        )
        with locate_errors(context.config, _SECTION):
            self._skiller = typed_setting(values, "skiller", "Skiller", _SUBJECT)
            action = check_ros_name(
                settings.namespace + typed_setting(values, "action", "/skiller/execute", _SUBJECT)
            )
            self._node = settings.join(
                f"cxbridge_skiller_{context.name}",
                settings.load_definitions(ACTION_DEFINITIONS),
                context.bus.logger("Ros2Skiller").warn,
                context.rights,
            )
        right = context.rights.message_right(*EXEC_SKILL_MESSAGE)
        self._server = ActionServer(
            self._node, action, EXEC_SKILL_TYPE, self._execute, context.clock, right=right
        )

    def loop(self) -> None:
        self._node.poll()
        self._server.step()

    def _execute(self, served_goal: ServedGoal) -> Execution:
        statuses: deque[str] = deque(maxlen=1)  # the newest status that is not sent yet
        try:
            with SkillerCall(
                self._board,
                skiller=self._skiller,
                steal=served_goal.goal["steal"],
                on_status=lambda status, _error: statuses.append(status),
            ) as call:
                steps = call.poll(served_goal.goal["skill_string"])
                while True:
                    try:
                        next(steps)
                    except StopIteration as end:
                        result = end.value
                        break
                    if served_goal.is_cancel_requested:  # leaving the `with` block stops the skill
                        return {"success": False, "error": "the goal was cancelled"}
                    yield {"status": statuses.pop()} if statuses else None
        except CxbridgeError as error:
            # without a Skiller, or if another client has control, only this goal fails
            raise AbortedError({"success": False, "error": error.message}) from None
        if result.outcome is not CallOutcome.FINAL:
            raise AbortedError({"success": False, "error": result.error})
        return {"success": True, "error": ""}

    @property
    def is_quiet(self) -> bool:
        return not self._server.is_busy

    def close(self) -> None:
        self._server.close()
        self._node.close()
