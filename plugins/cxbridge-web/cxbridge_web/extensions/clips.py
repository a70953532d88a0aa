"""Rules and constructs of CLIPS environments, and explanations of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from msgspec import UNSET
from msgspec.structs import replace

from cxbridge_web.constructs import Construct, find_constructs
from cxbridge_web.endpoint import ApiCall, ApiError, Endpoint, QueryParameter, matches
from cxbridge_web.fawkes.slots import DEFAULT_ENVIRONMENT, find_environment
from cxbridge_web.models import Model
from cxbridge_web.rules import Rule, list_rules

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

_ANSWER_TIMEOUT_S: Final = 10.0  # time limit of an explanation
# limit of a subject's name, which is sent to the explainer in a field of 256 bytes
_MAX_NAME_BYTES: Final = 250
_WHY_QUERIES: Final = {
    "rule": "The name of a rule.",
    "goal": "The id or the class of a goal.",
    "action": "The goal and the id of a plan-action: GOAL/ID.",
    "fact": "The index of a fact: f-12.",
}
_ENVIRONMENT_QUERY: Final = QueryParameter("env", "The name of a CLIPS environment; by default executive.")
_ENVIRONMENT_ERRORS: Final = {404: "The environment does not exist"}


class Answer(Model, kw_only=True):
    """The explanation of a rule, a goal, a plan-action, a fact or the run."""

    lines: list[str]
    data: dict[str, Any]


def _find_environment(call: ApiCall) -> ClipsEnvironment:
    """Return the environment of the query.

    :raises ApiError: 503 if the executive does not run, 404 for another unknown environment.
    """
    name = call.query.get("env") or DEFAULT_ENVIRONMENT
    return find_environment(call, name, 503 if name == DEFAULT_ENVIRONMENT else 404)


def _copy_rules(call: ApiCall) -> tuple[str, list[Rule], tuple[str, ...]]:
    """Return the name of the environment, its selected rules, and its loaded files."""
    env, pattern = _find_environment(call), call.query.get("name", "")
    with env.lock:
        rules = [rule for rule in list_rules(env) if matches(rule.name, pattern)]
        return env.name, rules, tuple(map(str, env.loader.files))


def _describe_rules(call: ApiCall, rules_and_files: tuple[str, list[Rule], tuple[str, ...]]) -> list[Rule]:
    """Return the rules of :func:`_copy_rules` with their locations and firings."""
    env, rules, files = rules_and_files
    constructs = find_constructs(files)
    for rule in rules:
        if (construct := constructs.get(("defrule", rule.name))) is not None:
            rule.file, rule.line, rule.core = construct.file, construct.line, construct.core
        if call.server.collector.counts_firings:
            rule.firings = call.server.collector.firings[env, rule.name]
    return rules


def _select_constructs(call: ApiCall) -> tuple[tuple[str, ...], str, str, bool]:
    """Return the selection of the query: files, patterns of kind and name, whether to include texts."""
    env, query = _find_environment(call), call.query
    with env.lock:
        files = tuple(map(str, env.loader.files))
    return files, query.get("construct", ""), query.get("name", ""), query.get("text") == "true"


def _describe_constructs(
    _call: ApiCall, selection: tuple[tuple[str, ...], str, str, bool]
) -> list[Construct]:
    """Return the constructs that :func:`_select_constructs` selects."""
    files, kind_pattern, name_pattern, includes_text = selection
    constructs = find_constructs(files).values()
    selected_constructs = [
        construct
        for construct in constructs
        if matches(construct.construct, kind_pattern) and matches(construct.name, name_pattern)
    ]
    return (
        selected_constructs
        if includes_text
        else [replace(construct, text=UNSET) for construct in selected_constructs]
    )


def _explain(call: ApiCall) -> Answer:
    subjects = [(kind, call.query[kind]) for kind in _WHY_QUERIES if kind in call.query]
    if len(subjects) > 1 or not all(name for _, name in subjects):
        raise ApiError(400, "Name one subject: ?rule=NAME, ?goal=NAME, ?action=GOAL/ID or ?fact=f-12")
    kind, name = subjects[0] if subjects else ("run", "")
    if "\0" in name or len(name.encode("utf-8", "replace")) > _MAX_NAME_BYTES:
        raise ApiError(400, "No object has this name")
    explanation = call.host.explain(name, kind, _ANSWER_TIMEOUT_S)
    if explanation is None:
        raise ApiError(503, f"The explanation did not arrive within {_ANSWER_TIMEOUT_S:g} s")
    return Answer(lines=explanation["lines"], data=explanation["data"])


ENDPOINTS: Final = (
    Endpoint(
        method="GET",
        path="/cxbridge/rules",
        handler=_copy_rules,
        summary="All rules with their locations and the numbers of their activations.",
        reply=list[Rule],
        query=(_ENVIRONMENT_QUERY, QueryParameter("name", "A pattern of the names.")),
        finish=_describe_rules,
        errors=_ENVIRONMENT_ERRORS,
    ),
    Endpoint(
        method="GET",
        path="/cxbridge/constructs",
        handler=_select_constructs,
        summary="The constructs of the loaded files with their locations, owners and texts.",
        reply=list[Construct],
        query=(
            _ENVIRONMENT_QUERY,
            QueryParameter("construct", "A pattern of the kinds: defrule, deftemplate ..."),
            QueryParameter("name", "A pattern of the names."),
            QueryParameter("text", "Whether to include the texts of the constructs.", bool),
        ),
        finish=_describe_constructs,
        errors=_ENVIRONMENT_ERRORS,
    ),
    Endpoint(
        method="GET",
        path="/cxbridge/why",
        handler=_explain,
        summary="The reason why a rule has not fired, why a goal or an action has its outcome, or why a "
        "fact exists; without a query, the story of the run.",
        reply=Answer,
        query=tuple(QueryParameter(kind, description) for kind, description in _WHY_QUERIES.items()),
        errors={400: "The query names more than one subject, or an unknown subject"},
        runs_in_thread=True,
    ),
)
