"""The REST APIs ``config``, ``plugins``, ``backends``, ``images`` and ``transforms`` of Fawkes' webview.

The plugins in Fawkes' API are the components of a daemon: a loaded plugin is an active component.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, Literal

from msgspec import UNSET, UnsetType, defstruct

from cxbridge.config import ConfigType, Configuration, ConfigValue
from cxbridge.config.scalars import CONVERTERS
from cxbridge.config.secrets import mask_value
from cxbridge.errors import CxbridgeError
from cxbridge.rights import Right
from cxbridge_web.endpoint import ApiCall, ApiError, Endpoint, QueryParameter
from cxbridge_web.fawkes.blackboard import TransformsGraph, quote_dot
from cxbridge_web.models import Model, RequestBody, define_model


class ConfigTree(Model, kw_only=True):
    """The configuration, nested from the root."""

    config: dict[str, Any]


class Plugin(Model, kw_only=True):
    """A component that can be loaded and unloaded."""

    name: str
    description: str
    is_meta: bool = False
    meta_children: Sequence[str] = ()
    is_loaded: bool


class PluginOpRequest(RequestBody, kw_only=True):
    """The request to load or unload a component."""

    desired_state: Literal["LOADED", "UNLOADED", "AVAILABLE"]


class PluginOpResponse(Model, kw_only=True):
    """The result of a request to load or unload a component."""

    name: str
    state: str
    message: str | UnsetType = UNSET


_Service: Final = defstruct(
    "Service", [("name", str), ("url", str)], namespace={"__doc__": "A service of another webview server."}
)

# The lists of backends and images are always empty: cxbridge finds no other servers and has no images.
Backend: Final = define_model(
    "Backend",
    "Another webview server.",
    [("id", str), ("name", str), ("url", str), ("services", list[_Service])],  # type: ignore[valid-type]  # a type that is made at run time
)
ImageInfo: Final = define_model(
    "ImageInfo",
    "An image in shared memory.",
    [
        *(("id", str), ("colorspace", str), ("frame", str)),
        *(("width", int), ("height", int), ("mem_size", int)),
    ],
)


# -- config


def _convert_scalar(text: str, config_type: ConfigType) -> Any:
    value = CONVERTERS[config_type](text)
    return text if value is None else value  # a text that does not fit its type stays a text


def _convert_value(value: ConfigValue) -> Any:
    if value.is_list:
        return [_convert_scalar(text, value.type) for text in value.items]
    return _convert_scalar(value.text, value.type)


def make_config_tree(config: Configuration, query: str) -> dict[str, Any]:
    """Return the values below a path, nested from the root, with masked secrets."""
    tree: dict[str, Any] = {}
    for value in config.search(query):
        names = [name for name in value.path.split("/") if name]
        if len(names) < 2:  # noqa: PLR2004 - as in Fawkes, without the values directly below the root
            continue
        parent = tree
        for name in names[:-1]:
            parent = parent.setdefault(name, {})
        parent[names[-1]] = _convert_value(mask_value(value))
    return tree


def _get_config(call: ApiCall) -> ConfigTree:
    return ConfigTree(config=make_config_tree(call.host.config, call.query.get("query", "")))


# -- plugins


def _list_plugins(call: ApiCall) -> list[Plugin]:
    return [
        Plugin(name=name, description=description, is_loaded=is_loaded)
        for name, description, is_loaded in sorted(call.host.list_components())
    ]


def _get_plugin(call: ApiCall) -> Plugin:
    for plugin in _list_plugins(call):
        if plugin.name == call.path_values["name"]:
            return plugin
    raise ApiError(404, f"Plugin '{call.path_values['name']}' is unknown")


def _set_plugin(call: ApiCall) -> PluginOpResponse:
    # the errors have Fawkes' texts
    name, desired_state = call.path_values["name"], call.body.get("desired_state")

    def make_refusal(status: int, text: str) -> ApiError:
        return ApiError(status, text, PluginOpResponse(name=name, state="ERROR", message=text))

    if not isinstance(desired_state, str):
        raise make_refusal(400, "Request is missing required field 'desired_state'")
    # as in Fawkes, AVAILABLE is another word for UNLOADED
    if desired_state not in ("LOADED", "UNLOADED", "AVAILABLE"):
        raise make_refusal(400, "Unknown state requested")
    try:
        call.host.set_component_active(name, is_active=desired_state == "LOADED")
    except CxbridgeError as error:
        raise make_refusal(400, error.message) from error
    return PluginOpResponse(name=name, state=desired_state)


# -- backends, images, transforms


def _list_nothing(_call: ApiCall) -> list[Model]:
    return []


def _get_image(call: ApiCall) -> Any:
    # Fawkes' texts for an id with and without a suffix
    raise ApiError(404, "Stream not found" if "." in call.path_values["id"] else "Invalid stream ID")


def _get_transforms(call: ApiCall) -> TransformsGraph:
    frames = call.host.read_frames()
    lines = ["digraph { graph [fontsize=14];", "  node [fontsize=12 shape=box];"]
    for child, parent in frames.items():
        origin = "" if parent is None else f"{quote_dot(parent)} -> "
        lines.append(f"  {origin}{quote_dot(child)};")
    return TransformsGraph(dotgraph="\n".join([*lines, "}"]))


ENDPOINTS: Final = (
    Endpoint(
        method="GET",
        path="/config/?",
        handler=_get_config,
        summary="The configuration, nested from the root.",
        reply=ConfigTree,
        query=(QueryParameter("query", "Only values below this path."),),
    ),
    Endpoint(
        method="GET",
        path="/plugins/?",
        handler=_list_plugins,
        summary="All components that can be loaded and unloaded.",
        reply=list[Plugin],
    ),
    Endpoint(
        method="GET",
        path="/plugins/{name}",
        handler=_get_plugin,
        summary="A component that can be loaded and unloaded.",
        reply=Plugin,
        errors={404: "The component does not exist"},
    ),
    Endpoint(
        method="PUT",
        path="/plugins/{name}",
        handler=_set_plugin,
        summary="Load or unload a component.",
        reply=PluginOpResponse,
        body=PluginOpRequest,
        errors={400: "The component does not exist, or the request is invalid"},
        right=Right.CONTROL,
    ),
    Endpoint(
        method="GET",
        path="/backends/?",
        handler=_list_nothing,
        summary="The other webview servers; always empty.",
        reply=list[Backend],  # type: ignore[valid-type]  # a type that is made at run time
    ),
    Endpoint(
        method="GET",
        path="/images/?",
        handler=_list_nothing,
        summary="The images in shared memory; always empty.",
        reply=list[ImageInfo],  # type: ignore[valid-type]  # a type that is made at run time
    ),
    Endpoint(
        method="GET",
        path="/images/{id+}",
        handler=_get_image,
        summary="An image in shared memory; always an error.",
        errors={404: "The image does not exist"},
    ),
    Endpoint(
        method="GET",
        path="/transforms/graph",
        handler=_get_transforms,
        summary="The graph of the coordinate frames, in the dot language.",
        reply=TransformsGraph,
    ),
)
