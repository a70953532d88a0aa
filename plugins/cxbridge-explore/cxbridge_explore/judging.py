"""Selects the properties of an exploration."""

from __future__ import annotations

from collections.abc import Sequence

from cxbridge.run.options import RunOptions
from cxbridge.run.source import source_of
from cxbridge_explore.properties.builtin.table import RUN_ENDS, builtin_properties
from cxbridge_explore.properties.monitor import Property
from cxbridge_explore.properties.reading import find_property, joined, properties_beside


def properties_of(
    options: RunOptions, property_texts: Sequence[str] = (), *, is_cut: bool = False
) -> tuple[Property, ...]:
    """Return the given properties; without any, the built-in ones and those of the scenario.

    :param property_texts: names and forms.
    :param is_cut: whether runs are cut by a time limit with unfinished goals.
    """
    if property_texts:
        return joined(map(find_property, property_texts))
    built_in = [
        property_ for property_ in builtin_properties() if not (is_cut and property_.name == RUN_ENDS)
    ]
    return joined(built_in, properties_beside(source_of(options).config_file()))
