"""Options of a run from the keyword arguments of a program or a test, or from the JSON of an editor."""

from __future__ import annotations

import re
import types
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any, Final, Union, get_args, get_origin, get_type_hints

from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions

_MULTI_PATH_OPTIONS = ("config", "clips_dirs", "interface_dirs", "skill_dirs", "overlays", "replay")
_SINGLE_PATH_OPTIONS = ("scenario", "trace", "log", "bblog", "fawkes_dir")

_CAPITAL: Final = re.compile(r"[A-Z]")
# The accepted types of JSON values, by the type of the option.
_JSON_TYPES: Final[Mapping[Any, tuple[type, ...]]] = {
    bool: (bool,),
    int: (int,),
    float: (float, int),
    str: (str,),
    Path: (str,),
    tuple: (str, list),
}
_TYPE_NAMES: Final = {
    bool: "true or false",
    int: "a number",
    float: "a number",
    str: "a string",
    list: "a list of strings",
}


def options_from_keywords(
    scenario: str | Path | None, *, resolve_path: Callable[[str | Path], Path] = Path, **options: Any
) -> RunOptions:
    """Return the options of a run from keyword arguments. A path may be a string.

    :param resolve_path: returns the path for a string, which may be relative.
    :param options: the values by name; None counts as missing.
    :raises CxbridgeError: if an option is unknown.
    """
    values = {name: value for name, value in {"scenario": scenario, **options}.items() if value is not None}
    values["plugin_groups"] = (*values.get("plugin_groups", ()), *take_plugin_options(values, resolve_path))
    names = {field.name for field in fields(RunOptions)}
    unknown = [name for name in values if name not in names]
    if unknown:
        raise CxbridgeError(f"a run has no option '{unknown[0]}'", hint=f"it has: {', '.join(sorted(names))}")
    for name in values.keys() & {*_MULTI_PATH_OPTIONS}:
        values[name] = _convert_paths(name, values[name], resolve_path)
    for name in values.keys() & {*_SINGLE_PATH_OPTIONS}:
        values[name] = resolve_path(values[name])
    return RunOptions(**values)


def take_plugin_options(
    values: dict[str, Any], resolve_path: Callable[[str | Path], Path] = Path
) -> Iterator[Any]:
    """Yield an option group for each plug-in with a given option; remove these options from ``values``."""
    for group in RunOptions.added_groups():
        hints = get_type_hints(group)
        options = {name: values.pop(name) for name in hints if name in values}
        for name, value in options.items():
            if value and Path in get_args(hints[name]):
                options[name] = resolve_path(value)
        if options:
            yield group(**options)


def _convert_paths(name: str, value: object, resolve_path: Callable[[str | Path], Path]) -> tuple[Path, ...]:
    """Return the paths of an option's value, which is one path or several.

    :raises CxbridgeError: if a value is not a path.
    """
    if isinstance(value, str | Path):
        return (resolve_path(value),)
    items = list(value) if isinstance(value, Iterable) and not isinstance(value, Mapping) else [value]
    paths = []
    for item in items:
        if not isinstance(item, str | Path):
            hint = "write the values into a YAML file, and give its path" if isinstance(item, Mapping) else ""
            raise CxbridgeError(f"'{name}' must be a path or a list of paths, not {item!r}", hint=hint)
        paths.append(resolve_path(item))
    return tuple(paths)


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
    for name, value in options.items():
        _check_type(name, value)
    return options_from_keywords(options.pop("scenario", None), **options)


@cache
def _accepted_types() -> dict[str, tuple[type, ...]]:
    """Return the types of JSON values that each option accepts."""
    return {
        name: tuple(
            dict.fromkeys(
                json_type for member in _union_members(hint) for json_type in _JSON_TYPES.get(member, ())
            )
        )
        for group in (RunOptions, *RunOptions.added_groups())
        for name, hint in get_type_hints(group).items()
    }


def _union_members(hint: Any) -> list[Any]:
    """Return the members of a union type; of ``tuple[...]`` just ``tuple``."""
    if get_origin(hint) in (Union, types.UnionType):
        return [member for arg in get_args(hint) for member in _union_members(arg)]
    return [get_origin(hint) or hint]


def _check_type(name: str, value: object) -> None:
    """Check the type of an option's value; :func:`options_from_keywords` refuses unknown options."""
    json_types = _accepted_types().get(name)
    if json_types is None:
        return
    are_texts = not isinstance(value, list) or all(isinstance(item, str) for item in value)
    # isinstance counts True as an int
    if (
        not isinstance(value, json_types)
        or not are_texts
        or (isinstance(value, bool) and bool not in json_types)
    ):
        type_names = dict.fromkeys(
            _TYPE_NAMES[json_type] for json_type in json_types if json_type in _TYPE_NAMES
        )
        raise CxbridgeError(f"'{name}' must be {' or '.join(type_names)}")
