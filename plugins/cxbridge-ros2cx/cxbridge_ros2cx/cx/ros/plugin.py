"""The base class of ROS plug-ins, and the endpoints that rules open through them.

Endpoints are publishers, subscriptions, clients and servers, each with a fact. A generated plug-in
has one type and its own prefix; functions of the plug-in ``ros_msgs`` take the type as an argument. The texts
of log lines are those of the original.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from copy import deepcopy
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

from msgspec import Struct

from cxbridge.errors import ClipsError, Ros2Error
from cxbridge.executive.host.values import ExternalAddress, Value
from cxbridge_ros2.names import parse_type
from cxbridge_ros2cx.cx.plugin import CxPlugin
from cxbridge_ros2cx.cx.ros.messages import Addresses, FieldError

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge_ros2.names import TypeName
    from cxbridge_ros2cx.cx.ros.messages import MessageTable
    from cxbridge_ros2cx.cx.ros.node import RosNode

STRING: Final = "(type STRING)"
ADDRESS: Final = "(type EXTERNAL-ADDRESS)"
INTEGER: Final = "(type INTEGER)"
SYMBOL: Final = "(type SYMBOL)"
FLOAT: Final = "(type FLOAT)"

# name, function, and CLIPS' codes for the types of the arguments, separated by ``;``
Definition = tuple[str, Callable[..., Value], str]

T = TypeVar("T")


class Handles(Generic[T]):
    """Objects by their addresses in rules.

    :param kind: the kind of the objects, for errors.
    :param first: the first address. The ranges of different kinds differ, so a mixed-up handle is unknown.
    """

    def __init__(self, kind: str, first: int) -> None:
        self._kind = kind
        self._addresses = Addresses(first)
        self._objects: dict[ExternalAddress, T] = {}

    def add(self, item: T) -> ExternalAddress:
        address = self._addresses.take()
        self._objects[address] = item
        return address

    def find(self, address: ExternalAddress) -> T:
        if address not in self._objects:
            raise ClipsError(f"Unknown {self._kind}")
        return self._objects[address]

    def destroy(self, address: ExternalAddress) -> None:
        """Remove an object; unknown addresses are ignored."""
        if self._objects.pop(address, None) is not None:
            self._addresses.free(address)


class RosPlugin(CxPlugin):
    """A plug-in with functions and facts for messages.

    :ivar endpoints: the topics, services and actions of the plug-in.
    """

    endpoints: tuple[Endpoints, ...] = ()
    has_waiting = False  # whether requests or goals wait for a server: if none does, a loop calls no endpoint

    @property
    def ros(self) -> RosNode:
        return self.context.ros

    @property
    def messages(self) -> MessageTable:
        return self.context.ros.messages

    def tick(self) -> None:
        """Send requests and goals that were waiting for their server."""
        if self.has_waiting:
            waits = [endpoints.tick() for endpoints in self.endpoints]
            self.has_waiting = any(waits)

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Close the environment's open endpoints."""
        for endpoints in self.endpoints:
            endpoints.close(env)

    def template(self, env: ClipsEnvironment, name: str, /, **slots: str) -> None:
        """Define a deftemplate unless the name is taken.

        :param slots: the attributes of each slot; ``_`` in its name becomes ``-``.
        """
        if not env.has_template(name):
            text = " ".join(f"(slot {slot.replace('_', '-')} {kind})" for slot, kind in slots.items())
            env.build(f"(deftemplate {name} {text})")

    def add_fact(self, env: ClipsEnvironment, template: str, slots: Mapping[str, Value]) -> int | None:
        """Assert a fact of a message for the next run of the rules."""
        with env.lock:
            return env.assert_fact(template, slots)

    def define(
        self, env: ClipsEnvironment, name: str, function: Callable[..., Value], types: str, result: str = "*"
    ) -> None:
        """Define a function; a ROS error becomes an error of the calling rule.

        :param types: the types of the arguments, separated by ``;``.
        """

        def call(*arguments: Value) -> Value:
            try:
                return function(*arguments)
            except Ros2Error as error:
                raise ClipsError(str(error)) from None

        count = len(types.split(";")) if types else 0
        env.define(name, call, count, types=f"{result};{types}" if types else result)

    def define_all(self, env: ClipsEnvironment, prefix: str, functions: Iterable[Definition]) -> None:
        """Define functions whose names begin with a prefix."""
        for name, function, types in functions:
            self.define(env, f"{prefix}{name}", function, types)

    # --- messages -----------------------------------------------------------------------------------------

    def define_message(
        self,
        env: ClipsEnvironment,
        prefix: str,
        kind: TypeName,
        create: str,
        destroy: str,
    ) -> None:
        """Define the message functions of a generated plug-in."""

        def get(address: ExternalAddress, field: str) -> Value:
            try:
                return self.messages.get(address, field)
            except FieldError:
                raise ClipsError(f"cannot retrieve unknown slot name {field}") from None

        functions: tuple[Definition, ...] = (
            (create, lambda: self.messages.create(kind), ""),
            (destroy, self.messages.destroy, "e"),
            ("get-field", get, "e;sy"),
            ("set-field", self.messages.set, "e;sy;*"),
        )
        self.define_all(env, prefix, functions)


# --- endpoints ----------------------------------------------------------------------------------------------


class Endpoint(Struct, eq=False):
    """An endpoint of an environment.

    :param kind: the type of its messages, its service or its action.
    :param fact: the index of its fact.
    """

    kind: TypeName
    close: Callable[[], None]
    fact: int | None


E = TypeVar("E", bound=Endpoint)


class EndpointTable(Generic[E]):
    """The endpoints of a kind by environment and name.

    :param noun: the kind, for log lines about endpoints that an environment leaves open.
    :param unknown: the log line about an unknown name, with ``{name}`` and ``{env}``.
    :param keeps_facts: whether the fact of a closed endpoint stays, as in some plug-ins of the original.
    """

    def __init__(self, plugin: RosPlugin, noun: str, unknown: str, *, keeps_facts: bool = False) -> None:
        self._plugin, self._noun, self._unknown = plugin, noun, unknown
        self._keeps_facts = keeps_facts
        self._endpoints: dict[tuple[str, str], E] = {}

    def __setitem__(self, key: tuple[ClipsEnvironment, str], endpoint: E) -> None:
        env, name = key
        self._endpoints[env.name, str(name)] = endpoint

    def get(self, env: ClipsEnvironment, name: str) -> E | None:
        return self._endpoints.get((env.name, str(name)))

    def items(self) -> list[tuple[str, E]]:
        """Return names and endpoints of all environments."""
        return [(name, endpoint) for (_, name), endpoint in self._endpoints.items()]

    def end(self, env: ClipsEnvironment, name: str) -> None:
        """Close an endpoint; an unknown one is logged."""
        endpoint = self._endpoints.pop((env.name, str(name)), None)
        if endpoint is None:
            self._plugin.log.warn(self._unknown.format(name=name, env=env.name))
            return
        endpoint.close()
        if endpoint.fact is not None and not self._keeps_facts:
            env.retract(endpoint.fact)

    def close(self, env: ClipsEnvironment) -> None:
        """Close the endpoints that an environment has left open, with a warning."""
        for owner, name in list(self._endpoints):
            if owner == env.name:
                self._endpoints.pop((owner, name)).close()
                self._plugin.log.warn(f"Environment {env.name} has open {name} {self._noun}, cleaning up ...")


class Endpoints(ABC):
    """A group of functions, templates and endpoints of a plug-in.

    :param prefix: the prefix of functions and templates: ``ros-msgs-``.
    :param kind: the type of all endpoints; None if functions take the type as an argument.
    """

    def __init__(self, plugin: RosPlugin, prefix: str, kind: TypeName | None = None) -> None:
        self.plugin, self.prefix, self.kind = plugin, prefix, kind

    @abstractmethod
    def define(self, env: ClipsEnvironment) -> None:
        """Define functions and templates in an environment."""

    def tick(self) -> bool:
        """Send the messages whose servers have appeared; return whether further messages still wait."""
        return False

    @abstractmethod
    def close(self, env: ClipsEnvironment) -> None:
        """Close the endpoints of an environment."""

    def type_of(self, text: str | None, kind: str = "msg") -> TypeName:
        """Return the type of a new endpoint, from the argument of a function if there is one."""
        return self.kind if self.kind is not None else parse_type(str(text), kind)

    def type_slot(self, text: str | None) -> dict[str, Value]:
        """Return the slot ``type`` of the fact, which only plug-ins of many types have."""
        return {"type": str(text)} if self.kind is None else {}


class ClientEndpoint(Endpoint):
    """A client of a service or an action.

    :param waiting: requests or goals that wait for the server.
    """

    env: ClipsEnvironment
    client: Any
    waiting: list[Mapping[str, Any]]


C = TypeVar("C", bound=ClientEndpoint)


class ClientEndpoints(Endpoints, Generic[C]):
    """Clients, whose requests or goals may wait for a server.

    :cvar noun: ``service`` or ``action``.
    :cvar server: the noun for the server in log lines.
    :cvar sent: the message that a client sends: ``Request`` or ``Goal``.
    """

    noun: str
    server: str
    sent: str
    clients: EndpointTable[C]

    def find(self, env: ClipsEnvironment, name: str) -> C:
        client = self.clients.get(env, name)
        if client is None:
            raise ClipsError(f"there is no client of {name}: create a client of the {self.noun} first")
        return client

    def fields(self, client: C, message: ExternalAddress, name: str) -> Mapping[str, Any]:
        """Return the fields of a message after a check of its type."""
        view = self.plugin.messages.find(message)
        if view.kind != client.kind.derive(self.sent):
            raise ClipsError(f"the {self.noun} {name} has the type {client.kind}, the message {view.kind}")
        return view.fields

    def send(self, env: ClipsEnvironment, message: ExternalAddress, name: str) -> None:
        """Send a message as soon as a server exists."""
        client = self.find(env, name)
        fields = self.fields(client, message, name)
        if client.client.has_server and not client.waiting:
            self.call(str(name), client, fields)
            return
        if not client.waiting:
            self.plugin.log.warn(f"{self.server} {name} not available, start waiting")
        # a copy: rules may change or destroy the message before the server appears
        client.waiting.append(deepcopy(fields))
        self.plugin.has_waiting = True

    def tick(self) -> bool:
        """Send the messages whose servers have appeared; return whether further messages still wait."""
        for name, client in self.clients.items():
            if client.waiting and client.client.has_server:
                self.plugin.log.info(f"{self.server} {name} is finally reachable")
                while client.waiting:
                    self.call(name, client, client.waiting.pop(0))
        return any(client.waiting for _, client in self.clients.items())

    @abstractmethod
    def call(self, name: str, client: C, fields: Mapping[str, Any]) -> object:
        """Send a message to the server."""

    def close(self, env: ClipsEnvironment) -> None:
        self.clients.close(env)
