"""Selects the properties of an exploration."""

from __future__ import annotations

from collections.abc import Sequence

from cxbridge.run.options import RunOptions
from cxbridge.run.source import source_of
from cxbridge_explore.properties.builtin.table import RUN_ENDS, builtin_properties
from cxbridge_explore.properties.monitor import Property
from cxbridge_explore.properties.reading import combine_properties, find_property, properties_beside


def properties_of(
    options: RunOptions, property_texts: Sequence[str] = (), *, is_cut: bool = False
) -> tuple[Property, ...]:
    """Return the given properties; by default the built-in properties and the properties of the scenario.

    :param property_texts: the names or forms of properties.
    :param is_cut: whether a time limit ends each run with unfinished goals, as in a game; then the property
        that each run ends is left out.
    """
    if property_texts:
        return combine_properties(map(find_property, property_texts))
    built_in = [
        property_ for property_ in builtin_properties() if not (is_cut and property_.name == RUN_ENDS)
    ]
    return combine_properties(built_in, properties_beside(source_of(options).config_file()))
