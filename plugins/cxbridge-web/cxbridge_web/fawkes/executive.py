"""The component ``clips-executive``: goals, plans, and the domain."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from functools import partial
from typing import Any, Final

from cxbridge.clipstext.goal_slots import GOAL_SLOTS, GoalSlot
from cxbridge.executive.host.facts.copying import FactCopy
from cxbridge_web.endpoint import API_VERSION, ApiCall, ApiError, Endpoint
from cxbridge_web.fawkes import formulas
from cxbridge_web.fawkes.slots import (
    ENVIRONMENT,
    SlotError,
    Slots,
    copy,
    facts,
    flag,
    integer,
    number,
    text,
    texts,
)
from cxbridge_web.models import FAWKES_SLOTS, NUMBERS, goal_member
from cxbridge_web.paging import ListPart

Model = dict[str, Any]
Make = Callable[[Slots], Model]

COMPONENT: Final = "ClipsExecutiveRestApi"
"""Under which Fawkes' plugin logs."""


def _model(kind: str, **members: Any) -> Model:
    """Return a model; names have dashes where the members have underscores."""
    named = {name.replace("_", "-"): value for name, value in members.items()}
    return {"kind": kind, "apiVersion": API_VERSION, **named}


def _readable(call: ApiCall, noun: str, found: Iterable[Slots], make: Make) -> list[Model]:
    """Return the models of facts; those that cannot be read are left out, and reported."""
    models = []
    for slots in found:
        try:
            models.append(make(slots))
        except SlotError as error:
            call.host.bus.logger(COMPONENT).warn(f"Failed to add {noun}: {error}")
    return models


# -- goals


def _plans_of_goals(call: ApiCall) -> dict[str, list[str]]:
    plans: dict[str, list[str]] = {}
    for slots in facts(call, "plan"):
        try:
            plans.setdefault(text(slots, "goal-id"), []).append(text(slots, "id"))
        except SlotError:
            continue  # as Fawkes does: it belongs to no goal
    return plans


def _goal(plans: dict[str, list[str]], slots: Slots) -> Model:
    members = {
        goal_member(slot): _value(slot, slots)
        for slot in GOAL_SLOTS
        if slot.name in FAWKES_SLOTS or slot.name in slots
    }
    return _model("Goal", plans=plans.get(text(slots, "id"), []), **members)


def _value(slot: GoalSlot, slots: Slots) -> Any:
    if slot.is_multi:
        return texts(slots, slot.name)
    if slot.name == "priority":
        return integer(slots, slot.name)  # as Fawkes does
    return number(slots, slot.name) if slot.type in NUMBERS else text(slots, slot.name)


def _goals(call: ApiCall) -> list[Model]:
    return _readable(call, "goal", facts(call, "goal"), partial(_goal, _plans_of_goals(call)))


def _one_goal(call: ApiCall) -> Model:
    wanted = call.path["id"]
    found = (slots for slots in facts(call, "goal") if slots.get("id") == wanted)
    for goal in _readable(call, "goal", found, partial(_goal, _plans_of_goals(call))):
        return goal
    raise ApiError(400, f"Goal '{wanted}' is unknown")


# -- the domain


def _operators(call: ApiCall) -> list[Model]:
    params: dict[str, list[Model]] = {}
    for slots in facts(call, "domain-operator-parameter"):
        param = {"name": text(slots, "name"), "type": text(slots, "type")}
        params.setdefault(text(slots, "operator"), []).append(param)

    def make(slots: Slots) -> Model:
        name = text(slots, "name")
        return _model(
            "DomainOperator",
            name=name,
            wait_sensed=flag(slots, "wait-sensed"),
            parameters=params.get(name, []),
        )

    return _readable(call, "operator", facts(call, "domain-operator"), make)


def _object(slots: Slots) -> Model:
    return _model("DomainObject", name=text(slots, "name"), type=text(slots, "type"))


def _predicate(slots: Slots) -> Model:
    return _model(
        "DomainPredicate",
        name=text(slots, "name"),
        sensed=flag(slots, "sensed"),
        param_names=texts(slots, "param-names"),
        param_types=texts(slots, "param-types"),
    )


def _fact(slots: Slots) -> Model:
    return _model("DomainFact", name=text(slots, "name"), param_values=texts(slots, "param-values"))


# -- plans


def _plan(actions: dict[tuple[str, str], list[Model]], slots: Slots) -> Model:
    key = (text(slots, "goal-id"), text(slots, "id"))
    return _model(
        "Plan",
        id=key[1],
        goal_id=key[0],
        cost=float(number(slots, "cost")),
        actions=sorted(actions.get(key, []), key=lambda action: int(action["id"])),
    )


def _action(known: formulas.Known, slots: Slots) -> Model:
    name = text(slots, "action-name")
    model = _model(
        "PlanAction",
        id=integer(slots, "id"),
        operator_name=name,
        param_values=texts(slots, "param-values"),
        duration=float(number(slots, "duration")),
        dispatch_time=float(number(slots, "dispatch-time")),
        state=text(slots, "state"),
        executable=flag(slots, "executable"),
    )
    grounding = known.groundings.get(text(slots, "precondition"))
    if grounding is not None:
        model["precondition"] = _grounding(grounding)
    model["effects"] = []
    if grounding is not None and (tree := formulas.tree(known, name, grounding)) is not None:
        model["preconditions"] = tree
    return model


def _plans(call: ApiCall) -> list[Model]:
    known = formulas.Known.of(call)
    actions: dict[tuple[str, str], list[Model]] = {}

    def add(slots: Slots) -> Model:
        key, action = (text(slots, "goal-id"), text(slots, "plan-id")), _action(known, slots)
        actions.setdefault(key, []).append(action)
        return action

    _readable(call, "plan action", facts(call, "plan-action"), add)
    plans = _readable(call, "plan", facts(call, "plan"), partial(_plan, actions))
    return sorted(plans, key=lambda plan: (plan["goal-id"], plan["id"]))


def _one_plan(call: ApiCall) -> Model:
    goal_id, plan_id = call.path["goal_id"], call.path["id"]
    for plan in _plans(call):
        if (plan["goal-id"], plan["id"]) == (goal_id, plan_id):
            return plan
    raise ApiError(400, f"No plan for goal '{goal_id}' with ID '{plan_id}' found")


# -- formulas


def _grounding(slots: Slots) -> Model:
    return _model(
        "PDDLGrounding",
        id=text(slots, "id"),
        param_names=texts(slots, "param-names"),
        param_values=texts(slots, "param-values"),
    )


def _formula(slots: Slots) -> Model:
    return _model(
        "PDDLFormula", id=text(slots, "id"), type=text(slots, "type"), part_of=text(slots, "part-of")
    )


def _pddl_predicate(slots: Slots) -> Model:
    return _model(
        "PDDLPredicate",
        id=text(slots, "id"),
        part_of=text(slots, "part-of"),
        predicate=text(slots, "predicate"),
        param_names=texts(slots, "param-names"),
        param_constants=texts(slots, "param-constants"),
    )


def _grounded_formula(slots: Slots) -> Model:
    return _model(
        "GroundedPDDLFormula",
        id=text(slots, "id"),
        formula_id=text(slots, "formula-id"),
        grounding=text(slots, "grounding"),
        is_satisfied=flag(slots, "is-satisfied"),
    )


def _grounded_predicate(slots: Slots) -> Model:
    return _model(
        "GroundedPDDLPredicate",
        id=text(slots, "id"),
        predicate_id=text(slots, "predicate-id"),
        grounding=text(slots, "grounding"),
        is_satisfied=flag(slots, "is-satisfied"),
    )


# -- endpoints


def _listing(path: str, kind: str, template: str, noun: str, make: Make) -> Endpoint:
    def copy_part(call: ApiCall) -> Generator[None, None, FactCopy]:
        return copy(call, ENVIRONMENT, template.__eq__, window=call.window)

    def handler(call: ApiCall) -> Any:
        models = _readable(call, noun, facts(call, template), make)
        return models if call.window.search else ListPart(models, call.facts.total)

    return _get(path, kind, f"All facts {template}.", handler, (template,), many=True, copy=copy_part)


def _single(path: str, kind: str, template: str, noun: str, make: Make) -> Endpoint:
    def handler(call: ApiCall) -> Model:
        wanted = call.path["id"]
        found = (slots for slots in facts(call, template) if slots.get("id") == wanted)
        for model in _readable(call, noun, found, make):
            return model
        raise ApiError(400, f"No {noun} with ID '{wanted}' found")

    errors = {400: f"There is no such {noun}"}
    return _get(f"{path}/{{id}}", kind, f"One fact {template}.", handler, (template,), errors=errors)


def _get(
    path: str,
    kind: str,
    about: str,
    handler: Callable[[ApiCall], Any],
    templates: tuple[str, ...],
    *,
    many: bool = False,
    **more: Any,
) -> Endpoint:
    """Return an endpoint whose handler gets copies of the facts of these deftemplates."""
    more.setdefault("copy", lambda call: copy(call, ENVIRONMENT, templates.__contains__))
    return Endpoint(
        method="GET",
        path=f"/clips-executive{path}",
        handler=handler,
        about=about,
        reply=kind,
        many=many,
        paged=many,
        **more,
    )


_GOALS: Final = ("goal", "plan")
_OPERATORS: Final = ("domain-operator", "domain-operator-parameter")
_PLANS: Final = ("plan", "plan-action", *formulas.TEMPLATES)

_PDDL: Final[Sequence[tuple[str, str, str, str, Make]]] = (
    ("/pddl-groundings", "PDDLGrounding", "pddl-grounding", "grounding", _grounding),
    ("/pddl-predicates", "PDDLPredicate", "pddl-predicate", "predicate", _pddl_predicate),
    ("/pddl-formulas", "PDDLFormula", "pddl-formula", "formula", _formula),
    (
        "/grounded-pddl-predicates",
        "GroundedPDDLPredicate",
        "grounded-pddl-predicate",
        "grounded predicate",
        _grounded_predicate,
    ),
    (
        "/grounded-pddl-formulas",
        "GroundedPDDLFormula",
        "grounded-pddl-formula",
        "grounded formula",
        _grounded_formula,
    ),
)

ENDPOINTS: Final = (
    _get("/goals", "Goal", "All goals.", _goals, _GOALS, many=True),
    _get("/goals/{id}", "Goal", "One goal.", _one_goal, _GOALS, errors={400: "There is no such goal"}),
    _get(
        "/domain-operators",
        "DomainOperator",
        "All operators of the domain.",
        _operators,
        _OPERATORS,
        many=True,
    ),
    _listing("/domain-objects", "DomainObject", "domain-object", "object", _object),
    _listing("/domain-predicates", "DomainPredicate", "domain-predicate", "predicate", _predicate),
    _listing("/domain-facts", "DomainFact", "domain-fact", "fact", _fact),
    _get("/plans", "Plan", "All plans with their actions.", _plans, _PLANS, many=True),
    _get(
        "/plans/{goal-id}/{id}", "Plan", "One plan.", _one_plan, _PLANS, errors={400: "There is no such plan"}
    ),
    *(_listing(*row) for row in _PDDL),
    *(_single(*row) for row in _PDDL),
    # where Fawkes has it
    _single("/grounded-pddl-groundings", *_PDDL[-1][1:]),
)
"""All of the component, in Fawkes' order."""
