"""The nodes of PlanSys2's experts and planner, backed by the world model of an agent."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from msgspec import Struct

from cxbridge.closing import Closing
from cxbridge.errors import ConfigError
from cxbridge.events import Logger
from cxbridge.rights import right_of_frame
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.experts.answers import PROBLEM_SERVICES, ExpertService, answer, knowledge_message
from cxbridge_ros2.experts.definitions import KNOWLEDGE, NODES, TOPIC_DEPTH, UPDATE, services_of
from cxbridge_ros2.experts.domain import DOMAIN_SERVICES
from cxbridge_ros2.experts.nodes import NodeCodec
from cxbridge_ros2.experts.planner import PlanServer
from cxbridge_ros2.messages import Message
from cxbridge_ros2.names import check_topic
from cxbridge_ros2.node import Node, SendResponse
from cxbridge_ros2.problem_expert import ProblemExpertFeature
from cxbridge_ros2.qos import QosProfile
from cxbridge_ros2.settings import NodeSettings, locate_errors, read_node_section, to_list

if TYPE_CHECKING:
    from cxbridge.config import Configuration
    from cxbridge.executive.host.environment import ClipsEnvironment

SECTION: Final = "/ros2/experts"

_ALL: Final = "all"
_COMPONENT: Final = "the settings of the experts"

# error text of PlanSys2's nodes before they are configured
INACTIVE: Final = "Requesting service in non-active state"

_SERVICES: Final = {"problem": PROBLEM_SERVICES, "domain": DOMAIN_SERVICES}
_EMPTY_MESSAGE: Final[Mapping[str, Any]] = {}


class ExpertSettings(Struct, frozen=True):
    """The settings of experts.

    :param serve: keys of :data:`~cxbridge_ros2.experts.definitions.NODES`.
    """

    serve: tuple[str, ...]
    node: NodeSettings

    @classmethod
    def parse(cls, config: Configuration, folder: Path) -> ExpertSettings:
        """Read the settings.

        :param folder: the base of relative paths.
        :raises CxbridgeError: if a setting is invalid; with file and line.
        """
        values, node = read_node_section(config, SECTION, ("serve",), folder, _COMPONENT)
        names = [str(name) for name in to_list(values.get("serve", _ALL))]
        with locate_errors(config, SECTION):
            for name in names:
                if name not in (_ALL, *NODES):
                    raise ConfigError(
                        f"{_COMPONENT}: '{name}' is no service",
                        hint=did_you_mean(name, (_ALL, *NODES), f"there are: {', '.join((*NODES, _ALL))}"),
                    )
            if not names:
                raise ConfigError(f"{_COMPONENT}: nothing is served", hint="serve: all")
        return cls(tuple(NODES) if _ALL in names else tuple(dict.fromkeys(names)), node)


def _make_refusal(_request: Message, reason: str) -> Mapping[str, Any]:
    return {"success": False, "error_info": reason}


class ExpertServer(Closing):
    """Serves the world model of an environment: one node has the services of PlanSys2's three nodes.

    All work is done in :meth:`loop`, in the executive's thread, never while rules fire.

    :param namespace: the prefix of all names.
    :param node: a node with the rights of its clients; the caller closes the node.
    :param feature: the feature that knows the environment.
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
        for expert in settings.serve:
            for name, kind in services_of(expert, settings.node.distribution).items():
                self._serve(expert, namespace + name, kind)
        self._has_topics = "problem" in settings.serve
        if self._has_topics:
            latched = QosProfile(durability="transient_local", depth=TOPIC_DEPTH)
            topic, kind = UPDATE
            self._updates = node.create_publisher(namespace + topic, kind, QosProfile(depth=TOPIC_DEPTH))
            topic, kind = KNOWLEDGE
            self._knowledge = node.create_publisher(namespace + topic, kind, latched)

    def _serve(self, expert: str, name: str, kind: str) -> None:
        service_name = name.rpartition("/")[2]
        if expert == "planner":
            access = "plan"
            work = self._planner.plan if service_name == "get_plan" else self._planner.validate
        else:
            service = _SERVICES[expert][service_name]
            access, work = "change" if service.changes else "read", partial(self._answer, name, service)
        right = right_of_frame("ros2-experts", access)
        self._node.serve_later(check_topic(name), kind, work, right=right, make_refusal=_make_refusal)

    def _answer(self, name: str, service: ExpertService, request: Message, reply: SendResponse) -> None:
        env = self._feature.env
        if env is None:  # PlanSys2's nodes respond like this before they are configured
            reply({"exist": False} if "/exist_" in name else {"success": False, "error_info": INACTIVE})
            return
        with env.lock:
            response = answer(service, self._feature.make_expert(env), self._codec, request)
        if service.changes:
            outcome = "done" if response["success"] else response["error_info"]
            self._log.info(f"{name}: {outcome}")
        reply(response)

    def loop(self) -> None:
        """Answer requests, send finished plans, and publish changes, at most once a loop."""
        self._node.poll()
        self._planner.loop()
        env = self._feature.env
        if self._has_topics and env is not None and self._published_version != self._feature.version:
            self._published_version = self._feature.version
            self._publish(env)

    def _publish(self, env: ClipsEnvironment) -> None:
        with env.lock:  # the message is a snapshot: rules may fire while it is sent
            message = knowledge_message(self._feature.make_expert(env))
        self._updates.publish(_EMPTY_MESSAGE)
        self._knowledge.publish(message)

    def close(self) -> None:
        self._planner.close()
