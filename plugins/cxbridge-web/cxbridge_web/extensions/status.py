"""The status of a daemon or a run, and the commands that pause, resume, reset or interrupt it."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from msgspec import UNSET, Meta, Struct, UnsetType

from cxbridge.daemon.operations.replies import ComponentState, StopInfo
from cxbridge.daemon.operations.rules import stop_info
from cxbridge.rights import Right
from cxbridge_web.endpoint import ApiCall, ApiError, Endpoint
from cxbridge_web.models import Model
from cxbridge_web.rules import count_items

State = Literal["STARTING", "RUNNING", "PAUSED", "DEGRADED", "STOPPING", "FINISHED"]


class LoopState(Struct):
    """The number of loops that the main loop has run, and its period."""

    count: int
    period_us: int


class EnvironmentSize(Struct):
    """The numbers of facts, rules and activations of a CLIPS environment."""

    name: str
    facts: int
    rules: int
    agenda: int


class WebState(Struct):
    """The number of clients that follow the events."""

    clients: int


class RunEnd(Struct):
    """The result of a run."""

    status: Annotated[int, Meta(description="the exit status")]
    # the member is part of the published API, as in the result of `cxbridge run`
    word: Annotated[
        str,
        Meta(description="`completed`, `unsuccessful`, `stuck`, `timed out`, `bad input` or `fault`"),
    ]
    reason: str


class Status(Model, kw_only=True):
    """The status of a daemon or a run. While the main loop is stuck, the list of environments is empty."""

    state: State
    version: str
    pid: int
    started_us: int
    now_us: int
    clock: str
    endpoints: list[str]
    error: str
    loop: LoopState
    components: list[ComponentState]
    result: Annotated[RunEnd | UnsetType, Meta(description="only of a run in the state FINISHED")] = UNSET
    remote_control: bool
    remote_programs: bool
    environments: list[EnvironmentSize]
    web: WebState
    stalled: Annotated[str, Meta(description="the reason why the main loop is stuck; empty if it is not")]
    stopped: Annotated[StopInfo | UnsetType, Meta(description="only while the rules are stopped")] = UNSET


class Health(Model, kw_only=True):
    """The state and the error of a daemon or a run."""

    state: State
    error: str


def _get_status_without_environments(call: ApiCall) -> Status:
    """Return the status without environments and stop, which only the main loop's thread can read."""
    return Status(
        **call.host.status(),
        remote_control=call.host.rights.control,
        remote_programs=call.host.rights.programs,
        environments=[],
        web=WebState(call.server.streams.client_count),
        stalled=call.host.stall_reason,
    )


def _get_status(call: ApiCall) -> Status:
    """Return the status with environments; called in the main loop's thread."""
    status = _get_status_without_environments(call)
    status.environments = [
        EnvironmentSize(name, **count_items(env)) for name, env in sorted(call.host.environments().items())
    ]
    executive = call.host.executive
    if executive is not None:
        status.stopped = stop_info(executive.control) or UNSET
    return status


def _get_health(call: ApiCall) -> Health:
    host_status = call.host.status()
    health = Health(state=host_status["state"], error=host_status["error"] or call.host.stall_reason)
    if health.state not in {"RUNNING", "PAUSED"}:
        raise ApiError(503, health.error, health)
    return health


def _interrupt_rules(call: ApiCall) -> Status:
    """Stop the running rules and return the status without environments."""
    call.host.interrupt()  # in a thread, since the main loop waits for the rules
    return _get_status_without_environments(call)


def _make_command_endpoint(verb: str, summary: str) -> Endpoint:
    def run_command(call: ApiCall) -> Status:
        call.host.run_command(verb)
        return _get_status(call)

    return Endpoint(
        method="POST",
        path=f"/cxbridge/{verb}",
        handler=run_command,
        summary=summary,
        reply=Status,
        right=Right.CONTROL,
    )


ENDPOINTS: Final = (
    Endpoint(
        method="GET",
        path="/cxbridge/status",
        handler=_get_status,
        summary="The status of the daemon and its components. While the main loop is stuck, the list of "
        "environments is empty.",
        reply=Status,
        stalled_handler=_get_status_without_environments,
    ),
    Endpoint(
        method="GET",
        path="/cxbridge/health",
        handler=_get_health,
        summary="The state of the daemon; available even while the main loop is stuck.",
        reply=Health,
        errors={503: "The state is neither RUNNING nor PAUSED; the reply has the error"},
        runs_in_thread=True,
    ),
    Endpoint(
        method="POST",
        path="/cxbridge/interrupt",
        handler=_interrupt_rules,
        summary="Stop the rules that are running now, as an error in a rule does.",
        reply=Status,
        right=Right.CONTROL,
        runs_in_thread=True,
    ),
    _make_command_endpoint("pause", "Deactivate the active components."),
    _make_command_endpoint("resume", "Activate the inactive components."),
    _make_command_endpoint("reset", "Stop the active components and start them again."),
)
