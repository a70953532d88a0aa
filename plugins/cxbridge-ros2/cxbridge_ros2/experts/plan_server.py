"""The services of PlanSys2's planner, whose requests have the texts of PDDL domains and problems."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from typing import Any, Final

from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge.executive.pddl.printer import format_list
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import SendResponse

_NOT_FOUND: Final = "Plan not found"
# In a plan without times, the seconds between the starts of actions, and the duration of an action, as POPF
# writes them.
_STEP_S: Final = 0.001


class PlanServer(Closing):
    """Makes plans in the background, and responds when the plans are made.

    The types of the planner and its calls are ``Any``, since their plug-in may not be installed.

    :param make_planner: makes the feature ``planner`` of another plug-in, at the first request.
    """

    def __init__(self, make_planner: Callable[[], Any]) -> None:
        self._make_planner = make_planner
        self._calls_with_replies: list[tuple[Any, SendResponse]] = []

    def start_planning(self, request: Message, reply: SendResponse) -> None:
        """Start planning; :meth:`send_plans` sends the plan. An invalid request gets its response at once."""
        try:
            domain = parse_domain(request["domain"])
            problem = parse_problem(request["problem"], domain)
            self._calls_with_replies.append(
                (self._service.call(self._planner.make_request(domain, problem)), reply)
            )
        except CxbridgeError as error:
            reply({"success": False, "error_info": f"{_NOT_FOUND}: {error}"})

    @cached_property
    def _planner(self) -> Any:
        return self._make_planner()

    @cached_property
    def _service(self) -> Any:
        return self._planner.make_service("")  # of no environment: the request has domain and problem

    def validate_domain(self, request: Message, reply: SendResponse) -> None:
        """Respond whether a text is a valid domain."""
        try:
            parse_domain(request["domain"])
        except PddlError as error:
            reply({"success": False, "error_info": f"Domain is not valid: {error}"})
        else:
            reply({"success": True})

    def send_plans(self) -> None:
        """Send the responses to requests whose planning has ended."""
        for call, reply in list(self._calls_with_replies):
            result = call.result
            if result is None:  # the planner has not ended
                continue
            self._calls_with_replies.remove((call, reply))
            if result.status.value == "PLANNED":
                reply({"success": True, "plan": {"items": _make_items(result.actions)}})
            else:
                reason = result.message or result.status.value
                reply({"success": False, "error_info": f"{_NOT_FOUND}: {reason}"})

    def close(self) -> None:
        """Cancel all planning."""
        # a look into __dict__, since access to the property would make a service
        if "_service" in self.__dict__:
            self._service.close()


def _make_items(actions: Iterable[PlannedAction]) -> list[Mapping[str, Any]]:
    return [
        {
            "time": index * _STEP_S if action.start is None else action.start,
            "action": format_list(action.name, *action.arguments),
            "duration": _STEP_S if action.duration is None else action.duration,
        }
        for index, action in enumerate(actions)
    ]
