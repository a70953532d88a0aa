"""Reads a ``world.yaml``; see docs/worlds.md. Errors name file and line."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from cxbridge.config import Configuration
from cxbridge.skiller.simulation.estimators import SkillPattern, read_pattern
from cxbridge.worlds.model import (
    LIKELY,
    WORLD_FILE,
    Absence,
    Kill,
    MessageFault,
    PlannerModel,
    SensedValue,
    SkillFailure,
    SkillModel,
    Times,
    WorldModel,
)
from cxbridge.worlds.values import (
    distribution,
    items,
    place_of,
    probability,
    refuse_unknown,
    seconds,
    times,
    wrong,
)

_WORLD: Final = ("skills", "otherwise", "sensed", "messages", "skillers", "killed", "order", "planner")
_OTHERWISE: Final = ("fails", "duration", "hangs", "mute")
_SKILL: Final = ("name", "args", *_OTHERWISE)
_FAILURE: Final = ("error", "probability", "after")
_SENSED: Final = ("interface", "field", "values", "probabilities", "at", "after")
_MESSAGE: Final = ("interface", "type", "lost", "late", "delay")
_SKILLER: Final = ("name", "probability", "times", "back")
_KILLED: Final = ("agent", "probability", "times", "back")
_PLANNER: Final = ("none", "fails", "late", "delay")
_SEVERAL: Final = 2
_EPSILON: Final = 1e-9


def find_world(folder: Path) -> Path | None:
    """Return the ``world.yaml`` in a folder, if there is one."""
    file = folder / WORLD_FILE
    return file if file.is_file() else None


def read_world(file: Path) -> WorldModel:
    """Read a world.

    :raises CxbridgeError: when the file cannot be read, or something in it makes no sense.
    """
    return world_of(Configuration.load(file))


def world_of(config: Configuration) -> WorldModel:
    """Return the world that a configuration is.

    :raises CxbridgeError: when something in it makes no sense.
    """
    refuse_unknown(config, "/", _WORLD)
    refuse_unknown(config, "/otherwise", _OTHERWISE)
    return WorldModel(
        skills=tuple(_skill(config, path) for path in items(config, "/skills")),
        otherwise=_model(config, "/otherwise", SkillPattern("*")),
        sensed=tuple(_sensed(config, path) for path in items(config, "/sensed")),
        messages=tuple(_message(config, path) for path in items(config, "/messages")),
        absences=tuple(_absence(config, path) for path in items(config, "/skillers")),
        kills=tuple(_kill(config, path) for path in items(config, "/killed")),
        order=times(config, "/order") if "order" in config.keys("/") else None,
        planner=_planner(config, "/planner") if "planner" in config.keys("/") else None,
    )


def _skill(config: Configuration, path: str) -> SkillModel:
    refuse_unknown(config, path, _SKILL)
    _need(config, path, "name")
    return _model(config, path, read_pattern(config, *path.rsplit("/", 1)))


def _need(config: Configuration, path: str, *names: str) -> None:
    for name in names:
        if not config.exists(f"{path}/{name}"):
            raise wrong(config, path, f"has no {name}", f"give one: {name}: ...")


def _model(config: Configuration, path: str, pattern: SkillPattern) -> SkillModel:
    names = config.keys(path)
    failures: tuple[SkillFailure, ...] = (SkillFailure(),)
    if "fails" in names:
        found = items(config, f"{path}/fails")
        failures = tuple(_failure(config, each, len(found)) for each in found)
    hangs = probability(config, f"{path}/hangs", 0.0)
    total = hangs + sum(each.probability for each in failures)
    if total > 1 + _EPSILON:
        raise wrong(config, path, f"has probabilities of {total:g} together", "at most 1")
    twice = {each.name for each in failures if [other.name for other in failures].count(each.name) > 1}
    if twice:
        raise wrong(config, path, f"has {', '.join(sorted(twice))} twice", "give each its own error")
    return SkillModel(
        pattern,
        failures,
        distribution(config, f"{path}/duration") if "duration" in names else None,
        hangs,
        probability(config, f"{path}/mute", 0.0),
        place_of(config, path),
    )


def _failure(config: Configuration, path: str, of: int) -> SkillFailure:
    refuse_unknown(config, path, _FAILURE)
    error = config.get_str(f"{path}/error", default="")
    has_time = "after" in config.keys(path)
    return SkillFailure(
        "fails" if of == 1 else f"fails({error})",
        error,
        probability(config, f"{path}/probability"),
        distribution(config, f"{path}/after") if has_time else None,
    )


def _sensed(config: Configuration, path: str) -> SensedValue:
    refuse_unknown(config, path, _SENSED)
    _need(config, path, "interface", "field", "values")
    value = config.get(f"{path}/values")
    texts = value.items if value.is_list else (value.text,)
    if len(texts) < _SEVERAL or len(set(texts)) < len(texts):
        raise wrong(config, f"{path}/values", "must be different values, two at least", "[75.0, 3.0]")
    shares = config.get_floats(f"{path}/probabilities", default=[1 - LIKELY, *[LIKELY] * (len(texts) - 1)])
    if len(shares) != len(texts) or not all(0 <= share <= 1 for share in shares) or not sum(shares):
        hint = f"{len(texts)} probabilities, one for each of the values, from 0 to 1"
        raise wrong(config, f"{path}/probabilities", "do not fit the values", hint)
    at_path, after = f"{path}/at", config.get_strings(f"{path}/after", default=[])
    at = () if not config.exists(at_path) else _seconds_listed(config, at_path)
    return SensedValue(
        config.get_str(f"{path}/interface"),
        config.get_str(f"{path}/field"),
        tuple(zip(texts, shares, strict=True)),
        at if at or after else (0.0,),
        tuple(after),
        place_of(config, path),
    )


def _seconds_listed(config: Configuration, path: str) -> tuple[float, ...]:
    values = config.get_floats(path) if config.is_list(path) else [config.get_float(path)]
    for value in values:
        if not value >= 0:
            raise wrong(config, path, f"is {value:g}", "seconds since the run began")
    return tuple(sorted(values))


def _message(config: Configuration, path: str) -> MessageFault:
    refuse_unknown(config, path, _MESSAGE)
    _need(config, path, "interface")
    names = config.keys(path)
    lost = probability(config, f"{path}/lost", LIKELY if "late" not in names else 0.0)
    late = probability(config, f"{path}/late", 0.0)
    if lost + late > 1 + _EPSILON:
        raise wrong(config, path, f"has probabilities of {lost + late:g} together", "at most 1")
    return MessageFault(
        config.get_str(f"{path}/interface"),
        config.get_str(f"{path}/type", default="*"),
        lost,
        late,
        seconds(config, f"{path}/delay", 1.0),
        place_of(config, path),
    )


def _planner(config: Configuration, path: str) -> PlannerModel:
    refuse_unknown(config, path, _PLANNER)
    none, fails, late = (probability(config, f"{path}/{name}", 0.0) for name in _PLANNER[:3])
    if none + fails + late > 1 + _EPSILON:
        raise wrong(config, path, f"has probabilities of {none + fails + late:g} together", "at most 1")
    return PlannerModel(none, fails, late, seconds(config, f"{path}/delay", 1.0))


def _absence(config: Configuration, path: str) -> Absence:
    refuse_unknown(config, path, _SKILLER)
    _need(config, path, "name")
    names = config.keys(path)
    return Absence(
        config.get_str(f"{path}/name"),
        probability(config, f"{path}/probability"),
        times(config, f"{path}/times", Times(every=1.0)) if "times" in names else None,
        seconds(config, f"{path}/back") if "back" in names else None,
        place_of(config, path),
    )


def _kill(config: Configuration, path: str) -> Kill:
    refuse_unknown(config, path, _KILLED)
    names = config.keys(path)
    return Kill(
        config.get_str(f"{path}/agent", default="*"),
        probability(config, f"{path}/probability"),
        times(config, f"{path}/times"),
        seconds(config, f"{path}/back") if "back" in names else None,
        place_of(config, path),
    )
