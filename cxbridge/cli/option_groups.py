"""Groups of options: a dataclass parameter of a command becomes one option per field.

A field ``Annotated[T, Meta(description=...)]`` is an option with this help text; ``ge`` and ``le`` are its
bounds, and the option is named like the field. :data:`OVERRIDES` or a ``typer.Option`` in the annotation
define exceptions. Fields without ``Annotated`` are not options. Options of base classes come first, in the
order of the bases. A field of type ``tuple[T, ...]`` is an option that may be given several times, named in
the singular.

The class method ``added_groups`` of a dataclass returns further dataclasses, which plug-ins add. Their fields
are options, too. The field ``plugin_groups`` gets those of their instances that the user has changed.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable, Iterator, Mapping
from inspect import Parameter
from types import GenericAlias, UnionType
from typing import Annotated, Any, Final, TypeVar, get_args, get_origin, get_type_hints

import typer
from msgspec import Meta

from cxbridge.resources import shipped_scenarios

T = TypeVar("T")

CONNECT_OPTION = typer.Option(
    "--connect",
    metavar="URL",
    envvar="CXBRIDGE_CONNECT",
    help="The blackboard: tcp://HOST:PORT or ipc://FILE of a daemon, fawkes://HOST[:PORT] of Fawkes; "
    "tcp://HOST:PORT?key=FILE&server-key=FILE with CURVE keys.",
)
INTERFACE_DIR_OPTION = typer.Option(
    "--interface-dir",
    metavar="DIR",
    help="Folder of interface definitions that take precedence over the shipped ones; may be "
    "given several times.",
)

_SKILLER: Final = {"metavar": "lua|simulator|none|URL"}
_SPEECH: Final = {"metavar": "off|on"}
_GLOBS: Final = {"flags": ("--interface", "-i"), "metavar": "GLOB"}

OVERRIDES: Final[Mapping[str, Any]] = {
    "ScenarioOptions.scenario": {"is_argument": True, "autocompletion": shipped_scenarios},
    "ScenarioOptions.overlays": {"metavar": "DIR"},
    "StrictnessOptions.strict": {"flags": ("--strict/--lenient",)},
    "ExecutionOptions.skiller": _SKILLER,
    "ExecutionOptions.speech": _SPEECH,
    "RunOptions.replay": {"metavar": "RUN"},
    "ConfigurationOptions.config": {"is_argument": True},
    "ConfigurationOptions.overlay": {"flags": ("--config",)},
    "ServerOptions.endpoints": {"metavar": "URL"},
    "ServerOptions.insecure": {"flags": ("--insecure",)},
    "PartOptions.skiller": _SKILLER,
    "PartOptions.speech": _SPEECH,
    "RecordOptions.patterns": _GLOBS,
    "RecordOptions.outputs": {"flags": ("--output", "-o"), "metavar": "PATH"},
    "RecordOptions.url": CONNECT_OPTION,
    "RecordOptions.duration_s": {"flags": ("--duration",)},
    "RecordOptions.interface_dirs": INTERFACE_DIR_OPTION,
    "FawkesTemplate.from_fawkes": {"metavar": "SPEC"},
    "FawkesTemplate.fawkes_dir": {"envvar": "FAWKES_DIR"},
    "ReplayOptions.run": {"is_argument": True, "metavar": "RUN"},
    "ReplayOptions.url": CONNECT_OPTION,
    "ReplayOptions.patterns": _GLOBS,
    "ReplayOptions.start_s": {"flags": ("--from",), "metavar": "S"},
    "ReplayOptions.end_s": {"flags": ("--to",), "metavar": "S"},
    "ReplayOptions.interface_dirs": INTERFACE_DIR_OPTION,
    "ExecutorOptions.target": {"is_argument": True, "metavar": "MODULE:CLASS"},
    "ExecutorOptions.agent": {"metavar": "NAME"},
    "ExecutorOptions.url": CONNECT_OPTION,
    "ExecutorOptions.name": {"metavar": "ID"},
    "ExecutorOptions.settings": {"flags": ("--set",), "metavar": "NAME=VALUE"},
    "ExecutorOptions.interface_dirs": INTERFACE_DIR_OPTION,
}
"""The fields whose options cannot be derived from the name, type and description of the field.

A value is a ``typer.Option`` or its keyword arguments. Two further keywords: ``flags`` are the names of the
option, and ``is_argument`` makes the field an argument.
"""


def option_groups(command: Callable[..., T]) -> Callable[..., T]:
    """Replace the dataclass parameters of a command by options."""
    hints = get_type_hints(command, include_extras=True)
    groups = {name: _Group(hint) for name, hint in hints.items() if dataclasses.is_dataclass(hint)}
    parameters: list[Parameter] = []
    for name, parameter in inspect.signature(command).parameters.items():
        if name in groups:
            parameters += groups[name].parameters
        else:
            parameters.append(parameter.replace(annotation=hints[name], kind=Parameter.KEYWORD_ONLY))

    @functools.wraps(command)
    def run_with_groups(**values: Any) -> T:
        options = {name: group.pop_options(values) for name, group in groups.items()}
        return command(**values, **options)

    # typer reads the parameters from the signature and their types from the annotations
    vars(run_with_groups)["__signature__"] = inspect.Signature(parameters)
    run_with_groups.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return run_with_groups


class _Group:
    """The fields of a dataclass as parameters of a command."""

    def __init__(self, group_class: Any) -> None:
        hints = get_type_hints(group_class, include_extras=True)
        self._group_class = group_class
        self._repeatable_fields = {name for name, hint in hints.items() if _find_item_type(hint) is not None}
        fields = {field.name: field for field in dataclasses.fields(group_class)}
        self._own_parameters = [
            Parameter(
                name,
                Parameter.KEYWORD_ONLY,
                default=_choose_default(fields[name]),
                annotation=_make_list_hint(_make_typer_hint(group_class, fields[name], hints[name])),
            )
            for name in dict.fromkeys(_list_field_names(group_class))
            if get_origin(hints[name]) is Annotated
        ]
        # without the method ``added_groups``, ``list`` is called instead, and returns an empty list
        self._added_groups = [
            _Group(added_class) for added_class in getattr(group_class, "added_groups", list)()
        ]
        self.parameters: list[Parameter] = [
            *self._own_parameters,
            *(parameter for group in self._added_groups for parameter in group.parameters),
        ]

    def pop_options(self, values: dict[str, Any]) -> Any:
        """Remove the values of the fields from ``values``; return an instance of the dataclass with them."""
        options = {parameter.name: values.pop(parameter.name) for parameter in self._own_parameters}
        for name in options.keys() & self._repeatable_fields:
            options[name] = tuple(options[name] or ())
        added_options = [group.pop_options(values) for group in self._added_groups]
        # only the groups that differ from their defaults: a group of defaults must not change the run
        if changed_groups := tuple(
            group_options for group_options in added_options if group_options != type(group_options)()
        ):
            options["plugin_groups"] = changed_groups
        return self._group_class(**options)


def _list_field_names(group: type) -> Iterator[str]:
    """Yield the fields of the bases from left to right, then the other fields."""
    for base in group.__bases__:
        yield from _list_field_names(base)
    if "__dataclass_fields__" in vars(group):
        yield from inspect.get_annotations(group)


def _make_typer_hint(group: type, field: dataclasses.Field[Any], hint: Any) -> Any:
    """Return the hint of a field with typer's parameter instead of the description."""
    meta = next((metadata for metadata in hint.__metadata__ if isinstance(metadata, Meta)), None)
    if meta is None:
        return hint
    value_type, *_ = get_args(hint)
    defining_class = next(
        base for base in group.__mro__ if field.name in vars(base).get("__annotations__", {})
    )
    override = OVERRIDES.get(f"{defining_class.__name__}.{field.name}", {})
    if not isinstance(override, Mapping):
        return Annotated[value_type, override]
    keywords = {"min": meta.ge, "max": meta.le, "help": meta.description, **override}
    if field.default in (None, ""):
        keywords["show_default"] = False
    flags = keywords.pop("flags", _make_flags(field, value_type))
    is_argument = keywords.pop("is_argument", False)
    parameter = typer.Argument(**keywords) if is_argument else typer.Option(*flags, **keywords)
    return Annotated[value_type, parameter]


def _make_flags(field: dataclasses.Field[Any], value_type: Any) -> tuple[str, ...]:
    """Return the flags of an option; empty if they are those that typer derives from the field's name."""
    name = field.name.replace("_", "-")
    if value_type is bool and field.default is False:
        return (f"--{name}",)
    if _find_item_type(value_type) is not None and name.endswith("s"):
        return (f"--{name.removesuffix('s')}",)
    return ()


def _find_item_type(hint: Any) -> Any:
    """Return the type of the items if a hint is or contains a tuple; otherwise None."""
    if get_origin(hint) in (Annotated, UnionType):
        return next(
            (item_type for member in get_args(hint) if (item_type := _find_item_type(member)) is not None),
            None,
        )
    return get_args(hint)[0] if get_origin(hint) is tuple else None


def _make_list_hint(hint: Any) -> Any:
    """Return the hint of a field with a list instead of a tuple."""
    # typer takes a tuple for an option that has several values at once
    item_type = _find_item_type(hint)
    return (
        hint if item_type is None else Annotated[GenericAlias(list, (item_type,)) | None, *hint.__metadata__]
    )


def _choose_default(field: dataclasses.Field[Any]) -> Any:
    """Return the default of a field's option.

    :attr:`Parameter.empty` for a required option; None for an empty tuple, which typer does not accept.
    """
    if field.default is dataclasses.MISSING:
        return Parameter.empty
    return None if field.default == () else field.default
