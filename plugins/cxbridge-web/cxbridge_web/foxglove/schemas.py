"""JSON schemas of the written Foxglove messages, with the fields of Foxglove's published schemas."""

from __future__ import annotations

from functools import cache
from typing import Any, Final

# The fields of each message as `NAME:TYPE`. A type is another message, a key of `_BASIC_SCHEMAS` or a type of
# JSON; `[]` marks an array.
_MESSAGE_FIELDS: Final = {
    "Log": "timestamp:time level:integer message:string name:string file:string line:integer",
    "PoseInFrame": "timestamp:time frame_id:string pose:Pose",
    "FrameTransform": (
        "timestamp:time parent_frame_id:string child_frame_id:string translation:Vector3 rotation:Quaternion"
    ),
    "SceneUpdate": "deletions:SceneEntityDeletion[] entities:SceneEntity[]",
    "SceneEntityDeletion": "timestamp:time type:integer id:string",
    "SceneEntity": (
        "timestamp:time frame_id:string id:string lifetime:duration frame_locked:boolean "
        "metadata:KeyValuePair[] arrows:ArrowPrimitive[] cubes:CubePrimitive[] spheres:SpherePrimitive[] "
        "cylinders:CylinderPrimitive[] lines:LinePrimitive[] triangles:TriangleListPrimitive[] "
        "texts:TextPrimitive[] models:ModelPrimitive[]"
    ),
    "KeyValuePair": "key:string value:string",
    "ArrowPrimitive": (
        "pose:Pose shaft_length:number shaft_diameter:number head_length:number head_diameter:number "
        "color:Color"
    ),
    "CubePrimitive": "pose:Pose size:Vector3 color:Color",
    "SpherePrimitive": "pose:Pose size:Vector3 color:Color",
    "CylinderPrimitive": "pose:Pose size:Vector3 bottom_scale:number top_scale:number color:Color",
    "LinePrimitive": (
        "type:integer pose:Pose thickness:number scale_invariant:boolean points:Point3[] color:Color "
        "colors:Color[] indices:integer[]"
    ),
    "TriangleListPrimitive": "pose:Pose points:Point3[] color:Color colors:Color[] indices:integer[]",
    "TextPrimitive": (
        "pose:Pose billboard:boolean font_size:number scale_invariant:boolean color:Color text:string"
    ),
    "ModelPrimitive": (
        "pose:Pose scale:Vector3 color:Color override_color:boolean url:string media_type:string data:bytes"
    ),
    "Pose": "position:Vector3 orientation:Quaternion",
    "Vector3": "x:number y:number z:number",
    "Point3": "x:number y:number z:number",
    "Quaternion": "x:number y:number z:number w:number",
    "Color": "r:number g:number b:number a:number",
}

_NANOSECONDS: Final = {"type": "integer", "minimum": 0, "maximum": 999_999_999}
_BASIC_SCHEMAS: Final[dict[str, dict[str, Any]]] = {
    "time": {
        "type": "object",
        "title": "time",
        "properties": {"sec": {"type": "integer", "minimum": 0}, "nsec": _NANOSECONDS},
    },
    "duration": {
        "type": "object",
        "title": "duration",
        "properties": {"sec": {"type": "integer"}, "nsec": _NANOSECONDS},
    },
    "bytes": {"type": "string", "contentEncoding": "base64"},
}


@cache
def make_json_schema(schema_name: str) -> dict[str, Any]:
    """Return the JSON schema of a name such as ``Log``. Do not modify the cached result."""
    fields = dict(field.split(":") for field in _MESSAGE_FIELDS[schema_name].split())
    return {
        "title": f"foxglove.{schema_name}",
        "type": "object",
        "properties": {name: _make_field_schema(field_type) for name, field_type in fields.items()},
        "required": list(fields),
    }


def _make_field_schema(field_type: str) -> dict[str, Any]:
    if field_type.endswith("[]"):
        return {"type": "array", "items": _make_field_schema(field_type.removesuffix("[]"))}
    if field_type in _MESSAGE_FIELDS:
        return make_json_schema(field_type)
    return _BASIC_SCHEMAS.get(field_type) or {"type": field_type}
