"""Mistakes of users, which give an error or a warning with file and line before the run."""

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
    """Copy the checkout with changeable parameter files."""
    return copy_checkout(tmp_path / "checkout")


def copy_checkout(folder: Path) -> Path:
    parameters = folder / "cx_bringup" / "params"
    assert ROS2CX_DIR is not None
    shutil.copytree(ROS2CX_DIR / "cx_bringup" / "params", parameters)
    for package in ("cx_clips", "cx_clips_executive"):
        (folder / package).symlink_to(ROS2CX_DIR / package)
    return folder


def replace_text(checkout: Path, old: str, new: str, file: str = EXECUTIVE, after: str = "") -> int:
    """Replace the first occurrence after a text, and return the line of the occurrence."""
    path = checkout / "cx_bringup" / "params" / file
    text = path.read_text()
    index = text.index(old, text.index(after))
    path.write_text(text[:index] + new + text[index + len(old) :])
    return text[:index].count("\n") + 1


def find_errors(checkout: Path, spec: str = "test-nav2", **options: Any) -> str:
    """Return the error or the warnings before the first rule."""
    try:
        with Run(options_from_keywords(None, ros2cx=checkout, spec=spec, **options)) as agent:
            return "\n".join([*agent.warnings, *map(str, agent.missing_files)])
    except CxbridgeError as error:
        return str(error)


@pytest.mark.parametrize("text", ["spec: [", "spec: {a", "\tspec: x", "a: 'b"])
def test_invalid_yaml_is_reported_with_line(checkout, text):
    replace_text(checkout, "spec: test-nav2", text)
    assert re.search(rf"{EXECUTIVE}:\d+.*: this is not valid YAML", find_errors(checkout))


def test_unknown_spec_is_reported_with_choices(checkout):
    errors = find_errors(checkout, "nope")
    assert re.search(rf"{EXECUTIVE}:\d+: the configuration has no spec 'nope'", errors)
    assert "test, test-nav2, test-pddl, test-skill" in errors


@pytest.mark.parametrize("name", ["navgraph", "plansys"])
def test_unavailable_feature_is_reported_with_line(checkout, name):
    """Rules of the original ignore the missing feature, so the run timed out."""
    line = replace_text(checkout, "- name: plansys2", f"- name: {name}", after="test-nav2:\n")
    errors = find_errors(checkout)
    assert f"{EXECUTIVE}:{line}" in errors
    assert f"stage-1 asks for the feature '{name}', which is not available" in errors


def test_repeated_feature_is_reported_with_line(checkout):
    replace_text(checkout, '["plansys2"', '["plansys2", "plansys2"', FEATURES)
    assert re.search(rf"{FEATURES}:4.*'plansys2' is listed twice", find_errors(checkout))


def test_missing_clips_file_is_reported_with_line(checkout):
    line = replace_text(checkout, "file: pddl.clp", "file: nope.clp", after="test-nav2:\n")
    errors = find_errors(checkout)
    assert f"{EXECUTIVE}:{line}: stage-3 loads nope.clp, which no folder has" in errors


@pytest.mark.parametrize("missing", [EXECUTIVE, FEATURES])
def test_missing_parameter_file_is_reported(checkout, missing):
    (checkout / "cx_bringup" / "params" / missing).unlink()
    assert missing in find_errors(checkout)


@pytest.mark.parametrize("package", ["cx_clips", "cx_clips_executive"])
def test_missing_package_is_reported(checkout, package):
    (checkout / package).unlink()
    assert re.search(
        rf"lacks the CLIPS files or parameters of {package}$", find_errors(checkout), re.MULTILINE
    )


@pytest.mark.parametrize(
    ("options", "message"),
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
def test_contradicting_options_are_refused(options, message):
    with pytest.raises(CxbridgeError, match=re.escape(message)):
        run_scenario(
            options_from_keywords(**{"scenario": None, "ros2cx": ROS2CX_DIR, "spec": "test-nav2"} | options)
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
def test_invalid_executor_is_refused(tmp_path, target, message):
    file = tmp_path / "executors.py"
    file.write_text(EXECUTORS)
    with pytest.raises(CxbridgeError, match=message):
        run_scenario(
            options_from_keywords(
                None, ros2cx=ROS2CX_DIR, spec="test-nav2", executors=(target.format(file=file),), timeout=5
            )
        )


def test_executor_without_steps_fails_action_immediately(tmp_path):
    """Such an executor stayed busy, and its master waited for the heartbeat timeout."""
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
def test_unknown_key_is_reported_with_hint(checkout, old, new, after):
    assert find_errors(checkout) == ""
    replace_text(checkout, f"{old}:", f"{new}:", after=after)
    assert re.search(rf"{EXECUTIVE}:\d+: '{new}' is never read; did you mean {old}", find_errors(checkout))
