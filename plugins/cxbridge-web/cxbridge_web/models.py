"""The models of answers as JSON schemas; those of bodies come from the parameters of operations."""

from __future__ import annotations

from typing import Any, Final

from cxbridge.clipstext.goal_slots import GOAL_SLOTS, GoalSlot

Schema = dict[str, Any]

STRING: Final[Schema] = {"type": "string"}
STRINGS: Final[Schema] = {"type": "array", "items": STRING}
BOOL: Final[Schema] = {"type": "boolean"}
INTEGER: Final[Schema] = {"type": "integer"}
NUMBER: Final[Schema] = {"type": "number"}
OBJECT: Final[Schema] = {"type": "object"}


def _ref(name: str) -> Schema:
    return {"$ref": f"#/components/schemas/{name}"}


def _refs(name: str) -> Schema:
    return {"type": "array", "items": _ref(name)}


def _object(members: dict[str, Schema], optional: str = "") -> Schema:
    """Return the schema of an object; members may be left out that ``optional`` names."""
    required = [name for name in members if name not in optional.split()]
    return {"type": "object", "properties": members, "required": required}


def _model(members: dict[str, Schema], optional: str = "") -> Schema:
    """Return the schema of a model: with kind and apiVersion."""
    return _object({"kind": STRING, "apiVersion": STRING, **members}, optional)


def _enum(*values: str) -> Schema:
    return {"type": "string", "enum": list(values)}


_STATE: Final = _enum("STARTING", "RUNNING", "PAUSED", "DEGRADED", "STOPPING", "FINISHED")
_FORMULA: Final = _ref("GroundedFormula")

FAWKES_SLOTS: Final = frozenset(
    {
        *("id", "type", "sub-type", "class", "mode", "outcome", "error", "message", "parent", "priority"),
        *("params", "meta", "required-resources", "acquired-resources"),
    }
)
"""The slots of goals that Fawkes' API shows."""

NUMBERS: Final = ("INTEGER", "FLOAT")
"""The types of slots whose values are numbers."""


def goal_member(slot: GoalSlot) -> str:
    """Return the name that a slot of goals has in the API."""
    return "parameters" if slot.name == "params" else slot.name


def _of_slot(slot: GoalSlot) -> Schema:
    return STRINGS if slot.is_multi else NUMBER if slot.type in NUMBERS else STRING


SCHEMAS: Final[dict[str, Schema]] = {
    # clips-executive
    "Goal": _model(
        {**{goal_member(slot): _of_slot(slot) for slot in GOAL_SLOTS}, "priority": INTEGER, "plans": STRINGS},
        " ".join({slot.name for slot in GOAL_SLOTS} - FAWKES_SLOTS),
    ),
    "DomainOperatorParameter": _object({"name": STRING, "type": STRING}),
    "DomainOperator": _model(
        {"name": STRING, "wait-sensed": BOOL, "parameters": _refs("DomainOperatorParameter")}
    ),
    "DomainObject": _model({"name": STRING, "type": STRING}),
    "DomainPredicate": _model(
        {"name": STRING, "sensed": BOOL, "param-names": STRINGS, "param-types": STRINGS}
    ),
    "DomainFact": _model({"name": STRING, "param-values": STRINGS}),
    "Plan": _model({"id": STRING, "goal-id": STRING, "cost": NUMBER, "actions": _refs("PlanAction")}),
    "PlanAction": _model(
        {
            "id": INTEGER,
            "operator-name": STRING,
            "param-values": STRINGS,
            "duration": NUMBER,
            "dispatch-time": NUMBER,
            "state": STRING,
            "executable": BOOL,
            "precondition": _ref("PDDLGrounding"),
            "effects": {"type": "array", "items": OBJECT},
            "preconditions": _FORMULA,
        },
        "precondition preconditions",
    ),
    "GroundedFormula": _model(
        {
            "name": STRING,
            "type": STRING,
            "is-satisfied": BOOL,
            "param-names": STRINGS,
            "param-values": STRINGS,
            "param-constants": STRINGS,
            "child": _refs("GroundedFormula"),
        }
    ),
    "PDDLGrounding": _model({"id": STRING, "param-names": STRINGS, "param-values": STRINGS}),
    "PDDLFormula": _model({"id": STRING, "type": STRING, "part-of": STRING}),
    "PDDLPredicate": _model(
        {
            "id": STRING,
            "part-of": STRING,
            "predicate": STRING,
            "param-names": STRINGS,
            "param-constants": STRINGS,
        }
    ),
    "GroundedPDDLFormula": _model(
        {"id": STRING, "formula-id": STRING, "grounding": STRING, "is-satisfied": BOOL}
    ),
    "GroundedPDDLPredicate": _model(
        {"id": STRING, "predicate-id": STRING, "grounding": STRING, "is-satisfied": BOOL}
    ),
    # clips
    "Environment": _model({"name": STRING}),
    "SlotValue": _object({"name": STRING, "is-multifield": BOOL, "values": STRINGS}),
    "Fact": _model(
        {"index": INTEGER, "template_name": STRING, "formatted": STRING, "slots": _refs("SlotValue")},
        "formatted",
    ),
    # skiller
    "SkillInfo": _model({"name": STRING}),
    "Skill": _model(
        {
            "name": STRING,
            "graph": STRING,
            "skill-string": STRING,
            "error": STRING,
            "msg_id": INTEGER,
            "exclusive_controller": STRING,
            "status": _enum("INACTIVE", "FINAL", "RUNNING", "FAILED"),
        },
        "graph skill-string error msg_id exclusive_controller status",
    ),
    "SkillCall": _model({"skill_string": STRING}, "kind apiVersion"),
    # blackboard
    "InterfaceFieldType": _object({"name": STRING, "type": STRING, "is_array": BOOL, "enums": STRINGS}),
    "InterfaceMessageType": _object({"name": STRING, "fields": _refs("InterfaceFieldType")}),
    "InterfaceInfo": _model(
        {
            "id": STRING,
            "type": STRING,
            "hash": STRING,
            "writer": STRING,
            "readers": STRINGS,
            "fields": _refs("InterfaceFieldType"),
            "message_types": _refs("InterfaceMessageType"),
        },
        "writer",
    ),
    "InterfaceData": _model(
        {
            "id": STRING,
            "type": STRING,
            "writer": STRING,
            "readers": STRINGS,
            "data": OBJECT,
            "timestamp": STRING,
        },
        "writer",
    ),
    # config, plugins, backends, transforms
    "ConfigTree": _model({"config": OBJECT}),
    "Plugin": _model(
        {
            "name": STRING,
            "description": STRING,
            "is_meta": BOOL,
            "meta_children": STRINGS,
            "is_loaded": BOOL,
        }
    ),
    "PluginOpRequest": _model({"desired_state": _enum("LOADED", "UNLOADED", "AVAILABLE")}, "kind apiVersion"),
    "PluginOpResponse": _model({"name": STRING, "state": STRING, "message": STRING}, "message"),
    "Service": _object({"name": STRING, "url": STRING}),
    "Backend": _model({"id": STRING, "name": STRING, "url": STRING, "services": _refs("Service")}),
    "ImageInfo": _model(
        {
            "id": STRING,
            "colorspace": STRING,
            "frame": STRING,
            "width": INTEGER,
            "height": INTEGER,
            "mem_size": INTEGER,
        }
    ),
    "TransformsGraph": _model({"dotgraph": STRING}),
    # cxbridge
    "ComponentInfo": _model(
        {
            "name": STRING,
            "state": _enum("UNCONFIGURED", "INACTIVE", "ACTIVE", "FINALIZED"),
            "since_us": INTEGER,
            "reason": STRING,
        }
    ),
    "Component": _object(
        {
            "name": STRING,
            "state": _enum("UNCONFIGURED", "INACTIVE", "ACTIVE", "FINALIZED"),
            "since_us": INTEGER,
            "reason": STRING,
        }
    ),
    "Status": _model(
        {
            "state": _STATE,
            "version": STRING,
            "pid": INTEGER,
            "started_us": INTEGER,
            "now_us": INTEGER,
            "clock": STRING,
            "endpoints": STRINGS,
            "error": STRING,
            "loop": _object({"count": INTEGER, "period_us": INTEGER}),
            "components": _refs("Component"),
            "remote_control": BOOL,
            "remote_programs": BOOL,
            "environments": {
                "type": "array",
                "items": _object({"name": STRING, "facts": INTEGER, "rules": INTEGER, "agenda": INTEGER}),
            },
            "web": _object({"clients": INTEGER, "events": INTEGER, "dropped": INTEGER}),
            "stalled": STRING,
            "stopped": _ref("Stop"),
            "result": _object({"status": INTEGER, "word": STRING, "reason": STRING}),
        },
        "stopped result",
    ),
    "NavGraph": _model({"graph": STRING, "nodes": OBJECT, "edges": OBJECT}),
    "Health": _model({"state": _STATE, "error": STRING}),
    "Stop": _object(
        {
            "kind": _enum("before", "after", "transition", "step", "asked"),
            "reason": STRING,
            "breakpoint": INTEGER,
            "rule": STRING,
            "next_rule": STRING,
            "loop": INTEGER,
            "fired": INTEGER,
            "time_us": INTEGER,
        }
    ),
    "Breakpoint": _model({"number": INTEGER, "spec": STRING}),
    "Debugger": _model(
        {
            "breakpoints": {"type": "array", "items": _object({"number": INTEGER, "spec": STRING})},
            "stopped": _ref("Stop"),
        },
        "stopped",
    ),
    "Rule": _model(
        {
            "name": STRING,
            "module": STRING,
            "agenda": INTEGER,
            "file": STRING,
            "line": INTEGER,
            "core": BOOL,
            "firings": INTEGER,
        },
        "file line core firings",
    ),
    "Construct": _model(
        {"construct": STRING, "name": STRING, "file": STRING, "line": INTEGER, "core": BOOL, "text": STRING},
        "text",
    ),
    "Activation": _model({"rule": STRING, "salience": INTEGER, "basis": STRING}),
    "Answer": _model({"lines": STRINGS, "data": OBJECT}),
    "FactIndex": _model({"index": INTEGER}),
    "EnvironmentInfo": _model(
        {
            "name": STRING,
            "own": BOOL,
            "facts": INTEGER,
            "agenda": INTEGER,
            "features": STRINGS,
            "watch": STRINGS,
            "log_level": _enum("debug", "info", "warn", "error"),
            "ended": BOOL,
        }
    ),
    "Loaded": _model({"diagnostics": STRINGS}),
    "Feature": _model({"name": STRING, "origin": STRING, "offered": BOOL, "environments": STRINGS}),
    "Logger": _model(
        {
            "name": STRING,
            "priority": INTEGER,
            "level": _enum("debug", "info", "warn", "error"),
            "contains": STRING,
            "replaces": BOOL,
            "component": STRING,
        }
    ),
    "Value": _model({"text": STRING, "output": STRINGS}),
    "MessageText": _object({"type": STRING, "fields": OBJECT}, "fields"),
    "MessageId": _model({"msgid": INTEGER}),
}
"""Models by name."""
