"""The server of an agent's world model, with the services of PlanSys2's experts and planner."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cxbridge.closing import Closing
from cxbridge.events import Logger
from cxbridge.rights import right_of_frame
from cxbridge_ros2.experts.definitions import (
    KNOWLEDGE_TOPIC_AND_TYPE,
    SERVICES_BY_NODE,
    TOPIC_DEPTH,
    UPDATE_TOPIC_AND_TYPE,
    find_service_types,
)
from cxbridge_ros2.experts.domain_services import DOMAIN_SERVICES
from cxbridge_ros2.experts.plan_server import PlanServer
from cxbridge_ros2.experts.problem_services import (
    PROBLEM_SERVICES,
    ExpertService,
    make_knowledge_message,
    make_response,
)
from cxbridge_ros2.experts.trees import TreeCodec
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Node, RequestHandler, SendResponse
from cxbridge_ros2.problem_expert import ProblemExpertFeature
from cxbridge_ros2.qos import QosProfile
from cxbridge_ros2.settings import NodeSettings, check_choice, locate_errors, read_node_section, to_list

if TYPE_CHECKING:
    from cxbridge.config import Configuration
    from cxbridge.executive.host.environment import ClipsEnvironment

SECTION: Final = "/ros2/experts"

_ALL: Final = "all"
_SUBJECT: Final = "the settings of the experts"

# PlanSys2's error text for requests before a node is active.
INACTIVE_ERROR: Final = "Requesting service in non-active state"


def read_expert_settings(config: Configuration, folder: Path) -> tuple[NodeSettings, Collection[str]]:
    """Return the settings of the node, and the served nodes: keys of :data:`.definitions.SERVICES_BY_NODE`.

    :param folder: the base of relative paths.
    :raises CxbridgeError: if a setting is invalid; the error has the file and line.
    """
    values, node_settings = read_node_section(config, SECTION, ("serve",), folder, _SUBJECT)
    names = [str(name) for name in to_list(values.get("serve", _ALL))]
    with locate_errors(config, SECTION):
        for name in names:
            check_choice(
                name, (*SERVICES_BY_NODE, _ALL), f"{_SUBJECT}: '{name}' is not a service of the experts"
            )
    return node_settings, SERVICES_BY_NODE if _ALL in names else dict.fromkeys(names)


def _make_refusal(_request: Message, reason: str) -> Mapping[str, Any]:
    # services that only read are never refused; the responses of the other services have these fields
    return {"success": False, "error_info": reason}


class ExpertServer(Closing):
    """Serves the world model of an environment. One node has the services of PlanSys2's three nodes.

    :meth:`loop` handles requests in the executive's thread, and never while rules fire.

    :param served_nodes: keys of :data:`.definitions.SERVICES_BY_NODE`.
    :param distribution: the ROS distribution of the clients.
    :param namespace: the prefix of all names.
    :param node: a node with the rights of its clients, which the caller closes.
    :param feature: the feature that has the environment.
    :param planner: the planner for clients, which :meth:`close` closes.
    :param log: logs the requests to change the problem that the experts handle, with their results.
    """

    def __init__(
        self,
        served_nodes: Collection[str],
        distribution: str,
        namespace: str,
        node: Node,
        feature: ProblemExpertFeature,
        planner: PlanServer,
        log: Logger,
    ) -> None:
        self._node, self._feature, self._log = node, feature, log
        self._planner = planner
        self._codec = TreeCodec(distribution)
        self._published_version = -1  # no version of the knowledge has been published
        # by service: the row of the table of rights, and the handler
        handlers: dict[str, tuple[str, RequestHandler]] = {
            "/planner/get_plan": ("plan", planner.start_planning),
            "/planner/validate_domain": ("plan", planner.validate_domain),
        }
        for name, service in {**PROBLEM_SERVICES, **DOMAIN_SERVICES}.items():
            handlers[name] = (
                "change" if service.changes_problem else "read",
                partial(self._handle_request, namespace + name, service),
            )
        for served_node in served_nodes:
            for name, service_type in find_service_types(served_node, distribution).items():
                rights_row, handler = handlers[name]
                right = right_of_frame("ros2-experts", rights_row)
                node.serve_later(
                    namespace + name, service_type, handler, right=right, make_refusal=_make_refusal
                )
        self._has_topics = "problem" in served_nodes
        if self._has_topics:
            self._update_publisher, self._knowledge_publisher = (
                node.create_publisher(namespace + topic, message_type, qos)
                for (topic, message_type), qos in (
                    (UPDATE_TOPIC_AND_TYPE, QosProfile(depth=TOPIC_DEPTH)),
                    (KNOWLEDGE_TOPIC_AND_TYPE, QosProfile(durability="transient_local", depth=TOPIC_DEPTH)),
                )
            )

    def _handle_request(
        self, name: str, service: ExpertService, request: Message, reply: SendResponse
    ) -> None:
        env = self._feature.env
        if env is None:
            # PlanSys2's nodes respond like this before they are active; ExistNode has no other field
            reply({"exist": False} if "/exist_" in name else {"success": False, "error_info": INACTIVE_ERROR})
            return
        with env.lock:
            response = make_response(service, self._feature.make_expert(env), self._codec, request)
        if service.changes_problem:
            self._log.info(f"{name}: {'done' if response['success'] else response['error_info']}")
        reply(response)

    def loop(self) -> None:
        """Handle requests, send finished plans, and publish changed knowledge, at most once a loop."""
        self._node.poll()
        self._planner.send_plans()
        env = self._feature.env
        if self._has_topics and env is not None and self._published_version != self._feature.version:
            self._published_version = self._feature.version
            self._publish(env)

    def _publish(self, env: ClipsEnvironment) -> None:
        with env.lock:  # the message is a snapshot, so that rules may fire while the message is sent
            message = make_knowledge_message(self._feature.make_expert(env))
        self._update_publisher.publish({})
        self._knowledge_publisher.publish(message)

    def close(self) -> None:
        self._planner.close()
