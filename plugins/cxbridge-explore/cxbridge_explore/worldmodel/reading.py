"""Reads a ``world.yaml``; see docs/explore.md#worlds. Errors have file and line."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from cxbridge.config import Configuration
from cxbridge.skiller.simulation.estimators import SkillPattern, read_pattern
from cxbridge_explore.worldmodel.model import (
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
from cxbridge_explore.worldmodel.values import (
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
    file = folder / WORLD_FILE
    return file if file.is_file() else None


def read_world(file: Path) -> WorldModel:
    """Read a world.

    :raises CxbridgeError: if the file cannot be read, or a value is invalid.
    """
    return world_of(Configuration.load(file))


def world_of(document: Configuration) -> WorldModel:
    refuse_unknown(document, "/", _WORLD)
    refuse_unknown(document, "/otherwise", _OTHERWISE)
    return WorldModel(
        skills=tuple(_skill(document, path) for path in items(document, "/skills")),
        otherwise=_model(document, "/otherwise", SkillPattern("*")),
        sensed=tuple(_sensed(document, path) for path in items(document, "/sensed")),
        messages=tuple(_message(document, path) for path in items(document, "/messages")),
        absences=tuple(_absence(document, path) for path in items(document, "/skillers")),
        kills=tuple(_kill(document, path) for path in items(document, "/killed")),
        order=times(document, "/order") if "order" in document.keys("/") else None,
        planner=_planner(document, "/planner") if "planner" in document.keys("/") else None,
    )


def _skill(document: Configuration, path: str) -> SkillModel:
    refuse_unknown(document, path, _SKILL)
    _need(document, path, "name")
    return _model(document, path, read_pattern(document, *path.rsplit("/", 1)))


def _need(document: Configuration, path: str, *names: str) -> None:
    for name in names:
        if not document.exists(f"{path}/{name}"):
            raise wrong(document, path, f"has no {name}", f"give one: {name}: ...")


def _model(document: Configuration, path: str, pattern: SkillPattern) -> SkillModel:
    names = document.keys(path)
    failures: tuple[SkillFailure, ...] = (SkillFailure(),)
    if "fails" in names:
        failure_items = items(document, f"{path}/fails")
        failures = tuple(_failure(document, each, len(failure_items)) for each in failure_items)
    hangs = probability(document, f"{path}/hangs", 0.0)
    total = hangs + sum(each.probability for each in failures)
    if total > 1 + _EPSILON:
        raise wrong(document, path, f"has probabilities of {total:g} together", "at most 1")
    twice = {each.name for each in failures if [other.name for other in failures].count(each.name) > 1}
    if twice:
        raise wrong(document, path, f"has {', '.join(sorted(twice))} twice", "give each its own error")
    return SkillModel(
        pattern,
        failures,
        distribution(document, f"{path}/duration") if "duration" in names else None,
        hangs,
        probability(document, f"{path}/mute", 0.0),
        place_of(document, path),
    )


def _failure(document: Configuration, path: str, of: int) -> SkillFailure:
    refuse_unknown(document, path, _FAILURE)
    error = document.get_str(f"{path}/error", default="")
    has_time = "after" in document.keys(path)
    return SkillFailure(
        "fails" if of == 1 else f"fails({error})",
        error,
        probability(document, f"{path}/probability"),
        distribution(document, f"{path}/after") if has_time else None,
    )


def _sensed(document: Configuration, path: str) -> SensedValue:
    refuse_unknown(document, path, _SENSED)
    _need(document, path, "interface", "field", "values")
    value = document.get(f"{path}/values")
    texts = value.items if value.is_list else (value.text,)
    if len(texts) < _SEVERAL or len(set(texts)) < len(texts):
        raise wrong(document, f"{path}/values", "must be different values, two at least", "[75.0, 3.0]")
    shares = document.get_floats(f"{path}/probabilities", default=[1 - LIKELY, *[LIKELY] * (len(texts) - 1)])
    if len(shares) != len(texts) or not all(0 <= share <= 1 for share in shares) or not sum(shares):
        hint = f"{len(texts)} probabilities, one for each of the values, from 0 to 1"
        raise wrong(document, f"{path}/probabilities", "do not fit the values", hint)
    at_path, after = f"{path}/at", document.get_strings(f"{path}/after", default=[])
    at = () if not document.exists(at_path) else _seconds_listed(document, at_path)
    return SensedValue(
        document.get_str(f"{path}/interface"),
        document.get_str(f"{path}/field"),
        tuple(zip(texts, shares, strict=True)),
        at if at or after else (0.0,),
        tuple(after),
        place_of(document, path),
    )


def _seconds_listed(document: Configuration, path: str) -> tuple[float, ...]:
    values = document.get_floats(path) if document.is_list(path) else [document.get_float(path)]
    for value in values:
        if not value >= 0:
            raise wrong(document, path, f"is {value:g}", "seconds since the run began")
    return tuple(sorted(values))


def _message(document: Configuration, path: str) -> MessageFault:
    refuse_unknown(document, path, _MESSAGE)
    _need(document, path, "interface")
    names = document.keys(path)
    lost = probability(document, f"{path}/lost", LIKELY if "late" not in names else 0.0)
    late = probability(document, f"{path}/late", 0.0)
    if lost + late > 1 + _EPSILON:
        raise wrong(document, path, f"has probabilities of {lost + late:g} together", "at most 1")
    return MessageFault(
        document.get_str(f"{path}/interface"),
        document.get_str(f"{path}/type", default="*"),
        lost,
        late,
        seconds(document, f"{path}/delay", 1.0),
        place_of(document, path),
    )


def _planner(document: Configuration, path: str) -> PlannerModel:
    refuse_unknown(document, path, _PLANNER)
    none, fails, late = (probability(document, f"{path}/{name}", 0.0) for name in _PLANNER[:3])
    if none + fails + late > 1 + _EPSILON:
        raise wrong(document, path, f"has probabilities of {none + fails + late:g} together", "at most 1")
    return PlannerModel(none, fails, late, seconds(document, f"{path}/delay", 1.0))


def _absence(document: Configuration, path: str) -> Absence:
    refuse_unknown(document, path, _SKILLER)
    _need(document, path, "name")
    names = document.keys(path)
    return Absence(
        document.get_str(f"{path}/name"),
        probability(document, f"{path}/probability"),
        times(document, f"{path}/times", Times(every=1.0)) if "times" in names else None,
        seconds(document, f"{path}/back") if "back" in names else None,
        place_of(document, path),
    )


def _kill(document: Configuration, path: str) -> Kill:
    refuse_unknown(document, path, _KILLED)
    names = document.keys(path)
    return Kill(
        document.get_str(f"{path}/agent", default="*"),
        probability(document, f"{path}/probability"),
        times(document, f"{path}/times"),
        seconds(document, f"{path}/back") if "back" in names else None,
        place_of(document, path),
    )
