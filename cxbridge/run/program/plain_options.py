"""Options of a run as JSON has them: what editors send to the language server and the debug adapter."""

from __future__ import annotations

import re
import types
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final, Union, get_args, get_origin, get_type_hints

from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions
from cxbridge.run.program.run import make_options

_CAPITAL: Final = re.compile(r"[A-Z]")
_PLAIN: Final[Mapping[Any, tuple[type, ...]]] = {
    bool: (bool,),
    int: (int,),
    float: (float, int),
    str: (str,),
    Path: (str,),
    tuple: (str, list),
}
"""What may stand for values of these types."""
_TITLES: Final = {bool: "true or false", int: "a number", float: "a number", str: "a text", list: "texts"}


def plain_options(given: Mapping[str, Any]) -> RunOptions:
    """Return the options of a run.

    :param given: names as in ``skill_dirs``, ``skill-dirs`` or ``skillDirs``; null: as if it was not there.
    :raises CxbridgeError: when there is no such option, or its value is of another type.
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
    """Return what may be given for each option."""
    return {
        name: tuple(dict.fromkeys(plain for each in _members(hint) for plain in _PLAIN.get(each, ())))
        for group in (RunOptions, *RunOptions.added_groups())
        for name, hint in get_type_hints(group).items()
    }


def _members(hint: Any) -> list[Any]:
    """Return the types of a union, or the only one; of ``tuple[...]`` just ``tuple``."""
    if get_origin(hint) in (Union, types.UnionType):
        return [member for each in get_args(hint) for member in _members(each)]
    return [get_origin(hint) or hint]


def _check_type(name: str, value: object) -> None:
    """See that an option has a value of its type; those that there are not are refused later.

    :raises CxbridgeError: when it has not.
    """
    kinds = _kinds().get(name)
    if kinds is None:
        return
    texts = not isinstance(value, list) or all(isinstance(item, str) for item in value)
    if not isinstance(value, kinds) or not texts or (isinstance(value, bool) and bool not in kinds):
        titles = dict.fromkeys(_TITLES[kind] for kind in kinds if kind in _TITLES)
        raise CxbridgeError(f"'{name}' must be {' or '.join(titles)}")
