"""The base class of ROS plug-ins, and the endpoints that rules open through plug-ins.

Endpoints are publishers, subscriptions, clients and servers, each with a fact. A generated plug-in is for one
ROS type, whose name is in the prefix of its functions. The functions of the plug-in ``ros_msgs`` take the
type as an argument. Log lines have the texts of the ROS 2 CX, carologistics/clips_executive.
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
from cxbridge_ros2cx.cx.ros.messages import FieldError, count_addresses

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
FunctionDefinition = tuple[str, Callable[..., Value], str]

ObjectT = TypeVar("ObjectT")


class HandleTable(Generic[ObjectT]):
    """Objects by their handles: the external addresses that rules have for the objects.

    :param noun: the noun for an object in errors.
    :param first_address: the lowest address. Each table has a separate range, so a handle of another table is
        unknown.
    """

    def __init__(self, noun: str, first_address: int) -> None:
        self._noun = noun
        self._addresses = count_addresses(first_address)
        self._objects_by_address: dict[ExternalAddress, ObjectT] = {}

    def add(self, new_object: ObjectT) -> ExternalAddress:
        address = next(self._addresses)
        self._objects_by_address[address] = new_object
        return address

    def find(self, address: ExternalAddress) -> ObjectT:
        """Return the object at an address.

        :raises ClipsError: if the address is unknown, e.g. after :meth:`destroy`.
        """
        if address not in self._objects_by_address:
            raise ClipsError(f"Unknown {self._noun}")
        return self._objects_by_address[address]

    def objects(self) -> list[ObjectT]:
        return list(self._objects_by_address.values())

    def destroy(self, address: ExternalAddress) -> None:
        """Remove an object; unknown addresses are ignored."""
        self._objects_by_address.pop(address, None)


class RosPlugin(CxPlugin):
    """A plug-in with functions and facts for messages.

    :ivar endpoint_groups: the topics, services and actions of the plug-in.
    """

    endpoint_groups: tuple[EndpointGroup, ...] = ()

    @property
    def ros(self) -> RosNode:
        return self.context.ros

    @property
    def messages(self) -> MessageTable:
        return self.context.ros.messages

    def tick(self) -> None:
        """Send the requests and goals whose servers have appeared."""
        for group in self.endpoint_groups:
            if isinstance(group, ClientGroup):
                group.send_waiting_messages()

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Close the environment's open endpoints."""
        for group in self.endpoint_groups:
            group.close(env)

    def define_template(self, env: ClipsEnvironment, name: str, /, **slots: str) -> None:
        """Define a deftemplate unless the environment has a deftemplate of this name.

        The first parameters are positional only, so that a slot may be called ``name``.

        :param slots: the attributes of each slot by its name, in which ``_`` stands for ``-``.
        """
        if not env.has_template(name):
            slots_text = " ".join(
                f"(slot {slot.replace('_', '-')} {attributes})" for slot, attributes in slots.items()
            )
            env.build(f"(deftemplate {name} {slots_text})")

    def assert_fact(self, env: ClipsEnvironment, template: str, slots: Mapping[str, Value]) -> int | None:
        """Assert a fact; return the index of this or of an equal fact, or None if CLIPS refuses the fact."""
        with env.lock:
            return env.assert_fact(template, slots)

    def define_function(
        self, env: ClipsEnvironment, name: str, function: Callable[..., Value], types: str
    ) -> None:
        """Define a function for rules; its ROS errors become errors of the calling rule.

        :param types: CLIPS' codes for the types of the arguments, separated by ``;``.
        """

        def call(*arguments: Value) -> Value:
            try:
                return function(*arguments)
            except Ros2Error as error:
                raise ClipsError(str(error)) from None

        argument_types = types.split(";") if types else []
        env.define(name, call, len(argument_types), types=";".join(("*", *argument_types)))

    def define_functions(
        self, env: ClipsEnvironment, prefix: str, functions: Iterable[FunctionDefinition]
    ) -> None:
        """Define functions whose names begin with a prefix."""
        for name, function, types in functions:
            self.define_function(env, f"{prefix}{name}", function, types)

    # --- messages -----------------------------------------------------------------------------------------

    def define_message(
        self,
        env: ClipsEnvironment,
        prefix: str,
        type_name: TypeName,
        create_name: str,
        destroy_name: str,
    ) -> None:
        """Define the functions of a generated plug-in that create, read, change and destroy messages.

        :param create_name: the name of the function that creates a message, without the prefix.
        :param destroy_name: the name of the function that destroys a message, without the prefix.
        """

        def get_field(address: ExternalAddress, field: str) -> Value:
            try:
                return self.messages.get(address, field)
            except FieldError:
                raise ClipsError(f"cannot retrieve unknown slot name {field}") from None

        self.define_functions(
            env,
            prefix,
            (
                (create_name, lambda: self.messages.create(type_name), ""),
                (destroy_name, self.messages.destroy, "e"),
                ("get-field", get_field, "e;sy"),
                ("set-field", self.messages.set, "e;sy;*"),
            ),
        )


# --- endpoints ----------------------------------------------------------------------------------------------


class Endpoint(Struct, eq=False):
    """An endpoint of an environment.

    :param type_name: the type of the messages, the service or the action.
    :param close: closes the endpoint.
    """

    type_name: TypeName
    close: Callable[[], None]


EndpointT = TypeVar("EndpointT", bound=Endpoint)


class EndpointTable(Generic[EndpointT]):
    """The endpoints of a kind by environment and name; their group closes them.

    :param noun: the noun for an endpoint in log lines.
    :param unknown_text: the log line about an unknown name, with ``{name}`` and ``{env}``.
    :param keeps_facts: whether the fact of a closed endpoint stays, as in some plug-ins of the ROS 2 CX.
    """

    def __init__(
        self, group: EndpointGroup, noun: str, unknown_text: str, *, keeps_facts: bool = False
    ) -> None:
        self._plugin, self._noun, self._unknown_text = group.plugin, noun, unknown_text
        self._keeps_facts = keeps_facts
        group.tables.append(self)
        # endpoints and the indices of their facts by environment and name; None: CLIPS has refused the fact
        self._endpoints: dict[tuple[str, str], EndpointT] = {}
        self._fact_indices: dict[tuple[str, str], int | None] = {}

    def add(
        self,
        env: ClipsEnvironment,
        name: str,
        endpoint: EndpointT,
        template: str,
        slots: Mapping[str, Value],
    ) -> None:
        """Assert the fact of an open endpoint, and store the endpoint."""
        self._fact_indices[env.name, str(name)] = self._plugin.assert_fact(env, template, slots)
        self._endpoints[env.name, str(name)] = endpoint

    def get(self, env: ClipsEnvironment, name: str) -> EndpointT | None:
        return self._endpoints.get((env.name, str(name)))

    def items(self) -> list[tuple[str, EndpointT]]:
        """Return the endpoints of all environments, each with its name."""
        return [(name, endpoint) for (_, name), endpoint in self._endpoints.items()]

    def close_endpoint(self, env: ClipsEnvironment, name: str) -> None:
        """Close an endpoint, and retract its fact unless facts stay; warn if the endpoint is unknown."""
        endpoint = self._endpoints.pop((env.name, str(name)), None)
        if endpoint is None:
            self._plugin.log.warn(self._unknown_text.format(name=name, env=env.name))
            return
        endpoint.close()
        fact_index = self._fact_indices.pop((env.name, str(name)))
        if fact_index is not None and not self._keeps_facts:
            env.retract(fact_index)

    def close(self, env: ClipsEnvironment) -> None:
        """Close the endpoints that an environment has left open, with a warning."""
        for env_name, name in list(self._endpoints):
            if env_name == env.name:
                self._endpoints.pop((env_name, name)).close()
                self._plugin.log.warn(f"Environment {env.name} has open {name} {self._noun}, cleaning up ...")


class EndpointGroup(ABC):
    """The functions, templates and endpoints of a plug-in for one kind of endpoint.

    :param prefix: the prefix of functions and templates, e.g. ``ros-msgs-``.
    :param type_name: the type of all endpoints; None if functions take the type as an argument.
    """

    def __init__(self, plugin: RosPlugin, prefix: str, type_name: TypeName | None = None) -> None:
        self.plugin, self.prefix, self.type_name = plugin, prefix, type_name
        self.tables: list[EndpointTable[Any]] = []

    @abstractmethod
    def define(self, env: ClipsEnvironment) -> None:
        """Define functions and templates in an environment."""

    def close(self, env: ClipsEnvironment) -> None:
        """Close the endpoints of an environment."""
        for table in self.tables:
            table.close(env)

    def resolve_type(self, type_text: str | None, kind: str = "msg") -> TypeName:
        """Return the type of a new endpoint: the plug-in's type, or the type in a function's argument."""
        return self.type_name if self.type_name is not None else parse_type(str(type_text), kind)

    def make_type_slot(self, type_text: str | None) -> dict[str, Value]:
        """Return the slot ``type`` of an endpoint's fact; a generated plug-in has no such slot."""
        return {"type": str(type_text)} if self.type_name is None else {}


class ClientEndpoint(Endpoint):
    """A client of a service or an action.

    :param ros_client: the `Client` or `ActionClient` of cxbridge_ros2.
    :param waiting_messages: the fields of requests or goals that wait for the server.
    """

    env: ClipsEnvironment
    ros_client: Any
    waiting_messages: list[Mapping[str, Any]] = []


ClientT = TypeVar("ClientT", bound=ClientEndpoint)


class ClientGroup(EndpointGroup, Generic[ClientT]):
    """Clients, whose requests or goals may wait for a server.

    :cvar client_noun: ``service`` or ``action``, for errors.
    :cvar server_noun: the noun for the server in log lines.
    :cvar message_section: the message that a client sends: ``Request`` or ``Goal``.
    """

    client_noun: str
    server_noun: str
    message_section: str
    clients: EndpointTable[ClientT]

    def find(self, env: ClipsEnvironment, name: str) -> ClientT:
        """Return an environment's client.

        :param name: the name of the service or action.
        :raises ClipsError: if there is no such client.
        """
        client = self.clients.get(env, name)
        if client is None:
            raise ClipsError(f"there is no client of {name}: create a client of the {self.client_noun} first")
        return client

    def find_fields(self, client: ClientT, message: ExternalAddress, name: str) -> Mapping[str, Any]:
        """Return the fields of the message at an address.

        :raises ClipsError: if the message has another type than the client.
        """
        view = self.plugin.messages.find(message)
        if view.type_name != client.type_name.derive(self.message_section):
            raise ClipsError(
                f"the {self.client_noun} {name} has the type {client.type_name}, the message {view.type_name}"
            )
        return view.fields

    def send(self, env: ClipsEnvironment, message: ExternalAddress, name: str) -> None:
        """Send a message at once, or as soon as a server exists."""
        client = self.find(env, name)
        fields = self.find_fields(client, message, name)
        if client.ros_client.has_server and not client.waiting_messages:
            self.call(str(name), client, fields)
            return
        if not client.waiting_messages:
            self.plugin.log.warn(f"{self.server_noun} {name} not available, start waiting")
        # a copy: rules may change or destroy the message before the server appears
        client.waiting_messages.append(deepcopy(fields))

    def send_waiting_messages(self) -> None:
        """Send the messages whose servers have appeared."""
        for name, client in self.clients.items():
            if client.waiting_messages and client.ros_client.has_server:
                self.plugin.log.info(f"{self.server_noun} {name} is finally reachable")
                while client.waiting_messages:
                    self.call(name, client, client.waiting_messages.pop(0))

    @abstractmethod
    def call(self, name: str, client: ClientT, fields: Mapping[str, Any]) -> object:
        """Send a message to the server.

        A subclass may return a value; callers that know only this class ignore the value.
        """
