"""The operations on the facts and the agenda of a CLIPS environment; see docs/debugging.md."""

from __future__ import annotations

from itertools import islice
from typing import Annotated, Any, Final

from msgspec import Meta, Struct

from cxbridge.daemon.operations.operation import (
    NotFoundError,
    OperationContext,
    Operations,
    Route,
)
from cxbridge.errors import CxbridgeError
from cxbridge.rights import Right
from cxbridge_studio.debugger.agenda import read_activations
from cxbridge_studio.debugger.fact_editing import (
    assert_text,
    modify_fact,
    read_fact_texts,
    retract_fact,
    search_facts,
)
from cxbridge_studio.operations.environments import NamedEnvironment, find_environment, list_environment_names

OPERATIONS: Final = Operations()

MAX_ROWS: Final = 1000
"""The maximum number of facts or activations in a reply."""

_SLOTS_DESCRIPTION: Final = "An object with the names of slots and their new values as texts of CLIPS."
# The limit of a search in seconds, because the search holds the lock of CLIPS. The client sends a further
# request, which starts after the last searched fact.
_MAX_SEARCH_S: Final = 0.005
_DEFAULT_ENVIRONMENT: Final = "executive"
# The default of the environment over HTTP; RequestInterface requires the name.
_HTTP_DEFAULTS: Final = {"env": _DEFAULT_ENVIRONMENT}
_PATH: Final = "/cxbridge/facts"
_QUERY_DESCRIPTIONS: Final = {"env": "The name of a CLIPS environment; executive by default."}


class _FactsQuery(NamedEnvironment):
    template: str = ""
    limit: int = MAX_ROWS


class _FactSearch(NamedEnvironment):
    """The parameters of a search.

    :param words: a text that the facts contain.
    :param after: the index of the last fact that is not searched, e.g. the member ``after`` of a reply.
    """

    words: str = ""
    after: int = 0
    limit: int = MAX_ROWS


class _AgendaQuery(NamedEnvironment):
    limit: int = MAX_ROWS


class _FactText(NamedEnvironment):
    fact: str


class _FactReference(NamedEnvironment):
    index: int


class _SlotChanges(_FactReference):
    slots: Annotated[
        dict[str, str], Meta(description=_SLOTS_DESCRIPTION, extra_json_schema={"minProperties": 1})
    ]


class FactIndex(Struct):
    """The index of a fact."""

    index: int


def _check_environment(context: OperationContext, name: str) -> None:
    """Check the name of an environment in a query or a body.

    :raises NotFoundError: if the environment does not exist; with status 503 for the environment of the
        executive, since it is missing only while the executive is not running.
    """
    if name not in list_environment_names(context):
        if name == _DEFAULT_ENVIRONMENT:
            raise NotFoundError(f"No CLIPS environment named '{name}' found", 503)
        raise NotFoundError(f"Environment '{name}' is unknown")


def _assert_over_http(context: OperationContext, parameters: _FactText) -> FactIndex:
    _check_environment(context, parameters.env)
    # CLIPS would read only the text before a zero byte
    if "\0" in parameters.fact or not parameters.fact.lstrip().startswith("("):
        raise CxbridgeError(
            "A text of CLIPS cannot contain a zero byte"
            if "\0" in parameters.fact
            else "A fact begins with a parenthesis, e.g. (battery (level 3))"
        )
    return FactIndex(_assert_fact(context, parameters))


def _modify_over_http(context: OperationContext, parameters: _SlotChanges) -> FactIndex:
    _check_environment(context, parameters.env)
    # CLIPS would read only the text before the zero byte
    if any("\0" in text for pair in parameters.slots.items() for text in pair):
        raise CxbridgeError("A text of CLIPS cannot contain a zero byte")
    return FactIndex(_modify_fact(context, parameters))


def _retract_over_http(context: OperationContext, parameters: _FactReference) -> FactIndex:
    _check_environment(context, parameters.env)
    _retract_fact(context, parameters)
    return FactIndex(parameters.index)


def _make_fact_route(method: str, summary: str, bad_request: str, **settings: Any) -> Route[Any]:
    """Return a route for one fact.

    :param bad_request: the meaning of status 400.
    """
    errors = {400: bad_request, 404: "There is no such fact, or no such environment"}
    settings |= {"defaults": _HTTP_DEFAULTS, "query": _QUERY_DESCRIPTIONS}
    return Route(method, f"{_PATH}/{{index}}", summary, FactIndex, errors=errors, **settings)


@OPERATIONS.add("facts", Right.LOOK, _FactsQuery)
def _list_facts(context: OperationContext, parameters: _FactsQuery) -> list[tuple[int, str]]:
    env = find_environment(context, parameters.env)
    with env.lock:
        return list(islice(read_fact_texts(env, parameters.template), min(parameters.limit, MAX_ROWS)))


@OPERATIONS.add("find-facts", Right.LOOK, _FactSearch)
def _search_facts(context: OperationContext, parameters: _FactSearch) -> dict[str, Any]:
    env = find_environment(context, parameters.env)
    with env.lock:
        rows, last_index = search_facts(
            env, parameters.words, parameters.after, min(parameters.limit, MAX_ROWS), _MAX_SEARCH_S
        )
    return {"facts": rows, "after": last_index}  # `after` is None if no fact is left


@OPERATIONS.add("agenda", Right.LOOK, _AgendaQuery)
def _list_activations(context: OperationContext, parameters: _AgendaQuery) -> list[tuple[int, str, str]]:
    env = find_environment(context, parameters.env)
    with env.lock:
        return list(islice(read_activations(env), min(parameters.limit, MAX_ROWS)))


@OPERATIONS.add(
    "assert",
    Right.CONTROL,
    _FactText,
    Route(
        "POST",
        _PATH,
        "Assert a fact.",
        FactIndex,
        http_function=_assert_over_http,
        body="FactText",
        defaults=_HTTP_DEFAULTS,
        errors={400: "CLIPS rejects the fact", 404: "There is no such environment"},
    ),
)
def _assert_fact(context: OperationContext, parameters: _FactText) -> int:
    env = find_environment(context, parameters.env)
    with env.lock:
        return assert_text(env, parameters.fact, constants_only=not context.rights.programs)


@OPERATIONS.add(
    "retract",
    Right.CONTROL,
    _FactReference,
    _make_fact_route(
        "DELETE", "Retract a fact.", "The index is not a number", http_function=_retract_over_http
    ),
)
def _retract_fact(context: OperationContext, parameters: _FactReference) -> None:
    env = find_environment(context, parameters.env)
    with env.lock:
        retract_fact(env, parameters.index)


@OPERATIONS.add(
    "modify",
    Right.CONTROL,
    _SlotChanges,
    _make_fact_route(
        "PATCH",
        "Change slots of a fact, which gets a new index.",
        "The fact has no such slot, or the slot cannot have the value",
        http_function=_modify_over_http,
        body="SlotTexts",
    ),
)
def _modify_fact(context: OperationContext, parameters: _SlotChanges) -> int:
    env = find_environment(context, parameters.env)
    with env.lock:
        return modify_fact(
            env, parameters.index, parameters.slots, constants_only=not context.rights.programs
        )
