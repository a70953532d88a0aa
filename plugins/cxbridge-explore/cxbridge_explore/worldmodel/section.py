"""Reads the values of a map in a ``world.yaml``, such as probabilities. Errors name the file and the line."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Final

from cxbridge.config import Configuration
from cxbridge.config.documents import Mark
from cxbridge.errors import ConfigError
from cxbridge.suggestions import did_you_mean
from cxbridge_explore.worldmodel.distributions import PARAMETER_NAMES, Distribution, Shape
from cxbridge_explore.worldmodel.model import DEFAULT_PROBABILITY, DecisionTimes

MAX_S: Final = 1e9  # about 30 years, longer than each run; finite, so that times can be computed
_SHAPE_KEYS: Final = tuple(shape.value for shape in Shape if shape is not Shape.CONSTANT)
_BOUND_KEYS: Final = ("min", "max")
_ROUNDING_ERROR: Final = 1e-9  # 0.1 + 0.2 + 0.7 is slightly more than 1 in floating point


class Section:
    """A map in a ``world.yaml``.

    :param path: the path of the map in the document, such as ``/skills/0``.
    :param keys: the allowed keys.
    :param required_keys: the keys that must be present.
    :raises ConfigError: if the value is not a map, has a key that is not allowed, or lacks a required key.
    """

    def __init__(
        self, document: Configuration, path: str, keys: Collection[str], required_keys: Collection[str] = ()
    ) -> None:
        self._document, self._path = document, path
        self._keys = document.keys(path)
        # A list or a text in place of a map has no keys.
        if not self._keys and document.exists(path) and (document.is_list(path) or document.get(path).text):
            raise self.error("must be a map", f"use the keys: {', '.join(keys)}")
        for key in self._keys:
            if key not in keys:
                raise self.error("is an unknown key", did_you_mean(key, keys, f"use: {', '.join(keys)}"), key)
        for key in required_keys:
            if not document.exists(f"{path}/{key}"):
                raise self.error(f"has no {key}", f"add: {key}: ...")

    def __contains__(self, key: str) -> bool:
        return key in self._keys

    @property
    def mark(self) -> Mark:
        """The place of the first value of the map in the file."""
        return self._find_mark(self._path)

    def _find_mark(self, path: str) -> Mark:
        document = self._document
        value = document.get(path) if document.exists(path) else next(document.walk(path), None)
        return Mark() if value is None else value.mark

    def error(self, fault: str, hint: str | None = None, key: str = "") -> ConfigError:
        """Return an error about the map, or about the value of a key.

        :param fault: describes the fault; the phrase follows the path in the message.
        """
        path = f"{self._path}/{key}" if key else self._path
        return self._find_mark(path).error(f"{path.removeprefix('/')} {fault}", hint)

    def section(self, key: str, keys: Collection[str], required_keys: Collection[str] = ()) -> Section:
        """Return the map at a key; an empty map if the key is missing."""
        return Section(self._document, f"{self._path}/{key}", keys, required_keys)

    def sections(self, key: str, keys: Collection[str], required_keys: Collection[str] = ()) -> list[Section]:
        """Return the maps in the list at a key; an empty list if the key is missing.

        :raises ConfigError: if the value is not a list of maps.
        """
        path = f"{self._path}/{key}"
        entry_keys = self._document.keys(path)  # the configuration numbers the entries of a list
        if any(not entry_key.isdigit() for entry_key in entry_keys):
            raise self.error("must be a list", "begin each entry with a dash", key)
        if self._document.exists(path):
            value = self._document.get(path)
            if value.text or value.items:
                raise self.error("must be a list of maps", "write: - {name: ...}", key)
        return [self.section(f"{key}/{entry_key}", keys, required_keys) for entry_key in entry_keys]

    def text(self, key: str, default: str = "") -> str:
        return self._document.get_str(f"{self._path}/{key}", default=default)

    def texts(self, key: str) -> Sequence[str]:
        """Return the texts of a list, or the text of a single value; empty if the key is missing."""
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

        :raises ConfigError: if the number is not from 0 to 1.
        """
        value = self._document.get_float(f"{self._path}/{key}", default=default)
        if not 0 <= value <= 1:
            raise self.error(f"is {value:g}", "use a probability from 0 to 1", key)
        return value

    def check_total(self, probabilities: Sequence[float]) -> None:
        """Raise `ConfigError` if the sum of the probabilities of exclusive events exceeds 1."""
        total = sum(probabilities)
        if total > 1 + _ROUNDING_ERROR:
            raise self.error(f"has probabilities whose sum is {total:g}", "use a sum of at most 1")

    def seconds(self, key: str, default: float = 0.0) -> float:
        """Return a time or a duration; see :meth:`checked_seconds`."""
        return self.checked_seconds(key, self._document.get_float(f"{self._path}/{key}", default=default))

    def optional_seconds(self, key: str) -> float | None:
        """Return a time or a duration; None if the key is missing."""
        return self.seconds(key) if key in self else None

    def checked_seconds(self, key: str, value: float) -> float:
        """Return a number of seconds after a check of its range.

        :param key: the key of the number, for the error.
        :raises ConfigError: if the number is negative or too large.
        """
        if not 0 <= value <= MAX_S:
            raise self.error(f"is {value:g}", f"use seconds from 0 to {MAX_S:g}", key)
        return value

    def times(self, key: str, period_s: float = 0.0) -> DecisionTimes:
        """Return the moments of decisions, from the keys ``every``, ``from`` and ``until``.

        :param period_s: the default period.
        :raises ConfigError: if a number is invalid, or the last moment is before the first.
        """
        default = DecisionTimes(period_s)
        section = self.section(key, ("every", "from", "until"))
        times = DecisionTimes(
            section.seconds("every", default.period_s),
            section.seconds("from", default.begin_s),
            section.seconds("until", default.end_s),
        )
        if times.end_s < times.begin_s:
            raise self.error(f"ends at {times.end_s:g}, before {times.begin_s:g}", key=key)
        return times

    def duration(self, key: str) -> Distribution | None:
        """Return the distribution at a key, constant for a number; None if the key is missing.

        :raises ConfigError: if the value is not exactly one distribution, or a number is invalid.
        """
        if key not in self:
            return None
        if self._document.exists(f"{self._path}/{key}"):
            return Distribution.constant(self.seconds(key))
        section = self.section(key, (*_SHAPE_KEYS, *_BOUND_KEYS))
        shape_keys = [name for name in _SHAPE_KEYS if name in section]
        if len(shape_keys) != 1:
            raise self.error(
                f"has {len(shape_keys)} distributions", f"use one of: {', '.join(_SHAPE_KEYS)}", key
            )
        min_s, max_s = section.seconds("min"), section.seconds("max", MAX_S)
        if max_s < min_s:
            raise section.error(f"is {max_s:g}, less than the minimum {min_s:g}", key="max")
        (shape,) = map(Shape, shape_keys)
        return Distribution(shape, _parse_parameters(section, shape), min_s, max_s)


def _parse_parameters(section: Section, shape: Shape) -> tuple[float, ...]:
    """Return the parameters of a shape.

    :raises ConfigError: if their number, their order or a value is invalid.
    """
    values, names = section.numbers(shape), PARAMETER_NAMES.get(shape)
    if names is None and not values:
        raise section.error("has no values", "write e.g. choice: [1.0, 2.5]", shape)
    if names is not None and len(values) != len(names):
        raise section.error(f"has {len(values)} parameters", f"write: {', '.join(names)}", shape)
    if shape is Shape.UNIFORM and values[0] > values[1]:
        raise section.error(
            f"begins with {values[0]:g}, which is greater than {values[1]:g}",
            "write the smaller value first",
            shape,
        )
    return tuple(section.checked_seconds(shape, value) for value in values)
