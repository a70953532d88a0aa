"""The values of interfaces, messages to their writers, and the navigation graphs."""

from __future__ import annotations

from typing import Any, Final

from msgspec import Struct

from cxbridge.interfaces.assignments import set_field
from cxbridge.rights import Right
from cxbridge_web.endpoint import ApiCall, ApiError, Endpoint, QueryParameter
from cxbridge_web.fawkes.blackboard import InterfaceData, find_interface, read_all_data
from cxbridge_web.models import Model

_OWNER: Final = "cxbridge web"  # name of the reader that sends messages


class NavGraph(Model, kw_only=True):
    """A navigation graph."""

    graph: str
    nodes: dict[str, Any]
    edges: dict[str, Any]


class MessageText(Struct):
    """A message to the writer of an interface."""

    type: str
    fields: dict[str, Any] = {}


class MessageId(Model, kw_only=True):
    """The id of a sent message."""

    msgid: int


def _list_navgraphs(call: ApiCall) -> list[NavGraph]:
    """Return the models of the loaded navigation graphs."""
    return [
        NavGraph(graph=event.graph, nodes=dict(event.nodes), edges=dict(event.edges))
        for event in call.server.navgraphs.list_graphs()
    ]


def _list_interfaces(call: ApiCall) -> list[InterfaceData]:
    infos = call.host.board.list(call.query.get("type") or "*", call.query.get("id") or "*")
    return read_all_data(call, infos)


def _send_message(call: ApiCall) -> MessageId:
    interface_type, interface_id = call.path_values["type"], call.path_values["id"]
    message_name, fields = call.text("type"), call.body.get("fields", {})
    if not isinstance(fields, dict):
        raise ApiError(400, "'fields' must be an object with the values of the fields by name")
    if find_interface(call) is None:
        raise ApiError(404, f"The interface {interface_type}::{interface_id} does not exist")
    board = call.host.board
    # A client may omit the suffix of a message's name.
    full_name = message_name if message_name.endswith("Message") else f"{message_name}Message"
    call.host.rights.check_message(interface_type, full_name)
    with board.open_for_reading(interface_type, interface_id, owner=_OWNER) as instance:
        message = instance.create_message(
            message_name if message_name in instance.MESSAGES else f"{message_name}Message"
        )
        for field, value in fields.items():
            try:
                set_field(message, field, tuple(value) if isinstance(value, list) else value)
            except (TypeError, ValueError, OverflowError) as error:
                raise ApiError(
                    400, f"The field '{field}' of {message_name} cannot have this value: {error}"
                ) from error
        return MessageId(msgid=instance.msgq_enqueue(message))


ENDPOINTS: Final = (
    Endpoint(
        method="GET",
        path="/cxbridge/navgraphs",
        handler=_list_navgraphs,
        summary="The navigation graphs that skills and rules use. Positions of nodes are in metres.",
        reply=list[NavGraph],
        runs_in_thread=True,
    ),
    Endpoint(
        method="GET",
        path="/cxbridge/interfaces",
        handler=_list_interfaces,
        summary="The values of the interfaces that match.",
        reply=list[InterfaceData],
        query=(
            QueryParameter("type", "A shell pattern for the type; by default all types."),
            QueryParameter("id", "A shell pattern for the id; by default all ids."),
        ),
    ),
    Endpoint(
        method="POST",
        path="/cxbridge/blackboard/{type}/{id+}/messages",
        handler=_send_message,
        summary="Send a message to the writer of an interface.",
        reply=MessageId,
        body=MessageText,
        errors={
            400: "The message or a field does not exist, or the interface has no writer",
            404: "The interface does not exist",
        },
        right=Right.CONTROL,
    ),
)
