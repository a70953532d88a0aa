"""The component ``clips``: CLIPS environments and their facts."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, Final

from cxbridge.clipstext.facts import fact_text
from cxbridge.executive.host.facts.copying import FactCopy, FactRow, FactTemplate
from cxbridge_web.endpoint import API_VERSION, ApiCall, Endpoint, Query
from cxbridge_web.fawkes.slots import copy, texts
from cxbridge_web.paging import ListPart, matches

_LONGEST: Final = 16_382
"""Characters of a fact that is formatted."""


def _environments(call: ApiCall) -> list[dict[str, Any]]:
    return [
        {"kind": "Environment", "apiVersion": API_VERSION, "name": name}
        for name in sorted(call.host.environments())
    ]


def _copy(call: ApiCall) -> Generator[None, None, FactCopy]:
    pattern = call.query.get("template", "")
    return copy(call, call.path["env"], lambda name: matches(name, pattern), 404, call.window)


def _facts(call: ApiCall) -> Any:
    formatted = call.query.get("formatted") == "true"
    templates = call.facts.templates
    models = [_model(templates[row.template], row, formatted=formatted) for row in call.facts.rows]
    return models if call.window.search else ListPart(models, call.facts.total)


def _model(template: FactTemplate, row: FactRow, *, formatted: bool) -> dict[str, Any]:
    model: dict[str, Any] = {
        "kind": "Fact",
        "apiVersion": API_VERSION,
        "index": row.index,
        "template_name": row.template,
    }
    slots = (("implied", True),) if template.slots is None else template.slots
    if formatted:
        model["formatted"] = fact_text(template.name, template.slots_of(row))[:_LONGEST]
        model["slots"] = []
    else:
        model["slots"] = [
            {"name": name, "is-multifield": multi, "values": texts({name: value}, name, "ADDR")}
            for (name, multi), value in zip(slots, row.values, strict=True)
        ]
    return model


ENDPOINTS: Final = (
    Endpoint(
        method="GET",
        path="/clips/",
        handler=_environments,
        about="All CLIPS environments.",
        reply="Environment",
        many=True,
    ),
    Endpoint(
        method="GET",
        path="/clips/{env}/facts",
        handler=_facts,
        copy=_copy,
        about="All facts of an environment.",
        reply="Fact",
        many=True,
        paged=True,
        query=(
            Query("formatted", "Facts as CLIPS prints them.", {"type": "boolean"}),
            Query("template", "A pattern of their deftemplates' names."),
        ),
        errors={404: "There is no such environment"},
    ),
)
