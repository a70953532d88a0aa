"""The nodes of PlanSys2's experts and planner, backed by the world model of an agent."""

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

# Error text of PlanSys2's nodes before they are configured.
INACTIVE: Final = "Requesting service in non-active state"

_SERVICES: Final = {"problem": PROBLEM_SERVICES, "domain": DOMAIN_SERVICES}
_NOTHING: Final[Mapping[str, Any]] = {}


def _refused(_request: Message, reason: str) -> Mapping[str, Any]:
    return {"success": False, "error_info": reason}


class ExpertServer(Closing):
    """Serves the world model of an environment: one node with the service names of PlanSys2's three.

    All work is done in :meth:`loop`, in the executive's thread, never while rules fire.

    :param namespace: the prefix of all names.
    :param node: a node with the rights of its clients; it is not closed.
    :param feature: knows the environment.
    :param log: logs each change by a client.
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
        for expert_name in settings.serve:
            for name, kind in services_of(expert_name, settings.node.distribution).items():
                self._serve(expert_name, namespace + name, kind)
        self._topics = "problem" in settings.serve
        if self._topics:
            latched = QosProfile(durability="transient_local", depth=DEPTH)
            self._updates = node.publisher(namespace + UPDATE[0], UPDATE[1], QosProfile(depth=DEPTH))
            self._knowledge = node.publisher(namespace + KNOWLEDGE[0], KNOWLEDGE[1], latched)

    def _serve(self, expert_name: str, name: str, kind: str) -> None:
        last = name.rpartition("/")[2]
        if expert_name == "planner":
            access = "plan"
            work = self._planner.plan if last == "get_plan" else self._planner.validate
        else:
            service = _SERVICES[expert_name][last]
            access, work = "change" if service.changes else "read", partial(self._answer, name, service)
        needs = right_of_frame("ros2-experts", access)
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
        return self._planner.is_busy

    def close(self) -> None:
        self._planner.close()
