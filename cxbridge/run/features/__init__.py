"""The features of this package for CLIPS environments, each made by one module from the context of a run.

A module ``NAME.py`` has a function ``make(context)`` that returns the feature, and imports what the feature
needs only then: it is called when an environment asks for the feature. The name of the feature is that of the
module, with a dash for each underscore.

A module may have ``SECTION``, the part of the configuration that is about its feature: when that is there,
the feature is made at once, so that a mistake in it is reported first. It may have ``NEEDED_SECTION``: a part
of the configuration without which there is no such feature.
"""

from __future__ import annotations

import pkgutil
from functools import partial
from importlib import import_module
from types import ModuleType
from typing import Final

from cxbridge.executive.feature import Feature, LazyFeature
from cxbridge.run.context import RunContext

EARLY: Final = ("blackboard", "config", "redefine-warning", "pddl-parser")
"""The features that agents have always used, in the order of Fawkes' facts about them: made at once."""

ORDER: Final = ("robot_memory", "tf", "navgraph", "planner", "protobuf", "motor-switch", "skill-board")
"""The order of the others in these facts; a feature that is not here comes last."""


def package_features(context: RunContext) -> list[Feature | LazyFeature]:
    """Return the features of this package; those that not every agent asks for are imported when one does."""
    if context.paths.ros2cx is not None:
        from cxbridge.run.ros2cx_features import ros2cx_features  # noqa: PLC0415 - start-up time is a feature

        return [*ros2cx_features(context, context.paths.ros2cx)]
    features: list[Feature | LazyFeature] = []
    for name, module_name in _modules().items():
        module = import_module(f"{__name__}.{module_name}")
        needed = getattr(module, "NEEDED_SECTION", "")
        if needed and not context.config.keys(needed):
            continue
        section = getattr(module, "SECTION", "")
        at_once = name in EARLY or bool(section and context.config.keys(section))
        make = partial(_make, module, context)
        features.append(make() if at_once else LazyFeature(name, make))
    return features


def _make(module: ModuleType, context: RunContext) -> Feature:
    feature = module.make(context)
    assert isinstance(feature, Feature), module.__name__
    return feature


def _modules() -> dict[str, str]:
    """Return the modules by the names of their features, in the order of the facts."""
    found = {module.name for module in pkgutil.iter_modules(__path__)}
    named = {name: name.replace("-", "_") for name in (*EARLY, *ORDER)}
    others = sorted(found - {*named.values()})
    return named | {module.replace("_", "-"): module for module in others}
