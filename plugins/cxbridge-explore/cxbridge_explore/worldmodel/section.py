"""Reads the values of a map in a ``world.yaml``, such as probabilities; errors have file and line."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Final

from cxbridge.config import Configuration
from cxbridge.config.documents import Mark
from cxbridge.errors import ConfigError
from cxbridge.suggestions import did_you_mean
from cxbridge_explore.worldmodel.distributions import PARAMETERS, Distribution, Shape
from cxbridge_explore.worldmodel.model import DEFAULT_PROBABILITY, Times

MAX_S: Final = 1e9  # about 30 years
_REPRESENTATIVES: Final = ("median", "min", "max")
_SHAPES: Final = tuple(shape.value for shape in Shape if shape is not Shape.CONSTANT)
_BOUNDS: Final = ("min", "max", "explore")
_EPSILON: Final = 1e-9  # 0.1 + 0.2 + 0.7 is slightly more than 1 in floating point


class Section:
    """A map in a ``world.yaml``.

    :param path: the path of the map in the document, such as ``/skills/0``.
    :param keys: the allowed keys.
    :param required: the keys that must be present.
    :raises ConfigError: if the value is not a map, has another key, or lacks a required one.
    """

    def __init__(
        self, document: Configuration, path: str, keys: Collection[str], required: Collection[str] = ()
    ) -> None:
        self._document, self._path = document, path
        self._keys = document.keys(path)
        # A list or a text in place of a map has no keys.
        if not self._keys and document.exists(path) and (document.is_list(path) or document.get(path).text):
            raise self.error("must be a map", f"with: {', '.join(keys)}")
        for key in self._keys:
            if key not in keys:
                raise self.error("means nothing", did_you_mean(key, keys, f"use: {', '.join(keys)}"), key)
        for key in required:
            if not document.exists(f"{path}/{key}"):
                raise self.error(f"has no {key}", f"give one: {key}: ...")

    def __contains__(self, key: str) -> bool:
        return key in self._keys

    @property
    def mark(self) -> Mark:
        """The place of the map: that of its first value."""
        return self._mark(self._path)

    def _mark(self, path: str) -> Mark:
        document = self._document
        value = document.get(path) if document.exists(path) else next(document.walk(path), None)
        return Mark() if value is None else value.mark

    def error(self, fault: str, hint: str | None = None, key: str = "") -> ConfigError:
        """Return an error about the map, or about the value of a key.

        :param fault: a phrase that follows the path.
        """
        path = f"{self._path}/{key}" if key else self._path
        return self._mark(path).error(f"{path[1:]} {fault}", hint)

    def section(self, key: str, keys: Collection[str], required: Collection[str] = ()) -> Section:
        """Return the map at a key; empty if it is missing."""
        return Section(self._document, f"{self._path}/{key}", keys, required)

    def sections(self, key: str, keys: Collection[str], required: Collection[str] = ()) -> list[Section]:
        """Return the maps in a list; empty if it is missing.

        :raises ConfigError: if the value is not a list of maps.
        """
        path = f"{self._path}/{key}"
        numbers = self._document.keys(path)  # the configuration numbers the entries of a list
        if any(not number.isdigit() for number in numbers):
            raise self.error("must be a list", "begin each entry with a dash", key)
        if self._document.exists(path):
            value = self._document.get(path)
            if value.text or value.items:
                raise self.error("must be a list of maps", "write: - {name: ...}", key)
        return [self.section(f"{key}/{number}", keys, required) for number in numbers]

    def text(self, key: str, default: str = "") -> str:
        return self._document.get_str(f"{self._path}/{key}", default=default)

    def texts(self, key: str) -> Sequence[str]:
        """Return the texts of a list, or the text of a single value."""
        path = f"{self._path}/{key}"
        if not self._document.exists(path):
            return ()
        value = self._document.get(path)
        return value.items if value.is_list else (value.text,)

    def numbers(self, key: str) -> list[float]:
        """Return the numbers of a list, or a single number."""
        path = f"{self._path}/{key}"
        if self._document.is_list(path):
            return self._document.get_floats(path)
        return [self._document.get_float(path)]

    def probability(self, key: str, default: float = DEFAULT_PROBABILITY) -> float:
        """Return a probability.

        :raises ConfigError: if it is not from 0 to 1.
        """
        value = self._document.get_float(f"{self._path}/{key}", default=default)
        if not 0 <= value <= 1:
            raise self.error(f"is {value:g}", "a probability is from 0 to 1", key)
        return value

    def check_total(self, probabilities: Sequence[float]) -> None:
        """Raise `ConfigError` if the probabilities of exclusive events are more than 1 together."""
        total = sum(probabilities)
        if total > 1 + _EPSILON:
            raise self.error(f"has probabilities of {total:g} together", "at most 1")

    def seconds(self, key: str, default: float = 0.0) -> float:
        """Return a time or a duration; see :meth:`checked_seconds`."""
        return self.checked_seconds(key, self._document.get_float(f"{self._path}/{key}", default=default))

    def optional_seconds(self, key: str) -> float | None:
        """Return a time or a duration; None if it is missing."""
        return self.seconds(key) if key in self else None

    def checked_seconds(self, key: str, value: float) -> float:
        """Return a number of seconds at a key.

        :raises ConfigError: if it is negative or too large.
        """
        if not 0 <= value <= MAX_S:
            raise self.error(f"is {value:g}", f"seconds, from 0 to {MAX_S:g}", key)
        return value

    def times(self, key: str, every: float = 0.0) -> Times:
        """Return the moments of decisions, from the keys ``every``, ``from`` and ``until``.

        :param every: the default period.
        """
        default = Times(every)
        section = self.section(key, ("every", "from", "until"))
        times = Times(
            section.seconds("every", default.every),
            section.seconds("from", default.begin),
            section.seconds("until", default.until),
        )
        if times.until < times.begin:
            raise self.error(f"ends at {times.until:g}, before {times.begin:g}", key=key)
        return times

    def duration(self, key: str) -> Distribution | None:
        """Return a number of seconds, or a distribution; None if it is missing."""
        if key not in self:
            return None
        if self._document.exists(f"{self._path}/{key}"):
            return Distribution.constant(self.seconds(key))
        section = self.section(key, (*_SHAPES, *_BOUNDS))
        shapes = [name for name in _SHAPES if name in section]
        if len(shapes) != 1:
            raise self.error(f"names {len(shapes)} distributions", f"one of: {', '.join(_SHAPES)}", key)
        least, most = section.seconds("min"), section.seconds("max", MAX_S)
        if most < least:
            raise section.error(f"is {most:g}, less than the minimum {least:g}", key="max")
        shape = Shape(shapes[0])
        parameters = _parameters(section, shape)
        listed = _representatives(section, Distribution(shape, parameters, least, most))
        return Distribution(shape, parameters, least, most, listed)


def _parameters(section: Section, shape: Shape) -> tuple[float, ...]:
    values, names = section.numbers(shape), PARAMETERS.get(shape)
    if names is None and not values:
        raise section.error("has no values", "choice: [1.0, 2.5]", shape)
    if names is not None and len(values) != len(names):
        raise section.error(f"has {len(values)} parameters", f"it takes: {', '.join(names)}", shape)
    if shape is Shape.UNIFORM and values[0] > values[1]:
        raise section.error(
            f"goes from {values[0]:g} down to {values[1]:g}", "write the smaller value first", shape
        )
    return tuple(section.checked_seconds(shape, value) for value in values)


def _representatives(section: Section, distribution: Distribution) -> tuple[float, ...]:
    """Return the seconds of ``explore``, which represent a distribution in an exploration."""
    if "explore" not in section:
        return ()
    quantiles = (distribution.median, distribution.low_quantile, distribution.high_quantile)
    seconds_by_name = dict(zip(_REPRESENTATIVES, quantiles, strict=True))
    names, listed = ", ".join(_REPRESENTATIVES), []
    for text in section.texts("explore"):
        try:
            seconds = seconds_by_name[text] if text in seconds_by_name else float(text)
        except ValueError:
            hint = did_you_mean(text, _REPRESENTATIVES, f"use seconds, or: {names}")
            raise section.error(f"has '{text}'", hint, "explore") from None
        listed.append(section.checked_seconds("explore", seconds))
    if not listed:
        raise section.error("names no seconds", f"use seconds, or: {names}", "explore")
    return tuple(listed)
