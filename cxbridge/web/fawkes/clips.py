"""The component ``clips``: CLIPS environments and their facts."""

from __future__ import annotations

from typing import Any, Final

from cxbridge.executive.values import show
from cxbridge.explain.snapshot import FactRow, Template, copy_facts
from cxbridge.web.endpoint import API_VERSION, Call, Endpoint, Query
from cxbridge.web.fawkes.slots import environment, texts
from cxbridge.web.paging import matches

_LONGEST: Final = 16_382
"""Characters of a fact that is formatted."""

Copied = tuple[dict[str, Template], list[FactRow]]


def _environments(call: Call) -> list[dict[str, Any]]:
    return [
        {"kind": "Environment", "apiVersion": API_VERSION, "name": name}
        for name in sorted(call.host.environments())
    ]


def _facts(call: Call) -> Copied:
    env, pattern = environment(call, call.path["env"], 404), call.query.get("template", "")
    with env.lock:
        return copy_facts(env, lambda name: matches(name, pattern))


def _models(call: Call, copied: Copied) -> list[dict[str, Any]]:
    templates, rows = copied
    formatted = call.query.get("formatted") == "true"
    return [_model(templates[row.template], row, formatted=formatted) for row in rows]


def _model(template: Template, row: FactRow, *, formatted: bool) -> dict[str, Any]:
    model: dict[str, Any] = {
        "kind": "Fact",
        "apiVersion": API_VERSION,
        "index": row.index,
        "template_name": row.template,
    }
    slots = (("implied", True),) if template.slots is None else template.slots
    if formatted:
        model["formatted"] = _text(template, row)[:_LONGEST]
        model["slots"] = []
    else:
        model["slots"] = [
            {"name": name, "is-multifield": multi, "values": texts({name: value}, name, "ADDR")}
            for (name, multi), value in zip(slots, row.values, strict=True)
        ]
    return model


def _text(template: Template, row: FactRow) -> str:
    """Return a fact as CLIPS prints it."""
    if template.slots is None:
        return f"({' '.join([row.template, *map(show, row.values[0])])})"
    slots = (
        f"({f'{name} {show(value)}'.rstrip()})"
        for (name, _), value in zip(template.slots, row.values, strict=True)
    )
    return f"({' '.join([row.template, *slots])})"


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
        finish=_models,
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
