"""The paths of Fawkes' webview itself: ``config``, ``plugins``, ``backends``, ``images``, ``transforms``."""

from __future__ import annotations

from typing import Any, Final

from cxbridge.config import ConfigType, Configuration, ConfigValue
from cxbridge.config.scalars import to_bool, to_float, to_int, to_uint
from cxbridge.config.secrets import masked
from cxbridge.errors import CxbridgeError
from cxbridge.rights import Right
from cxbridge_web.endpoint import API_VERSION, ApiCall, ApiError, Endpoint, Query

_CONVERSIONS: Final = {
    ConfigType.UINT: to_uint,
    ConfigType.INT: to_int,
    ConfigType.FLOAT: to_float,
    ConfigType.BOOL: to_bool,
}


# -- config


def _scalar(text: str, kind: ConfigType) -> Any:
    convert = _CONVERSIONS.get(kind)
    value = text if convert is None else convert(text)
    return text if value is None else value


def _plain(value: ConfigValue) -> Any:
    if value.is_list:
        return [_scalar(text, value.type) for text in value.items]
    return _scalar(value.text, value.type)


def config_tree(config: Configuration, query: str) -> dict[str, Any]:
    """Return the values below a path, nested from the root; secrets are left out."""
    tree: dict[str, Any] = {}
    for value in config.search(query):
        names = [name for name in value.path.split("/") if name]
        if len(names) < 2:  # noqa: PLR2004 - as Fawkes: what is right at the root is left out
            continue
        parent = tree
        for name in names[:-1]:
            parent = parent.setdefault(name, {})
        parent[names[-1]] = _plain(masked(value))
    return tree


def _config(call: ApiCall) -> dict[str, Any]:
    tree = config_tree(call.host.config, call.query.get("query", ""))
    return {"kind": "ConfigTree", "apiVersion": API_VERSION, "config": tree}


# -- plugins


def _plugins(call: ApiCall) -> list[dict[str, Any]]:
    return [
        {
            "kind": "Plugin",
            "apiVersion": API_VERSION,
            "name": name,
            "description": description,
            "is_meta": False,
            "meta_children": [],
            "is_loaded": loaded,
        }
        for name, description, loaded in sorted(call.host.plugins())
    ]


def _plugin(call: ApiCall) -> dict[str, Any]:
    for plugin in _plugins(call):
        if plugin["name"] == call.path["name"]:
            return plugin
    raise ApiError(404, f"Plugin '{call.path['name']}' is unknown")


def _set_plugin(call: ApiCall) -> dict[str, Any]:
    name, wanted = call.path["name"], call.body.get("desired_state")
    model = {"kind": "PluginOpResponse", "apiVersion": API_VERSION, "name": name}

    def refuse(status: int, text: str) -> ApiError:
        return ApiError(status, text, {**model, "state": "ERROR", "message": text})

    if not isinstance(wanted, str):
        raise refuse(400, "Request is missing required field 'desired_state'")
    if wanted not in ("LOADED", "UNLOADED", "AVAILABLE"):
        raise refuse(400, "Unknown state requested")
    try:
        call.host.load_plugin(name, load=wanted == "LOADED")
    except CxbridgeError as error:
        raise refuse(400, error.message) from error
    return {**model, "state": wanted}


# -- backends, images, transforms


def _backends(_call: ApiCall) -> list[dict[str, Any]]:
    return []


def _images(_call: ApiCall) -> list[dict[str, Any]]:
    return []


def _image(call: ApiCall) -> Any:
    raise ApiError(404, "Stream not found" if "." in call.path["id"] else "Invalid stream ID")


def _transforms(call: ApiCall) -> dict[str, Any]:
    frames = call.host.frames()
    lines = ["digraph { graph [fontsize=14];", "  node [fontsize=12 shape=box];"]
    for child, parent in frames.items():
        name = child.replace("\\", "\\\\").replace('"', '\\"')
        if parent is None:
            lines.append(f'  "{name}";')
        else:
            above = parent.replace("\\", "\\\\").replace('"', '\\"')
            lines.append(f'  "{above}" -> "{name}";')
    return {"kind": "TransformsGraph", "apiVersion": API_VERSION, "dotgraph": "\n".join([*lines, "}"])}


ENDPOINTS: Final = (
    Endpoint(
        method="GET",
        path="/config/?",
        handler=_config,
        about="The configuration, nested from the root.",
        reply="ConfigTree",
        query=(Query("query", "Only what is below this path."),),
    ),
    Endpoint(
        method="GET",
        path="/plugins/?",
        handler=_plugins,
        about="All components that can be loaded and unloaded.",
        reply="Plugin",
        many=True,
    ),
    Endpoint(
        method="GET",
        path="/plugins/{name}",
        handler=_plugin,
        about="One component.",
        reply="Plugin",
        errors={404: "There is no such component"},
    ),
    Endpoint(
        method="PUT",
        path="/plugins/{name}",
        handler=_set_plugin,
        about="Load or unload a component.",
        reply="PluginOpResponse",
        body="PluginOpRequest",
        errors={400: "There is no such component, or the request makes no sense"},
        right=Right.CONTROL,
    ),
    Endpoint(
        method="GET",
        path="/backends/?",
        handler=_backends,
        about="Other webviews: none.",
        reply="Backend",
        many=True,
    ),
    Endpoint(
        method="GET",
        path="/images/?",
        handler=_images,
        about="Images in shared memory: none.",
        reply="ImageInfo",
        many=True,
    ),
    Endpoint(
        method="GET",
        path="/images/{id+}",
        handler=_image,
        about="An image: there is none.",
        errors={404: "There is no such image"},
    ),
    Endpoint(
        method="GET",
        path="/transforms/graph",
        handler=_transforms,
        about="The coordinate frames, in the dot language.",
        reply="TransformsGraph",
    ),
)
