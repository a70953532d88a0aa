"""A command without a needed package names the package and the command that installs it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.forked import nursery
from tests.run.mini import write_scenario
from tests.support import share

ROS2 = "cxbridge: {fawkes: {enable: false}, zmq: {endpoints: []}}\nros2: {tf: {frames: all}}\n"


CASES = (
    ("rosbags", "ros2", ["trace", "info", "bag"]),
    ("rosbags", "ros2", ["trace", "convert", "run.mcap", "copy", "--to", "rosbag"]),
    ("cyclonedds", "ros2", ["run", "mini", "--clock", "ros2"]),
    ("cyclonedds", "ros2", ["run", "mini", "--config", "ros2.yaml"]),
    ("rosbags", "ros2", ["daemon", "start", "ros2.yaml"]),
    ("textual", "studio", ["monitor", "run.mcap"]),
    ("pygls", "studio", ["lsp", "mini"]),
)


@pytest.mark.parametrize(
    ("module", "plugin", "words"),
    share(CASES, 4, row=lambda case: case[0]),
    ids=lambda value: value if isinstance(value, str) else " ".join(value),
)
def test_missing_package_is_one_error(tmp_path: Path, module: str, plugin: str, words: list[str]):
    pytest.importorskip(f"cxbridge_{plugin}", reason=f"needs cxbridge-{plugin}")
    missing = tmp_path / "packages" / module
    missing.mkdir(parents=True)
    (missing / "__init__.py").write_text(f"raise ModuleNotFoundError('No module', name='{module}')\n")
    write_scenario(tmp_path / "mini")
    (tmp_path / "ros2.yaml").write_text(ROS2)
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag/metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    run = [sys.executable, "-m", "cxbridge"]
    environment = {**os.environ, "PYTHONPATH": str(missing.parent)}
    if "run.mcap" in words:
        nursery().run(["run", "mini", "--trace", "run.mcap"], folder=tmp_path).check_returncode()
    done = subprocess.run(
        [*run, *words], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 2, done.stderr
    assert f"the package '{module}' is not installed" in done.stderr
    assert f"cxbridge-{plugin}" in done.stderr
    assert "Traceback" not in done.stderr
