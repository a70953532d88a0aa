"""Counterexamples: the shortest run that violates a property, as a recording, a test and a sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cxbridge.errors import CxbridgeError
from cxbridge.file_access import write_file
from cxbridge.run.options import RunOptions
from cxbridge_explore.counterexample_playing import (
    NthChoice,
    NthChooser,
    PlayedRun,
    play_run,
    unusual_choices,
)
from cxbridge_explore.counterexample_pytest import make_identifier, make_test_text
from cxbridge_explore.counterexample_shrinking import shrink
from cxbridge_explore.properties.monitor import Property, Violation
from cxbridge_explore.worldmodel.model import WorldModel
from cxbridge_explore.worlds.points import USUAL, Choice, ChoicePath, PathChooser
from cxbridge_explore.worlds.run import MakeAssembly, make_scenario


@dataclass(frozen=True, slots=True)
class Counterexample:
    """A shortest run that violates a property.

    :param property: the name of the violated property.
    :param message: the violation, in a sentence.
    :param choices: the unusual choices of the run.
    :param test: the file of a test that fails like the run; None if a test cannot script the choices.
    :param description: the choices and the violation, in a sentence.
    """

    property: str
    message: str
    choices: tuple[Choice, ...]
    recording: Path
    test: Path | None
    description: str

    def as_dict(self) -> dict[str, Any]:
        """Return the counterexample as JSON values."""
        return {
            "property": self.property,
            "message": self.message,
            "choices": [choice.as_dict() for choice in self.choices],
            "recording": str(self.recording),
            "test": None if self.test is None else str(self.test),
            "words": self.description,
        }


def describe_run(unusual: Sequence[Choice], violation: Violation) -> str:
    """Describe the unusual choices of a run and the violation in a sentence."""
    events = ", and ".join(
        f"{choice.point.subject} {choice.taken_option.name} at {choice.point.seconds:.2f} s"
        for choice in unusual
    )
    return f"{events or 'without any fault'}: {violation.message} (at {violation.seconds:.2f} s)"


def write_counterexample(
    options: RunOptions,
    properties: Sequence[Property],
    name: str,
    path: ChoicePath,
    folder: Path,
    world: WorldModel | None = None,
    make_assembly: MakeAssembly = make_scenario,
) -> Counterexample:
    """Shorten a path that violates a property, and write its recording and test into a folder.

    :param properties: the watched properties.
    :param name: the violated property.
    :param path: a path that violates the property.
    :param make_assembly: makes the program to run; only scenarios get a test.
    :raises CxbridgeError: if the path does not violate the property, or a file cannot be written.
    """
    watched = [property_ for property_ in properties if property_.name == name]

    def play_choices(choices: Sequence[NthChoice]) -> PlayedRun:
        return play_run(
            options,
            watched,
            NthChooser(choices),
            world=world,
            make_assembly=make_assembly,
            stops_at_violation=True,
        )

    first_run = play_run(
        options, watched, PathChooser(path), world=world, make_assembly=make_assembly, stops_at_violation=True
    )
    shortest_run = (
        shrink(unusual_choices(first_run.choices), name, play_choices)
        if first_run.find_violation(name)
        else None
    )
    violation = None if shortest_run is None else shortest_run.find_violation(name)
    if shortest_run is None or violation is None:
        raise CxbridgeError(
            f"'{name}' is not violated on this path", hint="the agent may have changed since the exploration"
        )
    unusual = tuple(choice for choice in shortest_run.choices if choice.option_index != USUAL)
    description = describe_run(unusual, violation)
    stem = make_identifier(name)
    recording = folder / f"{stem}.mcap"
    chooser = NthChooser(unusual_choices(shortest_run.choices))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CxbridgeError(f"cannot be written: {error.strerror}", file=folder) from error
    play_run(
        options,
        watched,
        chooser,
        recording,
        world=world,
        make_assembly=make_assembly,
        stops_at_violation=True,
    )
    file, test = folder / f"test_{stem}.py", None
    if make_assembly is make_scenario:  # the fixture `cx` of a test runs only scenarios
        test = _write_test(options, shortest_run, watched[0], description, file)
    return Counterexample(name, violation.message, unusual, recording, test, description)


def _write_test(
    options: RunOptions, played: PlayedRun, violated: Property, description: str, file: Path
) -> Path | None:
    """Write the test and return its file; None if a test cannot script the run."""
    try:
        text = make_test_text(options, played, violated, description, file.parent)
    except CxbridgeError:
        return None
    write_file(file, text)
    return file
