"""Fawkes' REST API ``clips-executive``: goals, plans and the domain."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Annotated, Any, Final, TypeAlias, TypeVar

from msgspec import UNSET, Meta, Struct, UnsetType

from cxbridge.clipstext.goal_slots import GOAL_SLOTS, GoalSlot
from cxbridge.executive.host.facts.copying import FactCopy
from cxbridge_web.endpoint import ApiCall, ApiError, Endpoint
from cxbridge_web.fawkes import formulas
from cxbridge_web.fawkes.formulas import GroundedFormula, GroundedPredicate, PDDLGrounding
from cxbridge_web.fawkes.slots import (
    COPY_TIMEOUT_S,
    DEFAULT_ENVIRONMENT,
    SlotError,
    Slots,
    copy_facts,
    read_model,
    read_text,
)
from cxbridge_web.models import Model, define_model

_ModelT = TypeVar("_ModelT", bound=Model)

COMPONENT: Final = "ClipsExecutiveRestApi"  # log component of Fawkes' plugin


# The slots of goals in Fawkes' API. All cores have these slots, so the members are not optional.
_FAWKES_SLOTS: Final = frozenset(
    {
        *("id", "type", "sub-type", "class", "mode", "outcome", "error", "message", "parent", "priority"),
        *("params", "meta", "required-resources", "acquired-resources"),
    }
)


_SLOT_TYPES: Final[Mapping[str, type]] = {"INTEGER": int, "FLOAT": float}


def _make_goal_member(slot: GoalSlot) -> tuple[Any, ...]:
    """Return the name and the type of a goal slot's member, and the default of an optional member."""
    if slot.name == "params":
        return "parameters", Annotated[list[str], Meta(extra={"slot": slot.name})]
    name, member_type = slot.name.replace("-", "_"), _SLOT_TYPES.get(slot.type, str)
    if slot.name == "priority":
        member_type = int  # as in Fawkes, although the slot has a float
    member_type = list[str] if slot.is_multi else member_type
    return (name, member_type) if slot.name in _FAWKES_SLOTS else (name, member_type | UnsetType, UNSET)


Goal: Final = define_model(
    "Goal",
    "A goal with its plans: all slots of the deftemplate.",
    [("plans", list[str]), *map(_make_goal_member, GOAL_SLOTS)],
    rename="kebab",  # here and below: Fawkes' names of members have dashes
)


class DomainOperatorParameter(Struct):
    """A parameter of an operator."""

    name: str
    type: str


class DomainOperator(Model, kw_only=True, rename="kebab"):
    """An operator of the domain."""

    name: str
    wait_sensed: bool
    parameters: list[DomainOperatorParameter]


class PlanAction(Model, kw_only=True, rename="kebab"):
    """An action of a plan, with its precondition if the precondition is grounded."""

    id: int
    operator_name: Annotated[str, Meta(extra={"slot": "action-name"})]
    param_values: list[str]
    duration: float
    dispatch_time: float
    state: str
    executable: bool
    precondition: PDDLGrounding | UnsetType = UNSET
    effects: Sequence[dict[str, Any]] = ()  # always empty, as in Fawkes
    preconditions: GroundedFormula | GroundedPredicate | UnsetType = UNSET


class Plan(Model, kw_only=True, rename="kebab"):
    """A plan of a goal."""

    id: str
    goal_id: str
    cost: float
    actions: list[PlanAction]


def _make_models(
    call: ApiCall, noun: str, rows: Iterable[Slots], make_model: Callable[[Slots], _ModelT]
) -> list[_ModelT]:
    """Return the models of facts. An unreadable fact is logged and skipped, as goals are in Fawkes."""
    models = []
    for slots in rows:
        try:
            models.append(make_model(slots))
        except SlotError as error:
            call.host.bus.logger(COMPONENT).warn(f"Failed to add {noun}: {error}")
    return models


def _get_by_id(
    call: ApiCall,
    facts: FactCopy,
    noun: str,
    template: str,
    make_model: Callable[[Slots], Model],
    error: str,
) -> Model:
    """Return the model of the fact whose slot `id` has the id of the path.

    :param error: the text of the error, with a placeholder for the id.
    :raises ApiError: if no fact has the id, or the facts with the id are unreadable.
    """
    fact_id = call.path_values["id"]
    rows = (slots for slots in facts.facts_of(template) if slots.get("id") == fact_id)
    for model in _make_models(call, noun, rows, make_model):
        return model
    raise ApiError(400, error.format(fact_id))


# -- goals


def _find_plan_ids(facts: FactCopy) -> dict[str, list[str]]:
    """Return the ids of the plans of each goal."""
    plan_ids_by_goal: dict[str, list[str]] = {}
    for slots in facts.facts_of("plan"):
        with suppress(SlotError):  # as in Fawkes, a plan without a goal is skipped
            plan_ids = plan_ids_by_goal.setdefault(read_text(slots, "goal-id"), [])
            plan_ids.append(read_text(slots, "id"))
    return plan_ids_by_goal


def _make_goal(plan_ids_by_goal: dict[str, list[str]], slots: Slots) -> Model:
    return read_model(Goal, slots, plans=plan_ids_by_goal.get(read_text(slots, "id"), []))


def _list_goals(call: ApiCall, facts: FactCopy) -> list[Model]:
    return _make_models(call, "goal", facts.facts_of("goal"), partial(_make_goal, _find_plan_ids(facts)))


def _get_goal(call: ApiCall, facts: FactCopy) -> Model:
    make_goal = partial(_make_goal, _find_plan_ids(facts))
    return _get_by_id(call, facts, "goal", "goal", make_goal, "Goal '{}' is unknown")


# -- the domain


def _list_operators(call: ApiCall, facts: FactCopy) -> list[DomainOperator]:
    parameters_by_operator: dict[str, list[DomainOperatorParameter]] = {}
    # as in Fawkes, an unreadable parameter is an error of the whole request
    for slots in facts.facts_of("domain-operator-parameter"):
        parameter = DomainOperatorParameter(read_text(slots, "name"), read_text(slots, "type"))
        parameters_by_operator.setdefault(read_text(slots, "operator"), []).append(parameter)

    def make_model(slots: Slots) -> DomainOperator:
        parameters = parameters_by_operator.get(read_text(slots, "name"), [])
        return read_model(DomainOperator, slots, parameters=parameters)

    return _make_models(call, "operator", facts.facts_of("domain-operator"), make_model)


# -- plans


def _make_plan(actions_by_plan: dict[tuple[str, str], list[PlanAction]], slots: Slots) -> Plan:
    """Return the model of a plan.

    :param actions_by_plan: the actions, by the ids of the goal and the plan.
    """
    plan_actions = actions_by_plan.get((read_text(slots, "goal-id"), read_text(slots, "id")), [])
    return read_model(Plan, slots, actions=sorted(plan_actions, key=lambda action: action.id))


def _make_action(groundings: formulas.Groundings, slots: Slots) -> PlanAction:
    action = read_model(PlanAction, slots)
    grounding = groundings.slots.get(read_text(slots, "precondition"))
    if grounding is not None:
        action.precondition = read_model(PDDLGrounding, grounding)
        action.preconditions = (
            formulas.make_precondition(groundings, action.operator_name, grounding) or UNSET
        )
    return action


def _list_plans(call: ApiCall, facts: FactCopy) -> list[Plan]:
    groundings = formulas.Groundings.read(facts)
    actions_by_plan: dict[tuple[str, str], list[PlanAction]] = {}

    def add_action(slots: Slots) -> PlanAction:
        key = (read_text(slots, "goal-id"), read_text(slots, "plan-id"))
        action = _make_action(groundings, slots)
        actions_by_plan.setdefault(key, []).append(action)
        return action

    _make_models(call, "plan action", facts.facts_of("plan-action"), add_action)
    plans = _make_models(call, "plan", facts.facts_of("plan"), partial(_make_plan, actions_by_plan))
    return sorted(plans, key=lambda plan: (plan.goal_id, plan.id))


def _get_plan(call: ApiCall, facts: FactCopy) -> Plan:
    goal_id, plan_id = call.path_values["goal_id"], call.path_values["id"]
    for plan in _list_plans(call, facts):
        if (plan.goal_id, plan.id) == (goal_id, plan_id):
            return plan
    raise ApiError(400, f"No plan for goal '{goal_id}' with ID '{plan_id}' found")


# -- endpoints


def _make_list_endpoint(path: str, model: type[Model], template: str, noun: str) -> Endpoint:
    """Return an endpoint that lists the facts of a deftemplate."""

    def finish(call: ApiCall, facts: FactCopy) -> list[Model]:
        return _make_models(call, noun, facts.facts_of(template), partial(read_model, model))

    summary = f"All facts of the deftemplate {template}."
    return _make_endpoint(path, list[model], summary, finish, (template,))  # type: ignore[valid-type]  # a model as a variable


def _make_item_endpoint(path: str, model: type[Model], template: str, noun: str) -> Endpoint:
    """Return an endpoint that returns a fact of a deftemplate by its slot `id`."""

    def finish(call: ApiCall, facts: FactCopy) -> Model:
        return _get_by_id(
            call, facts, noun, template, partial(read_model, model), f"No {noun} with ID '{{}}' found"
        )

    errors = {400: f"The {noun} does not exist"}
    return _make_endpoint(
        f"{path}/{{id}}", model, f"A fact of the deftemplate {template}.", finish, (template,), errors=errors
    )


def _make_endpoint(
    path: str,
    reply: Any,
    summary: str,
    finish: Callable[[ApiCall, FactCopy], Any],
    templates: tuple[str, ...],
    errors: Mapping[int, str] | None = None,
) -> Endpoint:
    """Return an endpoint whose reply is made from copied facts of the given deftemplates."""
    return Endpoint(
        method="GET",
        path=f"/clips-executive{path}",
        handler=lambda call: copy_facts(call, DEFAULT_ENVIRONMENT, templates.__contains__),
        summary=summary,
        reply=reply,
        errors=errors or {},
        timeout_s=COPY_TIMEOUT_S,
        finish=finish,
    )


_GOAL_TEMPLATES: Final = ("goal", "plan")
_OPERATOR_TEMPLATES: Final = ("domain-operator", "domain-operator-parameter")
_PLAN_TEMPLATES: Final = ("plan", "plan-action", *formulas.FORMULA_TEMPLATES)


def _define_text_model(name: str, docstring: str, text_members: str, **other_members: Any) -> type[Model]:
    """Return the model of facts, most of whose slots are texts.

    :param text_members: the names of the members that are texts, separated by spaces.
    :param other_members: the types of the other members.
    """
    all_members = [*((member, str) for member in text_members.split()), *other_members.items()]
    return define_model(name, docstring, all_members, rename="kebab")


# path, model, deftemplate, and the noun for messages
_ListRow: TypeAlias = tuple[str, type[Model], str, str]
_DOMAIN_ENDPOINTS: Final[Sequence[_ListRow]] = (
    (
        "/domain-objects",
        _define_text_model("DomainObject", "An object of the domain.", "name type"),
        "domain-object",
        "object",
    ),
    (
        "/domain-predicates",
        _define_text_model(
            "DomainPredicate",
            "A predicate of the domain.",
            "name",
            sensed=bool,
            param_names=list[str],
            param_types=list[str],
        ),
        "domain-predicate",
        "predicate",
    ),
    (
        "/domain-facts",
        _define_text_model("DomainFact", "A fact of the domain.", "name", param_values=list[str]),
        "domain-fact",
        "fact",
    ),
)
# model, deftemplate and noun: the list and the single formula have different paths
_GROUNDED_FORMULA: Final = (
    _define_text_model(
        "GroundedPDDLFormula",
        "Whether a formula is satisfied in a grounding.",
        "id formula_id grounding",
        is_satisfied=bool,
    ),
    "grounded-pddl-formula",
    "grounded formula",
)
_PDDL_ENDPOINTS: Final[Sequence[_ListRow]] = (
    ("/pddl-groundings", PDDLGrounding, "pddl-grounding", "grounding"),
    (
        "/pddl-predicates",
        _define_text_model(
            "PDDLPredicate",
            "An atom of PDDL.",
            "id part_of predicate",
            param_names=list[str],
            param_constants=list[str],
        ),
        "pddl-predicate",
        "predicate",
    ),
    (
        "/pddl-formulas",
        _define_text_model("PDDLFormula", "A formula of PDDL.", "id type part_of"),
        "pddl-formula",
        "formula",
    ),
    (
        "/grounded-pddl-predicates",
        _define_text_model(
            "GroundedPDDLPredicate",
            "Whether an atom is satisfied in a grounding.",
            "id predicate_id grounding",
            is_satisfied=bool,
        ),
        "grounded-pddl-predicate",
        "grounded predicate",
    ),
    ("/grounded-pddl-formulas", *_GROUNDED_FORMULA),
)

# All endpoints of the component in Fawkes' order.
ENDPOINTS: Final = (
    _make_endpoint("/goals", list[Goal], "All goals.", _list_goals, _GOAL_TEMPLATES),  # type: ignore[valid-type]  # a type that is made at run time
    _make_endpoint(
        "/goals/{id}", Goal, "A goal.", _get_goal, _GOAL_TEMPLATES, errors={400: "The goal does not exist"}
    ),
    _make_endpoint(
        "/domain-operators",
        list[DomainOperator],
        "All operators of the domain.",
        _list_operators,
        _OPERATOR_TEMPLATES,
    ),
    *(_make_list_endpoint(*row) for row in _DOMAIN_ENDPOINTS),
    _make_endpoint("/plans", list[Plan], "All plans with their actions.", _list_plans, _PLAN_TEMPLATES),
    _make_endpoint(
        "/plans/{goal-id}/{id}",
        Plan,
        "A plan.",
        _get_plan,
        _PLAN_TEMPLATES,
        errors={400: "The plan does not exist"},
    ),
    *(_make_list_endpoint(*row) for row in _PDDL_ENDPOINTS),
    *(_make_item_endpoint(*row) for row in _PDDL_ENDPOINTS),
    # Fawkes serves a single grounded formula at this path
    _make_item_endpoint("/grounded-pddl-groundings", *_GROUNDED_FORMULA),
)
