"""The features of this package for CLIPS environments, each made by one module from the context of a run.

A module ``NAME.py`` has a function ``make(context)`` that returns the feature. It is found by its name, with
a dash for each underscore, and imported when an environment asks for the feature.
"""

from __future__ import annotations

import pkgutil
from functools import partial
from importlib import import_module
from typing import Final

from cxbridge.executive.feature import Feature, LazyFeature
from cxbridge.run.context import SKILL_BOARD, RunContext

EARLY: Final = ("blackboard", "config", "redefine-warning", "pddl-parser")
"""The features that agents have always used, in the order of Fawkes' facts about them: made at once."""

ORDER: Final = ("robot_memory", "tf", "navgraph", "planner", "protobuf", "motor-switch", "skill-board")
"""The order of the others in these facts; a feature that is not here comes last."""

SECTIONS: Final = {
    "planner": "/planner",
    "protobuf": "/clips-protobuf",
    "motor-switch": "/clips-motor-switch",
}
"""Where features are configured. What is configured is made at once: a mistake in it is reported first."""


def package_features(context: RunContext) -> list[Feature | LazyFeature]:
    """Return the features of this package; those that not every agent asks for are imported when one does."""
    if context.paths.ros2cx is not None:
        from cxbridge.run.ros2cx_features import ros2cx_features  # noqa: PLC0415 - start-up time is a feature

        return [*ros2cx_features(context, context.paths.ros2cx)]
    features: list[Feature | LazyFeature] = []
    for name, module in _modules().items():
        if name == "skill-board" and not context.config.keys(SKILL_BOARD):
            continue
        make = partial(_make, module, context)
        at_once = name in EARLY or (name in SECTIONS and context.config.keys(SECTIONS[name]))
        features.append(make() if at_once else LazyFeature(name, make))
    return features


def _make(module: str, context: RunContext) -> Feature:
    feature = import_module(f"{__name__}.{module}").make(context)
    assert isinstance(feature, Feature), module
    return feature


def _modules() -> dict[str, str]:
    """Return the modules by the names of their features, in the order of the facts."""
    found = {module.name for module in pkgutil.iter_modules(__path__)}
    named = {name: name.replace("-", "_") for name in (*EARLY, *ORDER)}
    others = sorted(found - {*named.values()})
    return named | {module.replace("_", "-"): module for module in others}
