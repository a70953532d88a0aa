"""Checks the configuration: misleading values, missing time facts, keys that are misspelt or never read."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from cxbridge.config import ConfigType, ConfigValue
from cxbridge.run.paths import SCENARIO_FILE
from cxbridge.run.source import CLIPS_SUFFIX, source_of
from cxbridge.run.specs import check_spec, find_key_mistakes
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.check.agent import Agent, place_of
from cxbridge_studio.check.findings import Code, Finding, Severity, SourcePlace, make_error_finding
from cxbridge_studio.check.keys import find_unknown_name, split_path

MISLEADING_VALUE: Final = Code(
    "CX111",
    Severity.WARNING,
    "a misleading configuration value",
    "A key occurs twice in a file, a file has more than two documents, an entry of a stage has a key that is "
    "never read, or a stage waits for a component that is not installed. A run logs the same warning.",
)
NO_TIME_FACTS: Final = Code(
    "CX112",
    Severity.WARNING,
    "no time facts",
    "Without assert-time-each-loop there is no (time ...) fact in the loop: the executive reads no "
    "interface after the first loop, time-outs never pass, and an agent with skills waits forever. "
    "The default is true in a scenario.yaml, and false in Fawkes' own configuration.",
)
DEFAULT_TIME_FACTS: Final = Code(
    "CX113",
    Severity.NOTE,
    "time facts by default",
    "A scenario.yaml without assert-time-each-loop gets a (time ...) fact in each loop. Fawkes needs the "
    "key: add it if the agent must run there, too.",
)
UNKNOWN_KEY: Final = Code(
    "CX114",
    Severity.WARNING,
    "this key is never read",
    "The program reads no key of this name in this place, and no CLIPS file of the agent names the key. "
    "Often the key is misspelt, or a level too high or too low.",
)
WRONG_SPEC_NAME: Final = Code(
    "CX115",
    Severity.ERROR,
    "the name of the spec is not a string",
    "The configuration reads the name as a Boolean or a number, even in quotes. The rule that begins the "
    "initialisation waits for a string: no file is ever loaded.",
)
MISTAKEN_KEY: Final = Code(
    "CX117",
    Severity.ERROR,
    "a key of the executive is misspelt or empty",
    "A key that the executive needs is absent, and a key with a similar name is present; or a name, a file "
    "or a mapping is empty. A run does not start; with --lenient it starts without the key.",
)

CODES: Final = (
    MISLEADING_VALUE,
    NO_TIME_FACTS,
    DEFAULT_TIME_FACTS,
    UNKNOWN_KEY,
    WRONG_SPEC_NAME,
    MISTAKEN_KEY,
)

# A warning of the configuration reader that begins with a position.
_LOCATED_WARNING = re.compile(
    r"(?P<file>[^\n:]+):(?P<line>\d+)(?::(?P<column>\d+))?: (?P<message>.*)", re.DOTALL
)
_QUOTED_NAME: Final = re.compile(r"'([^']+)'")
_TIME_PATH: Final = "/clips-executive/assert-time-each-loop"


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the mistakes in the configuration.

    Without a Fawkes configuration, as for agents of the ROS 2 CX, the time facts, the name of the spec and
    unread keys are not checked.
    """
    reported_places: set[SourcePlace] = set()
    misspelt_keys: set[str] = set()
    is_lenient = source_of(agent.options).is_lenient
    for error in () if is_lenient else find_key_mistakes(agent.config, agent.spec):
        finding = make_error_finding(error, MISTAKEN_KEY)
        reported_places.add(finding.place)
        misspelt_keys.update(_QUOTED_NAME.findall(finding.message))
        yield finding
    for warning in (*map(str, agent.config.warnings), *check_spec(agent.config, agent.spec)):
        place = SourcePlace(str(agent.context.paths.config_file))
        match = _LOCATED_WARNING.match(warning)
        if match:
            place = SourcePlace(match["file"], int(match["line"]), int(match["column"] or 0))
        # A warning at the position of an earlier finding is a consequence of the same mistake.
        if not match or place not in reported_places:
            yield Finding(MISLEADING_VALUE, place, match["message"] if match else warning)
        reported_places.add(place)
    if agent.context.source.has_fawkes_configuration:
        yield from _check_time(agent)
        yield from _check_spec_name(agent)
        yield from _check_keys(agent, reported_places, misspelt_keys)


def _check_time(agent: Agent) -> Iterator[Finding]:
    """Yield a finding if a run has no time facts, or has them only by default."""
    config = agent.config
    value = config.get(_TIME_PATH) if config.exists(_TIME_PATH) else None
    config_file = SourcePlace(str(agent.context.paths.config_file))
    place = place_of(value) if value is not None and value.file else config_file
    if not config.get_bool(_TIME_PATH, default=False):
        state = "absent" if value is None else "false"
        yield Finding(
            NO_TIME_FACTS,
            place,
            f"assert-time-each-loop is {state}: nothing is read, no time passes",
            "set assert-time-each-loop: true below clips-executive",
        )
    # A value without a line is the default of scenarios. A CLIPS program is no scenario, and gets no note.
    elif not place.line and not place.file.endswith(CLIPS_SUFFIX):
        yield Finding(
            DEFAULT_TIME_FACTS,
            place,
            "assert-time-each-loop is absent: the default is true in a scenario, but false in Fawkes",
        )


def _check_spec_name(agent: Agent) -> Iterator[Finding]:
    key = "/clips-executive/spec"
    if agent.config.exists(key) and (value := agent.config.get(key)).type is not ConfigType.STRING:
        type_text = {ConfigType.BOOL: "a Boolean", ConfigType.FLOAT: "a number"}.get(value.type, "an integer")
        yield Finding(
            WRONG_SPEC_NAME,
            place_of(value),
            f"the name of the spec, '{value.text}', must be a string, not {type_text}",
            "choose another name, such as my-spec",
        )


# ---- keys


def _check_keys(
    agent: Agent, reported_places: set[SourcePlace], misspelt_keys: set[str]
) -> Iterator[Finding]:
    """Yield the keys that are never read, except on lines with another finding.

    :param misspelt_keys: the keys that have another finding.
    """
    reported_keys: set[str] = set()
    is_scenario_file = agent.context.paths.config_file.name == SCENARIO_FILE
    reported_lines = {(place.file, place.line) for place in reported_places}
    for value in agent.config.walk("/"):
        path = split_path(value.path)
        unknown_name = find_unknown_name(path)
        if unknown_name is None or not value.file or (value.file, value.line) in reported_lines:
            continue
        index, known_names = unknown_name
        name, parents = path[index], path[:index]
        key = "/".join((*parents, name))
        if name in misspelt_keys or key in reported_keys or _is_read(agent, value, index):
            continue
        hint = did_you_mean(name, known_names)
        # A scenario belongs to cxbridge, so any unknown key counts, except for top-level sections without a
        # similar name, which may belong to other programs. A Fawkes configuration has the keys of many
        # programs, so only likely misspellings in the sections of the executive count.
        if (hint and _is_executive_path(agent, parents)) or (is_scenario_file and (hint or parents)):
            reported_keys.add(key)
            yield Finding(
                UNKNOWN_KEY,
                place_of(value),
                f"'{name}' is never read" + (f" below {'/'.join(parents)}" if parents else ""),
                hint or f"known: {', '.join(sorted(known_names))}",
            )


def _is_executive_path(agent: Agent, parents: tuple[str, ...]) -> bool:
    """Return whether a path belongs to the executive, and not to a spec other than the chosen spec.

    A Fawkes folder also has the sections of other programs, and outdated specs.
    """
    return parents[:1] == ("clips-executive",) and (
        parents[1:2] != ("specs",) or parents[2:3] == (agent.spec,)
    )


def _is_read(agent: Agent, value: ConfigValue, unknown_index: int) -> bool:
    """Return whether a CLIPS file of the agent names the path of a value, or the path of one of its parents.

    :param unknown_index: the index of the first unknown name in the path: parents above it do not count.
    """
    path = split_path(value.path)
    prefixes = ("/" + "/".join(path[:end]) for end in range(len(path), unknown_index, -1))
    return any(f'"{prefix}' in file.text for prefix in prefixes for file in agent.own_files)
