"""Finds properties: by name, by their text form, and in the ``properties.yaml`` of a scenario."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from pathlib import Path
from typing import Final

from cxbridge.config.documents import YamlList, YamlMap, YamlScalar, parse_documents
from cxbridge.errors import ConfigError
from cxbridge.file_access import file_errors
from cxbridge.suggestions import did_you_mean
from cxbridge_explore.properties.builtin.table import builtin_properties
from cxbridge_explore.properties.forms import FORMS, read_property
from cxbridge_explore.properties.monitor import Property

PROPERTIES_FILE: Final = "properties.yaml"

_LIST_HINT: Final = (
    f"write a list; an entry is one of: {'; '.join(FORMS)}; an entry may have a name: 'NAME: FORM'"
)


def read_properties(file: Path) -> list[Property]:
    """Read the properties of a file.

    :raises CxbridgeError: if the file cannot be read, or a property is invalid.
    """
    with file_errors():
        yaml_bytes = file.read_bytes()
    properties: list[Property] = []
    for root in parse_documents(yaml_bytes, str(file)):
        if not isinstance(root, YamlList):
            if isinstance(root, YamlScalar) and root.is_null:
                continue  # an empty document
            raise root.mark.error("the file must be a list of properties", _LIST_HINT)
        for item in root.items:
            match item:
                case YamlScalar(is_null=False):
                    properties.append(read_property(item.text, item.mark))
                # NAME: FORM without quotes is a map in YAML
                case YamlMap(pairs=[(YamlScalar() as name, YamlScalar() as form)]):
                    properties.append(read_property(f"{name.text}: {form.text}", form.mark))
                case _:
                    raise item.mark.error("the entry must be a property", _LIST_HINT)
    return properties


def find_property(text: str) -> Property:
    """Return a built-in property by name, or parse a text form.

    :raises ConfigError: if the text is neither.
    """
    built_in_properties = {property_.name: property_ for property_ in builtin_properties()}
    name = text.strip()
    if name in built_in_properties:
        return built_in_properties[name]
    # each form has parentheses, so that a text without parentheses is a misspelt name
    if "(" not in name and (suggestion := did_you_mean(name, built_in_properties)):
        raise ConfigError(f"there is no property '{name}'", hint=suggestion)
    return read_property(text)


def read_scenario_properties(scenario: Path | None) -> list[Property]:
    """Return the properties in a scenario's folder; empty without a ``properties.yaml``."""
    if scenario is None:
        return []
    file = (scenario if scenario.is_dir() else scenario.parent) / PROPERTIES_FILE
    return read_properties(file) if file.is_file() else []


def combine_properties(*groups: Iterable[Property]) -> tuple[Property, ...]:
    """Return the properties of all groups in one tuple.

    :raises ConfigError: if two properties have the same name.
    """
    properties_by_name: dict[str, Property] = {}
    for property_ in chain.from_iterable(groups):
        name = property_.name
        if name in properties_by_name:
            raise ConfigError(f"there are two properties '{name}'", hint="rename a property: NAME: FORM")
        properties_by_name[name] = property_
    return tuple(properties_by_name.values())
