"""The nodes of PlanSys2's experts and planner, with the world model of an agent behind them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from cxbridge.closing import Closing
from cxbridge.events import Logger
from cxbridge.rights import right_of_frame
from cxbridge_ros2.experts.answers import PROBLEM_SERVICES, ExpertService, answer, knowledge_message
from cxbridge_ros2.experts.domain import DOMAIN_SERVICES
from cxbridge_ros2.experts.names import DEPTH, KNOWLEDGE, UPDATE, services_of
from cxbridge_ros2.experts.nodes import NodeCodec
from cxbridge_ros2.experts.planner import PlanServer
from cxbridge_ros2.experts.settings import ExpertSettings
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Node, Reply
from cxbridge_ros2.problem_expert import ProblemExpertFeature
from cxbridge_ros2.qos import QosProfile
from cxbridge_ros2.topics import check_topic

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

INACTIVE: Final = "Requesting service in non-active state"
"""What PlanSys2's nodes say before they are configured."""

_SERVICES: Final = {"problem": PROBLEM_SERVICES, "domain": DOMAIN_SERVICES}
_NOTHING: Final[Mapping[str, Any]] = {}


def _refused(_request: Message, reason: str) -> Mapping[str, Any]:
    return {"success": False, "error_info": reason}


class ExpertServer(Closing):
    """Serves the world model of an environment: one node, with the names of PlanSys2's three.

    Everything is done in :meth:`loop`, in the thread of the executive, never while rules run.

    :param settings: the served experts.
    :param namespace: the prefix of all names.
    :param node: of ROS 2, with the rights of its clients; its maker closes it.
    :param feature: knows the environment.
    :param planner: makes plans.
    :param log: gets each change that a client requests.
    """

    def __init__(
        self,
        settings: ExpertSettings,
        namespace: str,
        node: Node,
        feature: ProblemExpertFeature,
        planner: PlanServer,
        log: Logger,
    ) -> None:
        self._node, self._feature, self._log = node, feature, log
        self._planner = planner
        self._codec = NodeCodec(settings.node.distribution)
        self._published_version = -1
        for which in settings.serve:
            for name, kind in services_of(which, settings.node.distribution).items():
                self._serve(which, namespace + name, kind)
        self._topics = "problem" in settings.serve
        if self._topics:
            latched = QosProfile(durability="transient_local", depth=DEPTH)
            self._updates = node.publisher(namespace + UPDATE[0], UPDATE[1], QosProfile(depth=DEPTH))
            self._knowledge = node.publisher(namespace + KNOWLEDGE[0], KNOWLEDGE[1], latched)

    def _serve(self, which: str, name: str, kind: str) -> None:
        last = name.rpartition("/")[2]
        if which == "planner":
            does = "plan"
            work = self._planner.plan if last == "get_plan" else self._planner.validate
        else:
            service = _SERVICES[which][last]
            does, work = "change" if service.changes else "read", partial(self._answer, name, service)
        needs = right_of_frame("ros2-experts", does)
        self._node.serve_later(check_topic(name), kind, work, needs=needs, refuse=_refused)

    def _answer(self, name: str, service: ExpertService, request: Message, reply: Reply) -> None:
        env = self._feature.env
        if env is None:
            reply({"exist": False} if "/exist_" in name else {"success": False, "error_info": INACTIVE})
            return
        with env.lock:
            response = answer(service, self._feature.expert(env), self._codec, request)
        if service.changes:
            outcome = "done" if response["success"] else response["error_info"]
            self._log.info(f"{name}: {outcome}")
        reply(response)

    def loop(self) -> None:
        """Answer requests, send finished plans, and publish changes."""
        self._node.poll()
        self._planner.loop()
        env = self._feature.env
        if self._topics and env is not None and self._published_version != self._feature.version:
            self._published_version = self._feature.version
            self._publish(env)

    def _publish(self, env: ClipsEnvironment) -> None:
        with env.lock:
            message = knowledge_message(self._feature.expert(env))
        self._updates.publish(_NOTHING)
        self._knowledge.publish(message)

    @property
    def is_busy(self) -> bool:
        """Whether a plan is being made."""
        return self._planner.is_busy

    def close(self) -> None:
        """Make no more plans."""
        self._planner.close()
