"""Reads parts of a ``world.yaml``: probabilities, seconds, distributions. Errors have file and line."""

from __future__ import annotations

import math
from collections.abc import Collection
from pathlib import Path
from typing import Final

from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.suggestions import did_you_mean
from cxbridge_explore.worldmodel.distributions import PARAMETERS, Distribution, Shape
from cxbridge_explore.worldmodel.model import LIKELY, Times, WorldPlace

LONGEST_S: Final = 1e9  # about 30 years
_NAMED: Final = ("median", "min", "max")
_SHAPES: Final = tuple(shape.value for shape in Shape if shape is not Shape.CONSTANT)
_BOUNDS: Final = ("min", "max", "explore")


def place_of(document: Configuration, path: str) -> WorldPlace:
    """Return the position of a value, or of the first value below the path."""
    value = document.get(path) if document.exists(path) else next(document.walk(path), None)
    if value is None or not value.file:
        return WorldPlace()
    return WorldPlace(Path(value.file), value.line)


def wrong(document: Configuration, path: str, fault: str, hint: str | None = None) -> ConfigError:
    """Return the error for a value.

    :param fault: a phrase that follows the path.
    """
    position = place_of(document, path)
    return ConfigError(f"{path[1:]} {fault}", file=position.file, line=position.line, hint=hint)


def refuse_unknown(document: Configuration, path: str, known: Collection[str]) -> None:
    """Raise `ConfigError` for an unknown key, or for a value in place of keys."""
    names = document.keys(path)
    if not names and document.exists(path) and (document.is_list(path) or document.get(path).text):
        raise wrong(document, path, "must be a map", f"with: {', '.join(known)}")
    for name in names:
        if name not in known:
            hint = did_you_mean(name, known, f"use: {', '.join(known)}")
            raise wrong(document, f"{path}/{name}", "means nothing", hint)


def items(document: Configuration, path: str) -> list[str]:
    """Return the paths of the maps in a list.

    :raises ConfigError: if the value is not a list of maps.
    """
    names = document.keys(path)
    if any(not name.isdigit() for name in names):
        raise wrong(document, path, "must be a list", "begin each entry with a dash")
    if document.exists(path):
        value = document.get(path)
        if value.text or value.items:
            raise wrong(document, path, "must be a list of maps", "write: - {name: ...}")
    return [f"{path}/{name}" for name in names]


def probability(document: Configuration, path: str, default: float = LIKELY) -> float:
    """Read a probability.

    :raises ConfigError: if it is not from 0 to 1.
    """
    value = document.get_float(path, default=default)
    if not 0 <= value <= 1:
        raise wrong(document, path, f"is {value:g}", "a probability is from 0 to 1")
    return value


def seconds(document: Configuration, path: str, default: float = 0.0) -> float:
    """Read a time or a duration.

    :raises ConfigError: if it is negative or too large.
    """
    return _checked(document, path, document.get_float(path, default=default))


def _checked(document: Configuration, path: str, value: float) -> float:
    if not 0 <= value <= LONGEST_S:
        raise wrong(document, path, f"is {value:g}", f"seconds, from 0 to {LONGEST_S:g}")
    return value


def times(document: Configuration, path: str, default: Times | None = None) -> Times:
    """Read ``every``, ``from`` and ``until``."""
    default = default or Times()
    refuse_unknown(document, path, ("every", "from", "until"))
    result = Times(
        seconds(document, f"{path}/every", default.every),
        seconds(document, f"{path}/from", default.begin),
        seconds(document, f"{path}/until", default.until),
    )
    if result.until < result.begin:
        raise wrong(document, path, f"ends at {result.until:g}, before {result.begin:g}")
    return result


def distribution(document: Configuration, path: str) -> Distribution:
    """Read a number of seconds, or a distribution."""
    if document.exists(path):
        return Distribution.constant(seconds(document, path))
    refuse_unknown(document, path, (*_SHAPES, *_BOUNDS))
    shapes = [name for name in document.keys(path) if name in _SHAPES]
    if len(shapes) != 1:
        raise wrong(document, path, f"names {len(shapes)} distributions", f"one of: {', '.join(_SHAPES)}")
    shape = Shape(shapes[0])
    least = seconds(document, f"{path}/min")
    most = seconds(document, f"{path}/max", LONGEST_S)
    if most < least:
        raise wrong(document, f"{path}/max", f"is {most:g}, less than the minimum {least:g}")
    result = Distribution(shape, _parameters(document, f"{path}/{shape.value}", shape), least, most)
    listed = _listed(document, f"{path}/explore", result)
    return Distribution(shape, result.parameters, least, most, listed)


def _parameters(document: Configuration, path: str, shape: Shape) -> tuple[float, ...]:
    values = tuple(document.get_floats(path) if document.is_list(path) else [document.get_float(path)])
    names = PARAMETERS.get(shape)
    if names is None and not values:
        raise wrong(document, path, "has no values", "choice: [1.0, 2.5]")
    if names is not None and len(values) != len(names):
        raise wrong(document, path, f"has {len(values)} parameters", f"it takes: {', '.join(names)}")
    for value in values:
        _checked(document, path, value)
    if shape is Shape.UNIFORM and values[0] > values[1]:
        raise wrong(document, path, f"goes from {values[0]:g} down to {values[1]:g}", "write the least first")
    return values


def _listed(document: Configuration, path: str, shape: Distribution) -> tuple[float, ...]:
    """Return the values that represent a distribution in an exploration."""
    if not document.exists(path):
        return ()
    named = dict(zip(_NAMED, (shape.median, shape.least_usual, shape.most_usual), strict=True))
    value = document.get(path)
    listed = []
    for text in value.items or (value.text,):
        try:
            listed.append(named[text] if text in named else _checked(document, path, float(text)))
        except ValueError:
            known = ", ".join(_NAMED)
            hint = did_you_mean(text, _NAMED, f"use seconds, or: {known}")
            raise wrong(document, path, f"has '{text}'", hint) from None
    if not all(map(math.isfinite, listed)) or not listed:
        raise wrong(document, path, "names no seconds", f"use seconds, or: {', '.join(_NAMED)}")
    return tuple(listed)
