"""Operations on the facts and the agenda of a CLIPS environment; docs/debugging.md."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import islice
from typing import TYPE_CHECKING, Annotated, Any, Final

from msgspec import Meta, Struct

from cxbridge.daemon.operations.operation import (
    NamedEnvironment,
    NotFoundError,
    OperationContext,
    Operations,
    Route,
    environment_names,
    find_environment,
)
from cxbridge.errors import CxbridgeError
from cxbridge.executive.host.agenda import agenda
from cxbridge.executive.host.capi import NULL
from cxbridge.executive.host.facts.editing import (
    assert_text,
    fact_texts,
    find_facts,
    modify_fact,
    retract_fact,
)
from cxbridge.rights import Right

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

OPERATIONS: Final = Operations()

MOST_ROWS: Final = 1000
"""The maximal number of facts or activations in a reply."""

_SLOTS: Final = "an object: texts of CLIPS by the names of slots"
_SEARCH_S: Final = 0.005  # seconds of one request's search, which holds the lock of CLIPS
_MOST_DIGITS: Final = 18  # digits that fit 64 bits
_DEFAULT: Final = "executive"
_GIVEN: Final = {"env": _DEFAULT}
_PATH: Final = "/cxbridge/facts"
_QUERY: Final = {"env": "Name of a CLIPS environment; executive by default."}


class _Facts(NamedEnvironment):
    template: str = ""
    limit: int = MOST_ROWS


class _Search(NamedEnvironment):
    words: str = ""
    after: int = 0
    limit: int = MOST_ROWS


class _Agenda(NamedEnvironment):
    limit: int = MOST_ROWS


class _Fact(NamedEnvironment):
    fact: str


class _Index(NamedEnvironment):
    index: int


class _Slots(_Index):
    slots: Annotated[dict[str, str], Meta(description=_SLOTS, extra_json_schema={"minProperties": 1})]


class FactIndex(Struct):
    """The index of a fact."""

    index: int


# over HTTP: the index of a fact as an object, and 404 for an unknown one


def _environment(context: OperationContext, name: str) -> ClipsEnvironment:
    if name not in environment_names(context):
        if name == _DEFAULT:
            raise NotFoundError(f"No CLIPS environment named '{name}' found", 503)
        raise NotFoundError(f"Environment '{name}' is unknown")
    return find_environment(context, name)


def _check_index(_context: OperationContext, path: Mapping[str, str]) -> None:
    text = path["index"]
    if not text.isdecimal() or not text.isascii() or len(text) > _MOST_DIGITS:
        raise CxbridgeError("The index of a fact is a number")


def _assert_there(context: OperationContext, given: _Fact) -> FactIndex:
    _environment(context, given.env)
    if "\0" in given.fact or not given.fact.lstrip().startswith("("):
        raise CxbridgeError("A fact begins with a parenthesis, e.g. (battery (level 3))")
    return FactIndex(_assert(context, given))


def _modify_there(context: OperationContext, given: _Slots) -> FactIndex:
    env = _environment(context, given.env)
    if any("\0" in text for pair in given.slots.items() for text in pair):
        raise CxbridgeError("CLIPS has no such text")
    with env.lock:
        if env.maker.find(given.index) == NULL:
            raise NotFoundError(f"There is no fact f-{given.index}")
        return FactIndex(_modify(context, given))


def _retract_there(context: OperationContext, given: _Index) -> FactIndex:
    env = _environment(context, given.env)
    with env.lock:
        if not env.retract(given.index):
            raise NotFoundError(f"There is no fact f-{given.index}")
    return FactIndex(given.index)


def _of_one(method: str, about: str, wrong: str, **more: Any) -> Route[Any]:
    path, errors = f"{_PATH}/{{index}}", {400: wrong, 404: "There is no such fact, or environment"}
    more |= {"check": _check_index, "given": _GIVEN, "query": _QUERY, "errors": errors}
    return Route(method, path, about, FactIndex, **more)


@OPERATIONS.add("facts", Right.LOOK, _Facts, at_prompt=True)
def _facts(context: OperationContext, given: _Facts) -> list[tuple[int, str]]:
    env = find_environment(context, given.env)
    with env.lock:
        return list(islice(fact_texts(env, given.template), min(given.limit, MOST_ROWS)))


@OPERATIONS.add("find-facts", Right.LOOK, _Search, at_prompt=True)
def _find_facts(context: OperationContext, given: _Search) -> dict[str, Any]:
    env = find_environment(context, given.env)
    with env.lock:
        rows, after = find_facts(env, given.words, given.after, min(given.limit, MOST_ROWS), _SEARCH_S)
    return {"facts": rows, "after": after}


@OPERATIONS.add("agenda", Right.LOOK, _Agenda, at_prompt=True)
def _agenda(context: OperationContext, given: _Agenda) -> list[tuple[int, str, str]]:
    env = find_environment(context, given.env)
    with env.lock:
        return list(islice(agenda(env), min(given.limit, MOST_ROWS)))


@OPERATIONS.add(
    "assert",
    Right.CONTROL,
    _Fact,
    Route(
        "POST",
        _PATH,
        "Assert a fact.",
        FactIndex,
        instead=_assert_there,
        body="FactText",
        given=_GIVEN,
        errors={400: "CLIPS refuses it", 404: "There is no such environment"},
    ),
    at_prompt=True,
)
def _assert(context: OperationContext, given: _Fact) -> int:
    env = find_environment(context, given.env)
    with env.lock:
        return assert_text(env, given.fact, constant=not context.rights.programs)


@OPERATIONS.add(
    "retract",
    Right.CONTROL,
    _Index,
    _of_one("DELETE", "Retract a fact.", "That is not an index", instead=_retract_there),
    at_prompt=True,
)
def _retract(context: OperationContext, given: _Index) -> None:
    env = find_environment(context, given.env)
    with env.lock:
        retract_fact(env, given.index)


@OPERATIONS.add(
    "modify",
    Right.CONTROL,
    _Slots,
    _of_one(
        "PATCH",
        "Give slots of a fact other values; it gets a new index.",
        "It has no such slot, or cannot have the value",
        instead=_modify_there,
        body="SlotTexts",
    ),
    at_prompt=True,
)
def _modify(context: OperationContext, given: _Slots) -> int:
    env = find_environment(context, given.env)
    with env.lock:
        return modify_fact(env, given.index, given.slots, constant=not context.rights.programs)
