"""Fawkes' REST API ``clips``: CLIPS environments and their facts."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import Final

from msgspec import UNSET, Struct, UnsetType

from cxbridge.clipstext.facts import fact_text
from cxbridge.executive.host.facts.copying import FactCopy, FactRow, FactTemplate
from cxbridge_web.endpoint import ApiCall, Endpoint, QueryParameter, matches
from cxbridge_web.fawkes.slots import COPY_TIMEOUT_S, copy_facts, read_texts
from cxbridge_web.models import Model

_MAX_FORMATTED_LENGTH: Final = 16_382  # characters of a formatted fact: the size of Fawkes' buffer


class Environment(Model, kw_only=True):
    """A CLIPS environment."""

    name: str


class SlotValue(Struct, rename="kebab"):  # Fawkes' names of members have dashes
    """The values of a slot as texts."""

    name: str
    is_multifield: bool
    values: list[str]


class Fact(Model, kw_only=True):
    """A fact with its slots, or with its text if `formatted` is requested."""

    index: int
    template_name: str
    formatted: str | UnsetType = UNSET
    slots: Sequence[SlotValue] = ()


def _list_environments(call: ApiCall) -> list[Environment]:
    return [Environment(name=name) for name in sorted(call.host.environments())]


def _copy_facts(call: ApiCall) -> Generator[None, None, FactCopy]:
    pattern = call.query.get("template", "")
    return copy_facts(call, call.path_values["env"], lambda name: matches(name, pattern), 404)


def _make_facts(call: ApiCall, facts: FactCopy) -> list[Fact]:
    is_formatted = call.query.get("formatted") == "true"
    return [_make_fact(facts.templates[row.template], row, is_formatted=is_formatted) for row in facts.rows]


def _make_fact(template: FactTemplate, row: FactRow, *, is_formatted: bool) -> Fact:
    fact = Fact(index=row.index, template_name=row.template)
    if is_formatted:
        fact.formatted = fact_text(template.name, template.slots_of(row))[:_MAX_FORMATTED_LENGTH]
    else:
        # an ordered fact has a single multislot, which CLIPS calls implied
        slots = (("implied", True),) if template.slots is None else template.slots
        # "ADDR" is Fawkes' text for values such as addresses of facts
        fact.slots = [
            SlotValue(name, is_multislot, read_texts({name: value}, name, "ADDR"))
            for (name, is_multislot), value in zip(slots, row.values, strict=True)
        ]
    return fact


ENDPOINTS: Final = (
    Endpoint(
        method="GET",
        path="/clips/",
        handler=_list_environments,
        summary="All CLIPS environments.",
        reply=list[Environment],
    ),
    Endpoint(
        method="GET",
        path="/clips/{env}/facts",
        handler=_copy_facts,
        timeout_s=COPY_TIMEOUT_S,
        finish=_make_facts,
        summary="All facts of an environment.",
        reply=list[Fact],
        query=(
            QueryParameter("formatted", "Whether to return the facts as CLIPS prints them.", bool),
            QueryParameter("template", "A pattern of the names of the deftemplates."),
        ),
        errors={404: "The environment does not exist"},
    ),
)
