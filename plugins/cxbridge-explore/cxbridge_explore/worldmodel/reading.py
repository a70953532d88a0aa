"""Reads a ``world.yaml``; see docs/explore.md#worlds. Errors name the file and the line."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from cxbridge.config import Configuration
from cxbridge.skiller.simulation.estimators import SkillPattern, read_pattern
from cxbridge_explore.worldmodel.model import (
    DEFAULT_PROBABILITY,
    WORLD_FILE,
    Absence,
    Kill,
    MessageLoss,
    PlannerModel,
    SensedField,
    SkillFailure,
    SkillModel,
    WorldModel,
)
from cxbridge_explore.worldmodel.section import Section

# The allowed keys of each section.
_WORLD_KEYS: Final = ("skills", "otherwise", "sensed", "messages", "skillers", "killed", "planner")
_OTHERWISE_KEYS: Final = ("fails", "duration", "hangs")
_SKILL_KEYS: Final = ("name", "args", *_OTHERWISE_KEYS)
_FAILURE_KEYS: Final = ("error", "probability", "after")
_SENSED_KEYS: Final = ("interface", "field", "values", "probabilities", "at", "after")
_MESSAGE_KEYS: Final = ("interface", "type", "lost")
_SKILLER_KEYS: Final = ("name", "probability", "times", "back")
_KILLED_KEYS: Final = ("agent", "probability", "times", "back")
_PLANNER_KEYS: Final = ("none", "fails", "late", "delay")


def find_world(folder: Path) -> Path | None:
    """Return the file of the world in a scenario's folder, or None."""
    file = folder / WORLD_FILE
    return file if file.is_file() else None


def read_world(file: Path) -> WorldModel:
    """Read a world.

    :raises CxbridgeError: if the file cannot be read, or a value is invalid.
    """
    return parse_world(Configuration.load(file))


def parse_world(document: Configuration) -> WorldModel:
    """Return the world that a document describes."""
    world = Section(document, "", _WORLD_KEYS)
    return WorldModel(
        skills=tuple(
            _parse_skill(skill, read_pattern(document, "/skills", str(number)))
            for number, skill in enumerate(world.sections("skills", _SKILL_KEYS, ("name",)))
        ),
        default_skill=_parse_skill(world.section("otherwise", _OTHERWISE_KEYS), SkillPattern("*")),
        sensed=tuple(
            map(_parse_sensed, world.sections("sensed", _SENSED_KEYS, ("interface", "field", "values")))
        ),
        message_losses=tuple(map(_parse_message, world.sections("messages", _MESSAGE_KEYS, ("interface",)))),
        absences=tuple(map(_parse_absence, world.sections("skillers", _SKILLER_KEYS, ("name",)))),
        kills=tuple(map(_parse_kill, world.sections("killed", _KILLED_KEYS))),
        planner=_parse_planner(world.section("planner", _PLANNER_KEYS)) if "planner" in world else None,
    )


def _parse_skill(skill: Section, pattern: SkillPattern) -> SkillModel:
    failures: tuple[SkillFailure, ...] = (SkillFailure(),)
    if "fails" in skill:
        sections = skill.sections("fails", _FAILURE_KEYS)
        failures = tuple(_parse_failure(section, is_only=len(sections) == 1) for section in sections)
    hang_probability = skill.probability("hangs", 0.0)
    skill.check_total([hang_probability, *(failure.probability for failure in failures)])
    names = [failure.name for failure in failures]
    # A path identifies a failure of a skill by its name.
    if repeated_names := {name for name in names if names.count(name) > 1}:
        raise skill.error(
            f"has {', '.join(sorted(repeated_names))} twice", "give each failure a different error"
        )
    return SkillModel(pattern, failures, skill.duration("duration"), hang_probability, skill.mark)


def _parse_failure(failure: Section, *, is_only: bool) -> SkillFailure:
    error = failure.text("error")
    name = "fails" if is_only else f"fails({error})"
    return SkillFailure(name, error, failure.probability("probability"), failure.duration("after"))


def _parse_sensed(sensed: Section) -> SensedField:
    texts = sensed.texts("values")
    if len(texts) < 2 or len(set(texts)) < len(texts):  # noqa: PLR2004 - as the error says
        raise sensed.error("must be at least two different values", "write e.g. [75.0, 3.0]", "values")
    weights = [1 - DEFAULT_PROBABILITY, *[DEFAULT_PROBABILITY] * (len(texts) - 1)]
    if "probabilities" in sensed:
        weights = sensed.numbers("probabilities")
    if len(weights) != len(texts) or not all(0 <= weight <= 1 for weight in weights) or not sum(weights):
        hint = f"give {len(texts)} probabilities from 0 to 1, one for each value"
        raise sensed.error("do not match the values", hint, "probabilities")
    times = sensed.numbers("at") if "at" in sensed else []
    for seconds in times:
        if not seconds >= 0:
            raise sensed.error(f"is {seconds:g}", "give the seconds since the start of the run", "at")
    skills = tuple(sensed.texts("after"))
    return SensedField(
        sensed.text("interface"),
        sensed.text("field"),
        tuple(zip(texts, weights, strict=True)),
        tuple(sorted(times)) if times or skills else (0.0,),  # without moments: once, at the start
        skills,
        sensed.mark,
    )


def _parse_message(message: Section) -> MessageLoss:
    return MessageLoss(
        message.text("interface"), message.text("type", "*"), message.probability("lost"), message.mark
    )


def _parse_planner(planner: Section) -> PlannerModel:
    no_plan, failure, delay = (planner.probability(key, 0.0) for key in ("none", "fails", "late"))
    planner.check_total([no_plan, failure, delay])
    return PlannerModel(no_plan, failure, delay, planner.seconds("delay", 1.0))


def _parse_absence(skiller: Section) -> Absence:
    return Absence(
        skiller.text("name"),
        skiller.probability("probability"),
        # once a second if `times` has no `every`, while `killed` decides in each loop
        skiller.times("times", period_s=1.0) if "times" in skiller else None,
        skiller.optional_seconds("back"),
        skiller.mark,
    )


def _parse_kill(kill: Section) -> Kill:
    return Kill(
        kill.text("agent", "*"),
        kill.probability("probability"),
        kill.times("times"),
        kill.optional_seconds("back"),
        kill.mark,
    )
