"""Options of a run from a program's keywords, or from the JSON of an editor."""

from __future__ import annotations

import re
import types
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final, Union, get_args, get_origin, get_type_hints

from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions

# Options with several paths.
_PATHS = ("config", "clips_dirs", "interface_dirs", "skill_dirs", "overlays", "replay")

_CAPITAL: Final = re.compile(r"[A-Z]")
# Accepted types of plain values, by option type.
_PLAIN: Final[Mapping[Any, tuple[type, ...]]] = {
    bool: (bool,),
    int: (int,),
    float: (float, int),
    str: (str,),
    Path: (str,),
    tuple: (str, list),
}
_TITLES: Final = {bool: "true or false", int: "a number", float: "a number", str: "a text", list: "texts"}


def more_options(given: dict[str, Any], find: Callable[[str | Path], Path] = Path) -> Iterator[Any]:
    """Yield an option group for each plug-in with given options; remove these from ``given``.

    :param given: option values by name, with paths as text.
    :param find: returns the path for a text.
    """
    for group in RunOptions.added_groups():
        hints = get_type_hints(group)
        own = {name: given.pop(name) for name in hints if name in given}
        if own:
            paths = {name for name in own if Path in get_args(hints[name])}
            yield group(
                **{name: find(value) if name in paths and value else value for name, value in own.items()}
            )


def paths_of(name: str, given: object, find: Callable[[str | Path], Path] = Path) -> tuple[Path, ...]:
    """Return the paths of an option value, which is one path or several.

    :param find: returns the path for a text.
    :raises CxbridgeError: if a value is not a path.
    """
    if isinstance(given, str | Path):
        return (find(given),)
    several = list(given) if isinstance(given, Iterable) and not isinstance(given, Mapping) else [given]
    paths = [path for path in several if isinstance(path, str | Path)]
    if len(paths) < len(several):
        wrong = next(value for value in several if not isinstance(value, str | Path))
        hint = "write the values into a YAML file, and give its path" if isinstance(wrong, Mapping) else ""
        raise CxbridgeError(f"'{name}' wants the paths of files or folders, not {wrong!r}", hint=hint)
    return tuple(map(find, paths))


def make_options(scenario: str | Path | None, **given: Any) -> RunOptions:
    """Return the options of a run. Paths may be texts, and a single path may stand for several.

    :raises CxbridgeError: if an option is unknown.
    """
    values: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    values["more"] = tuple(more_options(values))
    known = RunOptions.__dataclass_fields__
    unknown = [name for name in values if name not in known]
    if unknown:
        raise CxbridgeError(f"a run has no option '{unknown[0]}'", hint=f"it has: {', '.join(sorted(known))}")
    for name in _PATHS:
        if name in values:
            values[name] = paths_of(name, values[name])
    for name in ("trace", "log", "bblog", "fawkes_dir"):
        if name in values:
            values[name] = Path(values[name])
    return RunOptions(scenario=None if scenario is None else Path(scenario), **values)


def plain_options(given: Mapping[str, Any]) -> RunOptions:
    """Return the options of a run.

    :param given: values by name: ``skill_dirs``, ``skill-dirs`` or ``skillDirs``. Null counts as missing.
    :raises CxbridgeError: if an option is unknown or has a value of another type.
    """
    options = {
        _CAPITAL.sub(lambda m: f"_{m[0].lower()}", name).replace("-", "_"): value
        for name, value in given.items()
        if value is not None
    }
    for name, value in options.items():
        _check_type(name, value)
    return make_options(options.pop("scenario", None), **options)


@cache
def _kinds() -> dict[str, tuple[type, ...]]:
    """Return the accepted types of each option."""
    return {
        name: tuple(dict.fromkeys(plain for member in _members(hint) for plain in _PLAIN.get(member, ())))
        for group in (RunOptions, *RunOptions.added_groups())
        for name, hint in get_type_hints(group).items()
    }


def _members(hint: Any) -> list[Any]:
    """Return the members of a union type; of ``tuple[...]`` just ``tuple``."""
    if get_origin(hint) in (Union, types.UnionType):
        return [member for arg in get_args(hint) for member in _members(arg)]
    return [get_origin(hint) or hint]


def _check_type(name: str, value: object) -> None:
    """Check the type of an option's value. Unknown options pass: :func:`make_options` refuses them."""
    kinds = _kinds().get(name)
    if kinds is None:
        return
    texts = not isinstance(value, list) or all(isinstance(item, str) for item in value)
    if not isinstance(value, kinds) or not texts or (isinstance(value, bool) and bool not in kinds):
        titles = dict.fromkeys(_TITLES[kind] for kind in kinds if kind in _TITLES)
        raise CxbridgeError(f"'{name}' must be {' or '.join(titles)}")
