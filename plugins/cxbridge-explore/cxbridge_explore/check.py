"""The check of a scenario's world and properties, for ``cxbridge check``."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from cxbridge.errors import CxbridgeError
from cxbridge_explore.properties.builtin.table import builtin_properties
from cxbridge_explore.properties.reading import PROPERTIES_FILE, combine_properties, read_properties
from cxbridge_explore.worldmodel.names import check_world_of_agents
from cxbridge_explore.worldmodel.reading import find_world, read_world
from cxbridge_studio.check.agent import Agent, find_agent_names
from cxbridge_studio.check.findings import Code, Finding, Severity, make_error_finding

WORLD_CODE: Final = Code(
    "CX121",
    Severity.ERROR,
    "the world is invalid",
    "The world.yaml beside the scenario cannot be read, or names a skill, an interface, a field or an agent "
    "that the scenario does not have. Neither cxbridge explore nor cxbridge sweep plays the scenario.",
)
PROPERTIES_CODE: Final = Code(
    "CX122",
    Severity.ERROR,
    "a property is invalid",
    "The properties.yaml beside the scenario cannot be read, or a property in it has an unknown form "
    "or the name of another property. cxbridge explore does not play the scenario.",
)

CODES: Final = (WORLD_CODE, PROPERTIES_CODE)


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the first error of the world and the first error of the properties."""
    folder = agent.context.paths.config_file.parent
    if (world_file := find_world(folder)) is not None:
        # the world may name any agent of the scenario, not only the checked agent; a single agent has no name
        agent_names = [name for name in find_agent_names(replace(agent.options, agent=None)) if name]
        try:
            check_world_of_agents(
                read_world(world_file), [agent.context], agent_names, reads_source_code=True
            )
        except CxbridgeError as error:
            yield make_error_finding(error, WORLD_CODE)
    if (properties_file := folder / PROPERTIES_FILE).is_file():
        try:
            combine_properties(read_properties(properties_file), builtin_properties())
        except CxbridgeError as error:
            finding = make_error_finding(error, PROPERTIES_CODE)
            if not finding.place.file:  # the error about two properties with one name has no place
                finding = replace(finding, place=replace(finding.place, file=str(properties_file)))
            yield finding
