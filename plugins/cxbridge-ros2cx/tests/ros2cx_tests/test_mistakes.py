"""Mistakes of users: one clear error or warning each, with file and line, before anything runs."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.run import run_scenario
from cxbridge.run.agent import Run
from cxbridge.run.program.plain_options import options_from_keywords
from tests.support import ROS2CX_DIR, needs_ros2cx

pytestmark = needs_ros2cx

EXECUTIVE, FEATURES = "clips_executive.yaml", "cx_params.yaml"


@pytest.fixture
def checkout(tmp_path):
    """A copy of the checkout with parameter files to be changed."""
    return copy_of(tmp_path / "checkout")


def copy_of(folder: Path) -> Path:
    parameters = folder / "cx_bringup" / "params"
    assert ROS2CX_DIR is not None
    shutil.copytree(ROS2CX_DIR / "cx_bringup" / "params", parameters)
    for package in ("cx_clips", "cx_clips_executive"):
        (folder / package).symlink_to(ROS2CX_DIR / package)
    return folder


def change(checkout: Path, old: str, new: str, file: str = EXECUTIVE, after: str = "") -> int:
    """Replace the first occurrence after a text; return the line where it was."""
    path = checkout / "cx_bringup" / "params" / file
    text = path.read_text()
    place = text.index(old, text.index(after))
    path.write_text(text[:place] + new + text[place + len(old) :])
    return text[:place].count("\n") + 1


def complaint(checkout: Path, spec: str = "test-nav2", **more: Any) -> str:
    """The output before a rule fires: the error, or the warnings."""
    try:
        with Run(options_from_keywords(None, ros2cx=checkout, spec=spec, **more)) as agent:
            return "\n".join([*agent.warnings, *map(str, agent.missing_files)])
    except CxbridgeError as error:
        return str(error)


@pytest.mark.parametrize("text", ["spec: [", "spec: {a", "\tspec: x", "a: 'b"])
def test_broken_yaml(checkout, text):
    change(checkout, "spec: test-nav2", text)
    assert re.search(rf"{EXECUTIVE}:\d+.*: this is not valid YAML", complaint(checkout))


def test_a_spec_that_does_not_exist(checkout):
    said = complaint(checkout, "nope")
    assert re.search(rf"{EXECUTIVE}:\d+: the configuration has no spec 'nope'", said)
    assert "test, test-nav2, test-pddl, test-skill" in said


@pytest.mark.parametrize("name", ["navgraph", "plansys"])
def test_a_feature_that_cannot_be_had(checkout, name):
    """The original's own rules trip over this: the run continued and timed out."""
    line = change(checkout, "- name: plansys2", f"- name: {name}", after="test-nav2:\n")
    said = complaint(checkout)
    assert f"{EXECUTIVE}:{line}" in said
    assert f"stage-1 asks for the feature '{name}', which is not available" in said


def test_a_feature_that_is_named_twice(checkout):
    change(checkout, '["plansys2"', '["plansys2", "plansys2"', FEATURES)
    assert re.search(rf"{FEATURES}:4.*'plansys2' is listed twice", complaint(checkout))


def test_a_file_that_no_folder_has(checkout):
    line = change(checkout, "file: pddl.clp", "file: nope.clp", after="test-nav2:\n")
    said = complaint(checkout)
    assert f"{EXECUTIVE}:{line}: stage-3 loads nope.clp, which no folder has" in said


@pytest.mark.parametrize("missing", [EXECUTIVE, FEATURES])
def test_a_parameter_file_that_is_missing(checkout, missing):
    (checkout / "cx_bringup" / "params" / missing).unlink()
    assert missing in complaint(checkout)


@pytest.mark.parametrize("package", ["cx_clips", "cx_clips_executive"])
def test_a_package_that_is_missing(checkout, package):
    (checkout / package).unlink()
    assert re.search(rf"lacks the CLIPS files or parameters of {package}$", complaint(checkout), re.MULTILINE)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"fawkes_dir": Path()}, "--ros2cx cannot be combined with a scenario or --fawkes-dir"),
        ({"scenario": Path()}, "--ros2cx cannot be combined with a scenario or --fawkes-dir"),
        (
            {"overlays": (Path(),)},
            "--overlay requires Fawkes' layout, so it cannot be combined with --ros2cx",
        ),
        ({"core": "builtin"}, "--core cannot be combined with --ros2cx"),
        ({"skiller": "simulator"}, "--skiller simulator cannot be combined with --ros2cx"),
        ({"skiller": "tcp://127.0.0.1:1", "clock": "real"}, "cannot be combined with --ros2cx"),
        ({"agent": "robot1"}, "the scenario has no agent 'robot1'"),
        ({"ros2cx": Path("/nowhere")}, "there is no such folder"),
        (
            {"ros2cx": ROS2CX_DIR and ROS2CX_DIR / "cx_bringup"},
            "this is not a checkout of ros2-clips-executive",
        ),
    ],
)
def test_options_that_contradict_one_another(more, message):
    with pytest.raises(CxbridgeError, match=re.escape(message)):
        run_scenario(
            options_from_keywords(**{"scenario": None, "ros2cx": ROS2CX_DIR, "spec": "test-nav2"} | more)
        )


EXECUTORS = """
from cxbridge.skiller.board import SkillExecutor
class Idle(SkillExecutor): pass
class Returns(SkillExecutor):
    def execute(self, call): return 1
class Other: pass
class Closed(SkillExecutor):
    def __init__(self): pass
    def execute(self, call): yield
class Broken(SkillExecutor):
    def start(self): raise RuntimeError("no motor")
    def execute(self, call): yield
"""


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("move", "--executor cannot be 'move'"),
        ("move={file}", "is not the name of an executor class"),
        ("move={file}:Nope", "has no executor 'Nope'"),
        ("move={file}:Idle", r"Idle has no execute\(\)"),
        ("move={file}:Broken", "Broken does not start: RuntimeError: no motor"),
        ("mo ve={file}:Returns", "a skill's name must not contain blanks"),
    ],
)
def test_an_executor_of_the_wrong_shape(tmp_path, target, message):
    file = tmp_path / "executors.py"
    file.write_text(EXECUTORS)
    with pytest.raises(CxbridgeError, match=message):
        run_scenario(
            options_from_keywords(
                None, ros2cx=ROS2CX_DIR, spec="test-nav2", executors=(target.format(file=file),), timeout=5
            )
        )


def test_an_executor_that_takes_no_steps_fails_its_action_at_once(tmp_path):
    """It was busy for ever: its master waited until there was no sign of life."""
    file = tmp_path / "executors.py"
    file.write_text(EXECUTORS)
    executors = (f"move={file}:Returns",)
    result = run_scenario(
        options_from_keywords(None, ros2cx=ROS2CX_DIR, spec="test-nav2", executors=executors, timeout=60)
    )
    assert result.status == 1
    assert result.run_seconds < 5


@pytest.mark.parametrize(
    ("old", "new", "after"),
    [
        ("refresh-rate", "refresh-rat", "refresh"),
        ("action-mapping", "action-maping", "test-nav2:\n"),
        ("level", "levl", "debug:"),
    ],
)
def test_a_key_that_is_never_read(checkout, old, new, after):
    assert complaint(checkout) == ""
    change(checkout, f"{old}:", f"{new}:", after=after)
    assert re.search(rf"{EXECUTIVE}:\d+: '{new}' is never read; did you mean {old}", complaint(checkout))
