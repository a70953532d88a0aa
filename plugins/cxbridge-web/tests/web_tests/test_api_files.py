"""Answers of the REST API compared with Fawkes' api.yaml files."""

from __future__ import annotations

import re
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.support import FAWKES_DIR
from web_tests.support import serving
from web_tests.test_fawkes import _served  # noqa: F401 - a fixture

_FILES = sorted((FAWKES_DIR / "src" / "plugins").glob("**/*rest-api/api.yaml")) if FAWKES_DIR else []


UNUSED_SCHEMAS = {"DomainEffect", "DomainObjectType", "BlackboardGraph"}
"""Schemas that Fawkes documents but never sends; the graph is a TransformsGraph."""

NOT_SET = {("PlanAction", "operator"), ("PlanAction", "preconditions"), ("SlotValue", "type")}
"""Fields that Fawkes documents but never sets; preconditions are absent for actions without preconditions."""

TYPES: dict[str, Any] = {
    "string": str,
    "boolean": bool,
    "integer": int,
    "number": (int, float),
    "array": list,
    "object": dict,
}


@pytest.mark.skipif(not _FILES, reason="needs a Fawkes checkout (FAWKES_DIR)")
@pytest.mark.parametrize("file", _FILES, ids=lambda file: file.parent.parent.name + "/" + file.parent.name)
def test_answer_of_each_path_matches_schema(served, file: Path):
    """The requests use existing ids."""
    spec = yaml.safe_load(file.read_text())
    # an inactive Skiller shows no graphs
    context = (
        serving((("executive", False),)) if file.parent.parent.name == "skiller" else nullcontext(served)
    )
    with context as (_, client, *_lines):
        for path, methods in spec["paths"].items():
            calls = [(method, *call) for method in methods for call in _calls(client, method, path)]
            assert calls, path
            for method, concrete_path, body in calls:
                answer = client.ask(method.upper(), f"/api{concrete_path}", body)
                if method != "get":
                    # a paused daemon loads no plug-in; a skill may have ended before the request to stop
                    assert answer.status in {200, 400}, (method, concrete_path, answer.text)
                elif "{id+}" in path and "images" in path:
                    assert (answer.status, answer.text) == (404, "Stream not found")
                else:
                    assert answer.status == 200, (concrete_path, answer.text)
                    schema = methods["get"]["responses"]["200"]["content"]["application/json"]["schema"]
                    assert list(_deviations(answer.json, schema, spec, concrete_path)) == []


BODIES = {"post": {"skill_string": "say{}"}, "put": {"desired_state": "LOADED"}}


def _calls(client, method, path):
    """Yield paths with ids in place of the names, and bodies."""
    body = BODIES.get(method)
    if "{" not in path:
        yield path, body
    elif "{env}" in path:
        yield path.replace("{env}", "executive"), body
    elif "images" in path:
        yield "/images/camera.jpeg", body
    elif "interfaces" in path:
        for info in client.get("/api/blackboard/interfaces").json:
            yield path.replace("{type}", info["type"]).replace("{id+}", info["id"]), body
    elif "skills" in path:
        yield path.replace("{id}", "active"), body
    else:
        listed = client.get("/api" + path.partition("/{")[0]).json
        for model in listed[:3]:
            concrete_path = path
            for name in re.findall(r"\{([^}]*)\}", path):
                concrete_path = concrete_path.replace(f"{{{name}}}", str(model[name]))
            yield concrete_path, body


def _deviations(value, schema, spec, name):
    """Yield the violations of a value's schema."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        schema = spec["components"]["schemas"][name]
    for part in schema.get("allOf", ()):
        yield from _deviations(value, part, spec, name)
    expected_type = schema.get("type")
    if expected_type and (
        not isinstance(value, TYPES[expected_type])
        or (expected_type == "integer" and isinstance(value, bool))
    ):
        yield f"{name}: {value!r} is no {expected_type}"
    elif value not in schema.get("enum", (value,)):
        yield f"{name}: {value!r} is none of {schema['enum']}"
    elif isinstance(value, list):
        for item in value:
            yield from _deviations(item, schema.get("items", {}), spec, name)
    elif isinstance(value, dict):
        yield from _deviations_of_members(value, schema, spec, name)


def _deviations_of_members(value, schema, spec, name):
    """Yield the violations of an object's schema."""
    for required in schema.get("required", ()):
        if required not in value and (name, required) not in NOT_SET:
            yield f"{name} has no {required}"
    for member, member_schema in schema.get("properties", {}).items():
        if member in value:
            yield from _deviations(value[member], member_schema, spec, f"{name}.{member}")


@pytest.mark.skipif(not _FILES, reason="needs a Fawkes checkout (FAWKES_DIR)")
def test_openapi_has_each_model_with_its_fields(served):
    """The description also has the models that the scenario does not use."""
    models = served[1].get("/api/openapi.json").json["components"]["schemas"]
    unknown = []
    for file in _FILES:
        spec = yaml.safe_load(file.read_text())
        for name, schema in spec["components"]["schemas"].items():
            if name in UNUSED_SCHEMAS:
                continue
            if name not in models:
                unknown.append(f"{file.parent.name}: {name}")
                continue
            fields = set(_properties(schema, spec)) - set(models[name]["properties"])
            unknown += [f"{name}.{field}" for field in fields if (name, field) not in NOT_SET]
    assert unknown == []


def _properties(schema, spec):
    """Yield the names of the schema's properties, also those of its bases."""
    for part in schema.get("allOf", [schema]):
        schema_name = part.get("$ref", "").rpartition("/")[2]
        yield from (spec["components"]["schemas"][schema_name] if schema_name else part).get("properties", {})
