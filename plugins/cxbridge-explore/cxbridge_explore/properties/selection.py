"""Selects the properties that each run of an exploration must have."""

from __future__ import annotations

from collections.abc import Sequence

from cxbridge.run.options import RunOptions
from cxbridge.run.source import source_of
from cxbridge_explore.properties.builtin.table import RUN_ENDS, builtin_properties
from cxbridge_explore.properties.monitor import Property
from cxbridge_explore.properties.reading import combine_properties, find_property, read_scenario_properties


def select_properties(
    options: RunOptions, property_texts: Sequence[str] = (), *, is_time_limited: bool = False
) -> tuple[Property, ...]:
    """Return the requested properties; by default the built-in properties and those of the scenario.

    :param property_texts: the names or forms of the requested properties.
    :param is_time_limited: whether a time limit ends each run with unfinished goals, as in a game. Then the
        default lacks the built-in property :data:`~cxbridge_explore.properties.builtin.table.RUN_ENDS`.
    """
    if property_texts:
        return combine_properties(map(find_property, property_texts))
    built_in = [
        property_
        for property_ in builtin_properties()
        if not (is_time_limited and property_.name == RUN_ENDS)
    ]
    return combine_properties(built_in, read_scenario_properties(source_of(options).config_file()))
