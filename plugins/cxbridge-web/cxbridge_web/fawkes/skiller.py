"""Fawkes' REST API ``skiller``: the list of skills, the running skill, and commands to run or stop a skill.

A Skiller shows one graph at a time in its debug interface: the graph of a skill, the graph of the active
skill, or the list of all skills. So a request for a graph waits until the Skiller shows it, and requests take
turns.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal
from weakref import WeakKeyDictionary

import msgspec
from msgspec import UNSET, UnsetType

from cxbridge.blackboard.errors import NoWriterError
from cxbridge.rights import Right
from cxbridge_web.endpoint import ApiCall, ApiError, Endpoint, QueryParameter, TextReply
from cxbridge_web.models import Model, RequestBody

if TYPE_CHECKING:
    from cxbridge_web.host import WebHost

OWNER: Final = "SkillerRestApi"  # name of the reader in lists of the blackboard, as in Fawkes
_DEFAULT_SKILLER_ID: Final = "Skiller"
GRAPH_TIMEOUT_S: Final = 5.0  # time in which a Skiller must show a requested graph, as in Fawkes

# The limit of the name of a skill: the debug interface has a field of 32 bytes, with the final NUL.
MAX_NAME_BYTES: Final = 31

_READ_PERIOD_S: Final = 0.05  # time between two reads of the interface, as in Fawkes
_ACTIVE_ID: Final = "active"
_STATUS_NAMES: Final[dict[str, Any]] = {"S_RUNNING": "RUNNING", "S_FINAL": "FINAL", "S_FAILED": "FAILED"}


class SkillInfo(Model, kw_only=True):
    """The name of a skill."""

    name: str


class Skill(Model, kw_only=True):
    """A skill; for the active skill, also the state of its Skiller."""

    name: str
    graph: str | UnsetType = UNSET
    # as in Fawkes, the only name with a dash
    skill_string: str | UnsetType = msgspec.field(default=UNSET, name="skill-string")
    error: str | UnsetType = UNSET
    msg_id: int | UnsetType = UNSET
    exclusive_controller: str | UnsetType = UNSET
    status: Literal["INACTIVE", "FINAL", "RUNNING", "FAILED"] | UnsetType = UNSET


class SkillCall(RequestBody, kw_only=True):
    """The request to run a skill string."""

    skill_string: str


@dataclass(slots=True)
class _SharedGraph:
    """The graph that a Skiller shows; all clients share it.

    :ivar lock: held while a client requests a graph.
    :ivar last_graph: the last shown state machine of an executed skill. An idle Skiller loses that graph when
        a client requests another subject, such as the list of skills.
    """

    lock: threading.Lock = field(default_factory=threading.Lock)
    last_graph: str = ""


# The shared graphs of each host by Skiller id.
_shared_graphs: WeakKeyDictionary[WebHost, dict[str, _SharedGraph]] = WeakKeyDictionary()


@contextmanager
def _open_interfaces(call: ApiCall, *types: str) -> Iterator[list[Any]]:
    """Open interfaces of the requested Skiller.

    :raises ApiError: if the Skiller is unknown or does not run.
    """
    board, skiller = call.host.board, call.query.get("skiller") or _DEFAULT_SKILLER_ID
    if skiller != _DEFAULT_SKILLER_ID and not any(
        info.type == "SkillerInterface" and info.id == skiller for info in board.list_all()
    ):
        raise ApiError(404, f"The Skiller '{skiller}' does not exist")
    try:
        with ExitStack() as stack:
            # interface fields come from XML definitions, so they have no static type
            instances: list[Any] = [
                stack.enter_context(board.open_for_reading(name, skiller, owner=OWNER)) for name in types
            ]
            for instance in instances:
                instance.read()
            if not all(instance.has_writer for instance in instances):
                # the text of Fawkes' endpoints
                raise ApiError(503, "Behavior Engine plugin is not loaded")
            yield instances
    except NoWriterError as error:  # the Skiller has stopped during the request
        raise ApiError(503, "Behavior Engine plugin is not loaded") from error


def _show_graph(debug_interface: Any, subject: str) -> None:
    """Request a graph from the Skiller and wait for it.

    :raises ApiError: if the graph does not arrive in time, or the subject is too long to be requested.
    """
    deadline_s = time.monotonic() + GRAPH_TIMEOUT_S
    if len(subject.encode("utf-8", "surrogateescape")) <= MAX_NAME_BYTES:
        if debug_interface.graph_fsm != subject:
            _request_graph(debug_interface, subject)
        while (
            debug_interface.graph_fsm != subject
            and time.monotonic() < deadline_s
            and debug_interface.has_writer
        ):
            time.sleep(_READ_PERIOD_S)
            debug_interface.read()
    if debug_interface.graph_fsm != subject:
        raise ApiError(408, f"Did not receive '{subject}' in time from skiller")


@contextmanager
def _reserve_graph(call: ApiCall, debug_interface: Any) -> Iterator[_SharedGraph]:
    """Reserve the Skiller's debug interface for one client."""
    shared_graph = _shared_graphs.setdefault(call.host, {}).setdefault(debug_interface.id, _SharedGraph())
    with shared_graph.lock:
        debug_interface.read()
        _store_active_graph(shared_graph, debug_interface)
        yield shared_graph


def _store_active_graph(shared_graph: _SharedGraph, debug_interface: Any) -> None:
    """Store the state machine of the active skill if the Skiller shows it."""
    if debug_interface.graph_fsm == "ACTIVE" and debug_interface.graph:
        shared_graph.last_graph = str(debug_interface.graph)


def _request_graph(debug_interface: Any, subject: str) -> None:
    """Send the request for a graph: of a skill, ``LIST`` or ``ACTIVE``."""
    message = debug_interface.create_message("SetGraphMessage")
    message.graph_fsm = subject
    debug_interface.msgq_enqueue(message)


def _list_skills(call: ApiCall) -> list[SkillInfo]:
    with (
        _open_interfaces(call, "SkillerDebugInterface", "SkillerInterface") as (debug_interface, _),
        _reserve_graph(call, debug_interface),
    ):
        previous_subject = debug_interface.graph_fsm
        try:
            _show_graph(debug_interface, "LIST")
            names = str(debug_interface.graph).splitlines()
        finally:
            _request_graph(debug_interface, previous_subject)
    return [SkillInfo(name=name) for name in names]


def _get_skill(call: ApiCall) -> Skill:
    name = "ACTIVE" if call.path_values["id"] == _ACTIVE_ID else call.path_values["id"]
    with (
        _open_interfaces(call, "SkillerDebugInterface", "SkillerInterface") as (debug_interface, skiller),
        _reserve_graph(call, debug_interface) as shared_graph,
    ):
        _show_graph(debug_interface, name)
        _store_active_graph(shared_graph, debug_interface)
        if name != "ACTIVE":
            return Skill(name=debug_interface.graph_fsm, graph=debug_interface.graph)
        skiller.read()
        return Skill(
            name=debug_interface.graph_fsm,
            graph=shared_graph.last_graph,
            skill_string=skiller.skill_string,
            error=skiller.error,
            msg_id=skiller.msgid,
            exclusive_controller=skiller.exclusive_controller,
            status=_STATUS_NAMES.get(getattr(skiller.status, "name", ""), "INACTIVE"),
        )


def _check_control(skiller: Any) -> None:
    if skiller.exclusive_controller:
        raise ApiError(409, "Another thread is exclusive controller")


def _call_skill(call: ApiCall) -> Skill:
    skill_string = call.body.get("skill_string")
    if not isinstance(skill_string, str):
        raise ApiError(400, "Request lacks skill string")
    with _open_interfaces(call, "SkillerInterface") as (skiller,):
        max_bytes = skiller.maxlenof("skill_string") - 1  # the last byte is the NUL of a C string
        if len(skill_string.encode("utf-8", "replace")) > max_bytes or "\0" in skill_string:
            raise ApiError(400, f"A skill string must have at most {max_bytes} bytes, without NUL")
        _check_control(skiller)
        message = skiller.create_message("ExecSkillMessage")
        # a lone surrogate, which UTF-8 cannot encode, becomes a question mark
        message.skill_string = skill_string.encode("utf-8", "replace").decode()
        msgid = skiller.msgq_enqueue(message)
    return Skill(name=_ACTIVE_ID, msg_id=msgid)


def _stop_skill(call: ApiCall) -> TextReply:
    if call.path_values["id"] != _ACTIVE_ID:
        raise ApiError(400, "Only the 'active' skill can be stopped")
    with _open_interfaces(call, "SkillerInterface") as (skiller,):
        _check_control(skiller)
        # a Skiller obeys only its exclusive controller
        for name in ("AcquireControlMessage", "StopExecMessage", "ReleaseControlMessage"):
            skiller.msgq_enqueue(skiller.create_message(name))
    return TextReply("OK")


_SKILLER_QUERY: Final = (QueryParameter("skiller", "The id of a SkillerInterface; by default Skiller."),)
_SKILLER_ERRORS: Final = {404: "The Skiller does not exist", 503: "The Skiller is not running"}
_GRAPH_ERRORS: Final = {408: "The Skiller did not show the graph in time", **_SKILLER_ERRORS}
_CONTROL_ERRORS: Final = {
    400: "The request is invalid",
    409: "Another client has exclusive control of the Skiller",
    **_SKILLER_ERRORS,
}

ENDPOINTS: Final = (
    Endpoint(
        method="GET",
        path="/skiller/skills",
        handler=_list_skills,
        summary="The names of all skills.",
        reply=list[SkillInfo],
        query=_SKILLER_QUERY,
        errors=_GRAPH_ERRORS,
        runs_in_thread=True,
    ),
    Endpoint(
        method="GET",
        path="/skiller/skills/{id}",
        handler=_get_skill,
        summary="A skill with its graph; the id 'active' stands for the running skill.",
        reply=Skill,
        query=_SKILLER_QUERY,
        errors=_GRAPH_ERRORS,
        runs_in_thread=True,
    ),
    Endpoint(
        method="DELETE",
        path="/skiller/skills/{id}",
        handler=_stop_skill,
        summary="Stop the running skill; the only valid id is 'active'.",
        query=_SKILLER_QUERY,
        errors=_CONTROL_ERRORS,
        right=Right.CONTROL,
    ),
    Endpoint(
        method="POST",
        path="/skiller/call",
        handler=_call_skill,
        summary="Run a skill string.",
        reply=Skill,
        body=SkillCall,
        query=_SKILLER_QUERY,
        errors=_CONTROL_ERRORS,
        right=Right.CONTROL,
        is_skill=True,
    ),
)
