"""The endpoints of cxbridge besides operations: status, rules, agenda, interfaces, commands.

A handler reads the executive and the blackboard in the main loop. The reading of files and the models of long
lists follow in the server's thread, in ``finish``.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from msgspec import UNSET, Meta, Struct, UnsetType
from msgspec.structs import replace

from cxbridge.daemon.operations.answers import ComponentState, StopInfo
from cxbridge.daemon.operations.rules import stop_info
from cxbridge.interfaces.assignments import set_field
from cxbridge.rights import Right
from cxbridge_web.constructs import Construct, SourceConstructs
from cxbridge_web.endpoint import ApiCall, ApiError, Endpoint, Handler, Query
from cxbridge_web.fawkes.blackboard import InterfaceData, data_models, find
from cxbridge_web.fawkes.slots import ENVIRONMENT, environment
from cxbridge_web.models import Model
from cxbridge_web.paging import ListPart, matches
from cxbridge_web.rules import Activation, Rule, agenda, census, rules

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.space.navgraph.emitting import NavGraphs
    from cxbridge_web.event_collector import EventCollector
    from cxbridge_web.event_streams import EventStreams


ANSWER_S: Final = 10.0  # time limit of an explanation in seconds

OWNER: Final = "cxbridge web"
_LONGEST_NAME: Final = 250  # bytes of a subject's name, which becomes a message on the blackboard
_WHY_KINDS: Final = {
    "rule": "Name of a rule.",
    "goal": "Id or class of a goal.",
    "action": "Goal and id of a plan-action: GOAL/ID.",
    "fact": "Index of a fact: f-12.",
}


State = Literal["STARTING", "RUNNING", "PAUSED", "DEGRADED", "STOPPING", "FINISHED"]


class LoopState(Struct):
    """How often the main loop has run, and its period."""

    count: int
    period_us: int


class EnvironmentSize(Struct):
    """The numbers of a CLIPS environment: facts, rules, activations."""

    name: str
    facts: int
    rules: int
    agenda: int


class WebState(Struct):
    """The clients that follow events, the events, and the events that were dropped."""

    clients: int
    events: int
    dropped: int


class RunEnd(Struct):
    """How a run ended."""

    status: Annotated[int, Meta(description="the exit status")]
    word: Annotated[str, Meta(description="`completed` or another word")]
    reason: str


class Status(Model, kw_only=True):
    """How a daemon or a run stands; without environments while the main loop is stuck."""

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
    result: Annotated[RunEnd | UnsetType, Meta(description="of a run that is FINISHED")] = UNSET
    remote_control: bool
    remote_programs: bool
    environments: list[EnvironmentSize]
    web: WebState
    stalled: Annotated[str, Meta(description="why the main loop does not come to its end")]
    stopped: Annotated[StopInfo | UnsetType, Meta(description="while the rules are stopped")] = UNSET


class Health(Model, kw_only=True):
    """Whether all is well."""

    state: State
    error: str


class NavGraph(Model, kw_only=True):
    """A navigation graph."""

    graph: str
    nodes: dict[str, Any]
    edges: dict[str, Any]


class Answer(Model, kw_only=True):
    """Why a rule has not fired, or how a goal came to its outcome."""

    lines: list[str]
    data: dict[str, Any]


class MessageText(Struct):
    """A message to the writer of an interface."""

    type: str
    fields: dict[str, Any] = {}


class MessageId(Model, kw_only=True):
    """The id of a message that was sent."""

    msgid: int


class ServerState:
    """The state of the web server.

    :param streams: the clients that follow events.
    :param collector: counts the firings of rules while a client follows them.
    :param navgraphs: the loaded navigation graphs.
    """

    def __init__(self, streams: EventStreams, collector: EventCollector, navgraphs: NavGraphs) -> None:
        self.streams = streams
        self.collector = collector
        self.navgraphs = navgraphs
        self.constructs = SourceConstructs()

    def describe_navgraphs(self, _call: ApiCall) -> list[NavGraph]:
        """Return the models of the loaded navigation graphs."""
        return [
            NavGraph(graph=event.graph, nodes=dict(event.nodes), edges=dict(event.edges))
            for event in self.navgraphs.all()
        ]

    def status(self, call: ApiCall) -> Status:
        """Return the status as far as any thread can read it: without environments."""
        return Status(
            **call.host.status(),
            remote_control=call.host.rights.control,
            remote_programs=call.host.rights.programs,
            environments=[],
            web=WebState(self.streams.clients, self.streams.count, self.streams.dropped),
            stalled=call.host.stall,
        )

    def describe_constructs(
        self, _call: ApiCall, selection: tuple[tuple[str, ...], str, str, bool]
    ) -> list[Construct]:
        """Return the models of the constructs that :func:`_constructs` selects."""
        files, kinds, names, with_text = selection
        constructs = self.constructs.of(files).values()
        selected = [
            construct
            for construct in constructs
            if matches(construct.construct, kinds) and matches(construct.name, names)
        ]
        return selected if with_text else [replace(construct, text=UNSET) for construct in selected]


def _environment(call: ApiCall) -> ClipsEnvironment:
    """Return the environment of the query.

    :raises ApiError: 503 if the executive does not run, 404 for another unknown environment.
    """
    name = call.query.get("env") or ENVIRONMENT
    return environment(call, name, 503 if name == ENVIRONMENT else 404)


# -- CLIPS


def _agenda(call: ApiCall) -> ListPart:
    env = _environment(call)
    with env.lock:
        return agenda(env, call.query.get("rule", ""), call.window)


def _rules(call: ApiCall) -> tuple[str, list[Rule], tuple[str, ...]]:
    env, pattern = _environment(call), call.query.get("name", "")
    with env.lock:
        rows = [row for row in rules(env) if matches(row.name, pattern)]
        return env.name, rows, tuple(map(str, env.loader.files))


def _constructs(call: ApiCall) -> tuple[tuple[str, ...], str, str, bool]:
    """Return the query's selection: files, patterns of kind and name, whether to include texts."""
    env, query = _environment(call), call.query
    with env.lock:
        files = tuple(map(str, env.loader.files))
    return files, query.get("construct", ""), query.get("name", ""), query.get("text") == "true"


def _why(call: ApiCall) -> Answer:
    subjects = [(kind, call.query[kind]) for kind in _WHY_KINDS if kind in call.query]
    if len(subjects) > 1 or not all(name for _, name in subjects):
        raise ApiError(400, "Name one thing: ?rule=NAME, ?goal=NAME, ?action=GOAL/ID or ?fact=f-12")
    kind, name = subjects[0] if subjects else ("run", "")
    if "\0" in name or len(name.encode("utf-8", "replace")) > _LONGEST_NAME:
        raise ApiError(400, "There is nothing of such a name")
    explanation = call.host.why(name, kind, ANSWER_S)
    if explanation is None:
        raise ApiError(503, f"There was no answer within {ANSWER_S:g} s")
    return Answer(lines=explanation["lines"], data=explanation["data"])


# -- interfaces


def _interfaces(call: ApiCall) -> list[InterfaceData]:
    types, ids = call.query.get("type", ""), call.query.get("id", "")
    infos = call.host.board.list_all()
    return data_models(call, [info for info in infos if matches(info.type, types) and matches(info.id, ids)])


def _send(call: ApiCall) -> MessageId:
    name, fields = call.text("type"), call.body.get("fields", {})
    if not isinstance(fields, dict):
        raise ApiError(400, "'fields' must be an object: the fields' values by name")
    if find(call) is None:
        raise ApiError(404, f"There is no interface {call.path['type']}::{call.path['id']}")
    board = call.host.board
    call.host.rights.check_message(call.path["type"], name if name.endswith("Message") else f"{name}Message")
    with board.open_for_reading(call.path["type"], call.path["id"], owner=OWNER) as instance:
        # A client may leave out the suffix of a message's name.
        message = instance.create_message(name if name in instance.MESSAGES else f"{name}Message")
        for field, value in fields.items():
            try:
                set_field(message, field, tuple(value) if isinstance(value, list) else value)
            except (TypeError, ValueError, OverflowError) as error:
                raise ApiError(400, f"{name} cannot have this in '{field}': {error}") from error
        return MessageId(msgid=instance.msgq_enqueue(message))


def _health(call: ApiCall) -> Health:
    host_status = call.host.status()
    health = Health(state=host_status["state"], error=host_status["error"] or call.host.stall)
    if health.state not in {"RUNNING", "PAUSED"}:
        raise ApiError(503, health.error, health)
    return health


def _status(state: ServerState, call: ApiCall) -> Status:
    """Return the status with environments; called in the main loop's thread."""
    status = state.status(call)
    status.environments = [
        EnvironmentSize(name, **census(env)) for name, env in sorted(call.host.environments().items())
    ]
    executive = call.host.executive
    if executive is not None:
        status.stopped = stop_info(executive.control) or UNSET
    return status


def _interrupt(state: ServerState, call: ApiCall) -> Status:
    """Stop the running rules and return the status."""
    call.host.interrupt()
    return state.status(call)


def _describe_rules(
    state: ServerState, _call: ApiCall, query_result: tuple[str, list[Rule], tuple[str, ...]]
) -> list[Rule]:
    """Return the models of the rules that :func:`_rules` returns."""
    env, rules_of_environment, files = query_result
    constructs = state.constructs.of(files)
    for rule in rules_of_environment:
        if (construct := constructs.get(("defrule", rule.name))) is not None:
            rule.file, rule.line, rule.core = construct.file, construct.line, construct.core
        if state.collector.counts_firings:
            rule.firings = state.collector.firings[env, rule.name]
    return rules_of_environment


_ENVIRONMENT: Final = Query("env", "Name of a CLIPS environment; executive by default.")
_NO_ENVIRONMENT: Final = {404: "There is no such environment"}


def endpoints(state: ServerState) -> Sequence[Endpoint]:
    """Return the endpoints below ``/api/cxbridge``."""
    return (*_status_endpoints(state), *_rule_endpoints(state), *_interface_endpoints(state))


def _get(path: str, handler: Handler, about: str, reply: Any, **options: Any) -> Endpoint:
    return Endpoint(
        method="GET", path=f"/cxbridge{path}", handler=handler, about=about, reply=reply, **options
    )


def _command(state: ServerState, verb: str, about: str) -> Endpoint:
    def carry_out(call: ApiCall) -> Status:
        call.host.command(verb)
        return _status(state, call)

    return Endpoint(
        method="POST",
        path=f"/cxbridge/{verb}",
        handler=carry_out,
        about=about,
        reply=Status,
        right=Right.CONTROL,
    )


def _status_endpoints(state: ServerState) -> Sequence[Endpoint]:
    """Return the endpoints for the daemon's status and commands."""
    return (
        _get(
            "/status",
            partial(_status, state),
            "How the daemon and its components stand; without environments while the main loop is stuck.",
            Status,
            stalled=state.status,
        ),
        _get(
            "/health",
            _health,
            "The state in short; answered even when the main loop is stuck.",
            Health,
            errors={503: "Something is not well: it says what"},
            in_thread=True,
        ),
        Endpoint(
            method="POST",
            path="/cxbridge/interrupt",
            handler=partial(_interrupt, state),
            about="End the rules' work at this moment, as an error in a rule does.",
            reply=Status,
            right=Right.CONTROL,
            in_thread=True,
        ),
        _command(state, "pause", "Deactivate the components that work."),
        _command(state, "resume", "Activate inactive components."),
        _command(state, "reset", "Take the components that work down, and start them again."),
    )


def _rule_endpoints(state: ServerState) -> Sequence[Endpoint]:
    """Return the endpoints for rules, constructs, agenda and explanations."""
    return (
        _get(
            "/rules",
            _rules,
            "All rules: their places, the number of their activations.",
            list[Rule],
            paged=True,
            query=(_ENVIRONMENT, Query("name", "A pattern of their names.")),
            finish=partial(_describe_rules, state),
            errors=_NO_ENVIRONMENT,
        ),
        _get(
            "/constructs",
            _constructs,
            "The constructs of the loaded files: their places, owners and texts.",
            list[Construct],
            query=(
                _ENVIRONMENT,
                Query("construct", "A pattern: defrule, deftemplate ..."),
                Query("name", "A pattern of their names."),
                Query("text", "With their texts.", bool),
            ),
            finish=state.describe_constructs,
            errors=_NO_ENVIRONMENT,
        ),
        _get(
            "/agenda",
            _agenda,
            "The activations, in the order of firing.",
            list[Activation],
            paged=True,
            query=(_ENVIRONMENT, Query("rule", "A pattern of the rules' names.")),
            errors=_NO_ENVIRONMENT,
        ),
        _get(
            "/why",
            _why,
            "Why a rule has not fired, a goal or an action came to its outcome, a fact exists; without a "
            "query the story of the run.",
            Answer,
            query=tuple(Query(kind, about) for kind, about in _WHY_KINDS.items()),
            errors={400: "There is no such thing"},
            in_thread=True,
        ),
    )


def _interface_endpoints(state: ServerState) -> Sequence[Endpoint]:
    """Return the endpoints for the blackboard and navigation graphs."""
    return (
        _get(
            "/navgraphs",
            state.describe_navgraphs,
            "The navigation graphs that skills and rules use: nodes in metres, edges.",
            list[NavGraph],
            in_thread=True,
        ),
        _get(
            "/interfaces",
            _interfaces,
            "The values of all interfaces.",
            list[InterfaceData],
            query=(Query("type", "A pattern of types."), Query("id", "A pattern of ids.")),
        ),
        Endpoint(
            method="POST",
            path="/cxbridge/blackboard/{type}/{id+}/messages",
            handler=_send,
            about="Send a message to the writer of an interface.",
            reply=MessageId,
            body=MessageText,
            errors={
                400: "There is no such message or field, or no writer",
                404: "There is no such interface",
            },
            right=Right.CONTROL,
        ),
    )
