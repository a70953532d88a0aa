"""Construction of the simulated Skiller with its configured estimators and failures."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

from cxbridge.clock import Clock
from cxbridge.events import EventBus
from cxbridge.skiller.simulation.deciders import Decider
from cxbridge.skiller.simulation.estimators import STATIC_PREFIX, StaticEstimator
from cxbridge.skiller.simulation.faults import FailureInjector
from cxbridge.skiller.simulation.recorded import LOOKUP_PREFIX, LookupEstimator, ReadSamples
from cxbridge.skiller.simulation.simulator import SkillerSimulator

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.config import Configuration

SEED_PATH = "/plugins/skiller-simulator/seed"
"""The configuration key of the seed of all random numbers."""


def make_simulator(
    board: BlackBoard,
    clock: Clock,
    bus: EventBus,
    *,
    config: Configuration | None = None,
    name: str = "Skiller",
    read_samples: ReadSamples | None = None,
    further_deciders: Sequence[Decider] = (),
) -> SkillerSimulator:
    """Make a Skiller that waits as long as the estimators in ``config`` decide.

    :param config: without an estimator in the configuration, a skill takes a second unless a further decider
        decides; None: there are only further deciders.
    :param name: the id of the SkillerInterface.
    :param read_samples: reads recorded runs for the lookup estimator; None: no lookup.
    :param further_deciders: deciders besides those in ``config``.
    :raises CxbridgeError: if the configuration is wrong or a recorded run cannot be read.
    :raises BlackBoardError: if the interface has another writer.
    """
    if config is None:
        return SkillerSimulator(board, clock, bus, further_deciders, name=name)
    seed = config.get_uint(SEED_PATH, default=0)
    estimators: list[Decider] = []
    if config.keys(STATIC_PREFIX):
        estimators.append(StaticEstimator.from_config(config))
    if config.exists(f"{LOOKUP_PREFIX}/recordings") and read_samples is not None:
        estimators.append(LookupEstimator.from_config(config, read_samples, _make_rng(seed, name, "lookup")))
    deciders = [
        make_failure_injector(config, name),
        *further_deciders,
        *(estimators or [StaticEstimator(seconds=1.0)]),
    ]
    return SkillerSimulator(board, clock, bus, deciders, name=name)


def make_failure_injector(config: Configuration, name: str) -> FailureInjector:
    """Make the fault injection of a Skiller, or of an agent on the skill board.

    :param name: the name of the Skiller or agent, which has its own random numbers.
    :raises ConfigError: if a value has another type.
    :raises SkillerError: if a failure in the configuration is wrong.
    """
    seed = config.get_uint(SEED_PATH, default=0)
    return FailureInjector.from_config(config, _make_rng(seed, name, "failures"))


def _make_rng(seed: int, *purpose: str) -> random.Random:
    """Return a separate generator for a purpose, so that purposes do not influence each other's draws."""
    return random.Random(f"{seed} {' '.join(purpose)}")  # noqa: S311 - a simulation is reproducible
