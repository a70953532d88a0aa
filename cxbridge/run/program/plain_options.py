"""Options of a run from the keyword arguments of a program or a test, or from the JSON of an editor."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from types import UnionType
from typing import Any, Final, Union, get_args, get_origin, get_type_hints

from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions

_MULTI_PATH_OPTIONS = ("config", "clips_dirs", "interface_dirs", "skill_dirs", "overlays", "replay")
_SINGLE_PATH_OPTIONS = ("scenario", "trace", "log", "bblog", "fawkes_dir")

_CAPITAL: Final = re.compile(r"[A-Z]")


def options_from_keywords(
    scenario: str | Path | None, *, resolve_path: Callable[[str | Path], Path] = Path, **options: Any
) -> RunOptions:
    """Return the options of a run from keyword arguments.

    :param resolve_path: makes the path of an option from a string or a path, either of which may be relative.
    :param options: the values by name; None counts as missing.
    :raises CxbridgeError: if an option is unknown, or an option for several paths has a value that is not a
        path.
    """
    values = {name: value for name, value in {"scenario": scenario, **options}.items() if value is not None}
    values["plugin_groups"] = (*values.get("plugin_groups", ()), *take_plugin_options(values, resolve_path))
    option_names = {field.name for field in fields(RunOptions)}
    if unknown_names := [name for name in values if name not in option_names]:
        raise CxbridgeError(
            f"a run has no option '{unknown_names[0]}'", hint=f"it has: {', '.join(sorted(option_names))}"
        )
    for name in values.keys() & {*_MULTI_PATH_OPTIONS}:
        values[name] = _convert_paths(name, values[name], resolve_path)
    for name in values.keys() & {*_SINGLE_PATH_OPTIONS}:
        values[name] = resolve_path(values[name])
    return RunOptions(**values)


def take_plugin_options(
    values: dict[str, Any], resolve_path: Callable[[str | Path], Path] = Path
) -> Iterator[Any]:
    """Yield an option group for each plug-in with a given option; remove these options from ``values``."""
    for group_class in RunOptions.added_groups():
        type_hints = get_type_hints(group_class)
        options = {name: values.pop(name) for name in type_hints if name in values}
        for name, value in options.items():
            is_tuple, has_paths = get_origin(type_hints[name]) is tuple, Path in get_args(type_hints[name])
            if is_tuple and has_paths:
                options[name] = _convert_paths(name, value, resolve_path)
            elif is_tuple and isinstance(value, str):
                options[name] = (value,)
            # an option for a single path has the type `Path | None`, since it may be left out
            elif value and has_paths:
                options[name] = resolve_path(value)
        if options:
            yield group_class(**options)


def _convert_paths(name: str, value: object, resolve_path: Callable[[str | Path], Path]) -> tuple[Path, ...]:
    """Return the paths of an option's value, which is one path or several.

    :raises CxbridgeError: if a value is not a path.
    """
    if isinstance(value, str | Path):
        return (resolve_path(value),)
    items: list[Any] = (
        list(value) if isinstance(value, Iterable) and not isinstance(value, Mapping) else [value]
    )
    for item in items:
        if not isinstance(item, str | Path):
            has_values = name == "config" and isinstance(item, Mapping)
            hint = "write the values into a YAML file, and give its path" if has_values else ""
            raise CxbridgeError(f"'{name}' must be a path or a list of paths, not {item!r}", hint=hint)
    return tuple(map(resolve_path, items))


def options_from_json(values: Mapping[str, Any]) -> RunOptions:
    """Return the options of a run from JSON values, and check their types.

    :param values: values by name: ``skill_dirs``, ``skill-dirs`` or ``skillDirs``. Null counts as missing.
    :raises CxbridgeError: if an option is unknown or has a value of another type.
    """
    options = {
        _CAPITAL.sub(lambda match: f"_{match[0].lower()}", name).replace("-", "_"): value
        for name, value in values.items()
        if value is not None
    }
    for options_class in (RunOptions, *RunOptions.added_groups()):
        for name, type_hint in get_type_hints(options_class).items():
            if name in options and not _fits(options[name], type_hint):
                raise CxbridgeError(f"'{name}' cannot be {options[name]!r}")
    return options_from_keywords(options.pop("scenario", None), **options)


def _fits(value: object, type_hint: Any) -> bool:
    """Return whether a JSON value has the type of an option.

    A string fits a string, a path and a tuple; the string becomes the only element of the tuple. A list of
    strings fits a tuple. A bool fits a bool, any other number fits any number.
    """
    types = {get_origin(member) or member for member in _union_members(type_hint)}
    if isinstance(value, str):
        return not types.isdisjoint({str, Path, tuple})
    if isinstance(value, list):
        return tuple in types and all(isinstance(item, str) for item in value)
    if isinstance(value, bool):  # also an int
        return bool in types
    return isinstance(value, int | float) and not types.isdisjoint({int, float})


def _union_members(type_hint: Any) -> tuple[Any, ...]:
    """Return the types in a union; any other type alone."""
    return get_args(type_hint) if get_origin(type_hint) in (Union, UnionType) else (type_hint,)
