"""Durations, outcomes and errors of skills, drawn from recorded runs."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cxbridge.errors import SkillError
from cxbridge.skiller.simulation.deciders import Decider, Outcome
from cxbridge.skiller.simulation.estimators import (
    CONFIG_PREFIX,
    EstimatorSettings,
    SkillPattern,
    argument_text,
    invalid_value_error,
)
from cxbridge.skiller.skillstring import SkillStringCall, parse_skill_call
from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.config import Configuration

LOOKUP_PREFIX = f"{CONFIG_PREFIX}/lookup"
"""The path of the lookup estimator's configuration."""

ANY = ".*"
"""A recorded argument that matches every value, as in Fawkes' collections."""


@dataclass(frozen=True, slots=True)
class Sample:
    """A recorded execution of a skill.

    :param seconds: the duration.
    :param status: S_FINAL or S_FAILED.
    """

    skill_string: str
    seconds: float
    status: Status = Status.S_FINAL
    error: str = ""


ReadSamples = Callable[[Path], Iterable[Sample]]
"""Reads a recorded run. Raises :class:`cxbridge.errors.CxbridgeError` if this fails."""


class LookupEstimator(Decider):
    """Draws one of a skill's recorded executions with equal probability.

    :param samples: recorded executions; those whose skill string is not a single call are ignored.
    :param fully_match_args: whether an execution must match all arguments of the call, or only those in the
        whitelist's pattern.
    :param include_failures: whether to draw failed executions, too.
    :param rng: a seeded generator; None: the seed is 0.
    """

    def __init__(
        self,
        samples: Iterable[Sample],
        settings: EstimatorSettings | None = None,
        *,
        fully_match_args: bool = True,
        include_failures: bool = False,
        rng: random.Random | None = None,
    ) -> None:
        self.settings = settings or EstimatorSettings()
        self.priority = self.settings.priority
        self._fully_match_args = fully_match_args
        self._include_failures = include_failures
        self._rng = rng or random.Random(0)  # noqa: S311 - a simulation is reproducible
        self._parsed_samples_by_skill: dict[str, list[tuple[SkillStringCall, Sample]]] = {}
        for sample in samples:
            try:
                call = parse_skill_call(sample.skill_string)
            except SkillError:  # a recorded skill string may be any text
                continue
            self._parsed_samples_by_skill.setdefault(call.name, []).append((call, sample))

    @classmethod
    def from_config(
        cls,
        config: Configuration,
        read_samples: ReadSamples,
        rng: random.Random | None = None,
        prefix: str = LOOKUP_PREFIX,
    ) -> LookupEstimator:
        """Read ``recordings``, ``fully-match-args``, ``include-failures`` and the :class:`EstimatorSettings`.

        :param read_samples: reads a recording, whose path is relative to the configuration file.
        :raises CxbridgeError: if a recording is unreadable or the configuration is wrong.
        """
        path = f"{prefix}/recordings"
        recording_paths = config.get_strings(path) if config.is_list(path) else [config.get_str(path)]
        folder = Path(config.get(path).file).parent
        samples: list[Sample] = []
        for recording_path in recording_paths:
            run_samples = list(read_samples(folder / Path(recording_path).expanduser()))
            if not run_samples:
                raise invalid_value_error(
                    config, path, f"names '{recording_path}', in which no skill ends", "name runs with skills"
                )
            samples += run_samples
        return cls(
            samples,
            EstimatorSettings.from_config(config, prefix),
            fully_match_args=config.get_bool(f"{prefix}/fully-match-args", default=True),
            include_failures=config.get_bool(f"{prefix}/include-failures", default=False),
            rng=rng,
        )

    def decide(self, call: SkillStringCall) -> Outcome | None:
        """Draw a recorded execution of the skill; None if none matches."""
        if not self.settings.allows(call):
            return None
        whitelist_pattern = self.settings.find_pattern(call)
        matches = [
            sample
            for sample_call, sample in self._parsed_samples_by_skill.get(call.name, ())
            if (self._include_failures or sample.status is Status.S_FINAL)
            and self._matches(sample_call, call, whitelist_pattern)
        ]
        if not matches:
            return None
        chosen_sample = self._rng.choice(matches)
        return Outcome(chosen_sample.seconds / self.settings.speed, chosen_sample.status, chosen_sample.error)

    def _matches(
        self, sample_call: SkillStringCall, call: SkillStringCall, whitelist_pattern: SkillPattern | None
    ) -> bool:
        recorded_args = {key: argument_text(value) for key, value in sample_call.args.items()}
        # all arguments of the call count; the recorded execution may have further arguments
        if self._fully_match_args:
            return all(
                recorded_args.get(key) in (ANY, argument_text(value)) for key, value in call.args.items()
            )
        patterns = {} if whitelist_pattern is None else whitelist_pattern.args
        return all(
            key in recorded_args
            and (recorded_args[key] == ANY or re.fullmatch(pattern, recorded_args[key]) is not None)
            for key, pattern in patterns.items()
        )
