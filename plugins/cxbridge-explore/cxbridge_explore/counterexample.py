"""Counterexamples: the shortest run that violates a property, as a recording, a test and a sentence."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import Any

from cxbridge.errors import CxbridgeError
from cxbridge.file_access import make_parent_folder, write_file
from cxbridge.run.options import RunOptions
from cxbridge_explore.counterexample_playing import (
    NthChoices,
    NthChooser,
    PlayedRun,
    find_unusual_choices,
    play_run,
)
from cxbridge_explore.counterexample_pytest import make_identifier, make_test_text
from cxbridge_explore.properties.monitor import Property, Violation
from cxbridge_explore.worldmodel.model import WorldModel
from cxbridge_explore.worlds.points import USUAL, Choice, ChoicePath, PathChooser
from cxbridge_explore.worlds.run import MakeAssembly, make_scenario


@dataclass(frozen=True, slots=True)
class Counterexample:
    """The shortest run that violates a property: a run with the fewest unusual choices.

    :param message: the violation, in a sentence.
    :param choices: the unusual choices of the run.
    :param test: the file of a test that fails like the run; None if a test cannot script the choices,
        or run the program.
    :param description: the choices and the violation, in a sentence.
    """

    message: str
    choices: tuple[Choice, ...]
    recording: Path
    test: Path | None
    description: str

    def as_dict(self) -> dict[str, Any]:
        """Return the counterexample as JSON values."""
        return {
            "message": self.message,
            "choices": [choice.as_dict() for choice in self.choices],
            "recording": str(self.recording),
            "test": None if self.test is None else str(self.test),
            "words": self.description,
        }


def describe_run(choices: Sequence[Choice], violation: Violation) -> str:
    """Describe the unusual choices of a run and the violation in a sentence."""
    choices_text = ", and ".join(
        f"{choice.point.subject} {choice.taken_option.name} at {choice.point.seconds:.2f} s"
        for choice in choices
    )
    return f"{choices_text or 'without any fault'}: {violation.message} (at {violation.seconds:.2f} s)"


def shrink(choices: NthChoices, play: Callable[[NthChoices], PlayedRun]) -> PlayedRun | None:
    """Return a run that violates the watched property, with the fewest choices.

    The subsets of the choices are tried, the smallest first, up to the size at which a run violates the
    property. Of several such runs, the run with the fewest choices and the earliest violation is returned.

    :param choices: the unusual choices of a run that violates the property.
    :param play: plays a run with some of the choices.
    :returns: None if no run violates the property.
    """
    for size in range(len(choices) + 1):
        runs = (play(dict(subset)) for subset in combinations(choices.items(), size))
        violating_runs = [run for run in runs if run.violations]
        if violating_runs:
            return min(
                violating_runs,
                key=lambda run: (len(find_unusual_choices(run.choices)), run.violations[0].seconds),
            )
    return None


def write_counterexample(
    options: RunOptions,
    properties: Sequence[Property],
    property_name: str,
    path: ChoicePath,
    folder: Path,
    world: WorldModel | None = None,
    make_assembly: MakeAssembly = make_scenario,
) -> Counterexample:
    """Shorten a path that violates a property, and write its recording and test into a folder.

    :param properties: the properties, which include the violated property.
    :param property_name: the name of the violated property.
    :param path: a path that violates the property.
    :param world: the possible events; None for the file in the scenario's folder.
    :param make_assembly: makes the program to run; only scenarios get a test.
    :raises CxbridgeError: if the path does not violate the property, or a file cannot be written.
    """
    (violated_property,) = (property_ for property_ in properties if property_.name == property_name)
    play = partial(play_run, options, (violated_property,), world=world, make_assembly=make_assembly)
    nth_choices = find_unusual_choices(play(PathChooser(path)).choices)
    shortest_run = shrink(nth_choices, lambda subset: play(NthChooser(subset)))
    if shortest_run is None:
        raise CxbridgeError(
            f"'{property_name}' is not violated on this path",
            hint="the agent may have changed since the exploration",
        )
    (violation,) = shortest_run.violations
    choices = tuple(choice for choice in shortest_run.choices if choice.option_index != USUAL)
    description = describe_run(choices, violation)
    stem = make_identifier(property_name)
    recording = folder / f"{stem}.mcap"
    make_parent_folder(recording)
    # played once more, since only one of the many tried runs is worth a recording
    play(NthChooser(find_unusual_choices(shortest_run.choices)), recording)
    test_file = None
    if make_assembly is make_scenario:  # the fixture `cx` of a test runs only scenarios
        test_file = _write_test(
            options, shortest_run, violated_property, description, folder / f"test_{stem}.py"
        )
    return Counterexample(violation.message, choices, recording, test_file, description)


def _write_test(
    options: RunOptions, run: PlayedRun, violated_property: Property, description: str, file: Path
) -> Path | None:
    """Write the test and return its file; None if a test cannot script the run."""
    try:
        text = make_test_text(options, run, violated_property, description, file.parent)
    except CxbridgeError:
        return None
    write_file(file, text)
    return file
