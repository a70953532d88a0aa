"""Fault injection: simulated skills fail with some probability, or at chosen calls."""

from __future__ import annotations

import random
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from cxbridge.skiller.simulation.deciders import Decider, Outcome
from cxbridge.skiller.simulation.estimators import SkillPattern, invalid_value_error, read_pattern
from cxbridge.skiller.skillstring import SkillStringCall
from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.config import Configuration

FAILURES_PREFIX = "/plugins/skiller-simulator/failures"
"""The path of the configuration of failures."""

_ENTRY_KEYS = frozenset({"name", "args", "probability", "calls", "error", "after"})


@dataclass(slots=True)
class Failure:
    """An injected failure.

    :param pattern: the affected calls.
    :param probability: the probability of failure, 0 to 1.
    :param calls: the numbers of the failing calls among the matching calls, from 1.
    :param error: the error of the failing skill.
    :param after: the share of its duration that a failing skill takes, 0 to 1.
    """

    pattern: SkillPattern
    probability: float = 0.0
    calls: Sequence[int] = ()
    error: str = "failure of the simulation"
    after: float = 1.0
    _call_count: int = field(default=0, init=False)

    def strikes(self, call: SkillStringCall, rng: random.Random) -> bool:
        """Count a matching call; return whether the call fails."""
        if not self.pattern.matches(call):
            return False
        self._call_count += 1
        # draw for each call, so that the random numbers of a run do not depend on the counts
        is_drawn = rng.random() < self.probability
        return is_drawn or self._call_count in self.calls


class FailureInjector(Decider):
    """Makes skills fail.

    :param failures: the first failure that strikes decides; all failures count the call.
    :param rng: a seeded generator; None: the seed is 0.
    """

    # the injected failures decide first: the answer of another decider would hide them
    priority = sys.maxsize

    def __init__(self, failures: Sequence[Failure] = (), rng: random.Random | None = None) -> None:
        self._failures = failures
        self._rng = rng or random.Random(0)  # noqa: S311 - a simulation is reproducible

    @classmethod
    def from_config(
        cls, config: Configuration, rng: random.Random | None = None, prefix: str = FAILURES_PREFIX
    ) -> FailureInjector:
        """Read the entries below ``prefix``, sorted by key.

        :raises ConfigError: if a value has another type.
        :raises SkillerError: if an entry lacks its name, or both probability and calls, or if a setting is
            invalid or unknown.
        """
        return cls([_read_failure(config, prefix, key) for key in sorted(config.keys(prefix))], rng)

    def decide(self, call: SkillStringCall) -> Outcome | None:
        """Return the injected failure of a call, or None. Counts the call."""
        # a list, so that each failure counts the call
        striking_failures = [failure for failure in self._failures if failure.strikes(call, self._rng)]
        if not striking_failures:
            return None
        return Outcome(None, Status.S_FAILED, striking_failures[0].error, share=striking_failures[0].after)


def _read_failure(config: Configuration, prefix: str, key: str) -> Failure:
    path = f"{prefix}/{key}"
    keys = config.keys(path)
    hint = "an entry must have name, and probability or calls; it may have args, error, after"
    for name in keys:
        if name not in _ENTRY_KEYS:
            raise invalid_value_error(config, f"{path}/{name}", "is not a setting of a failure", hint)
    # without probability and calls the failure would never strike
    if "name" not in keys or not {"probability", "calls"} & set(keys):
        # the place of a missing setting is that of the entry's first setting, which has a line in the file
        first_path = f"{path}/{keys[0]}" if keys else path
        raise invalid_value_error(
            config,
            first_path,
            f"belongs to the failure '{key}', which needs 'name', and 'probability' or 'calls'",
            hint,
        )
    return Failure(
        read_pattern(config, prefix, key),
        probability=_read_share(config, f"{path}/probability", 0.0),
        calls=_read_calls(config, f"{path}/calls"),
        error=config.get_str(f"{path}/error") if "error" in keys else f"{key} (simulated)",
        after=_read_share(config, f"{path}/after", 1.0),
    )


def _read_share(config: Configuration, path: str, default: float) -> float:
    if not config.exists(path):
        return default
    share = config.get_float(path)
    if not 0 <= share <= 1:
        raise invalid_value_error(config, path, f"is {share:g}", "write a number from 0 to 1")
    return share


def _read_calls(config: Configuration, path: str) -> Sequence[int]:
    if not config.exists(path):
        return ()
    numbers = config.get_uints(path) if config.is_list(path) else [config.get_uint(path)]
    if 0 in numbers:
        raise invalid_value_error(config, path, "has a call 0", "calls are counted from 1")
    return numbers
