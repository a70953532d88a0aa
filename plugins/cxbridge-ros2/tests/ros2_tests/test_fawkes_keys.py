"""Settings of Fawkes' plug-ins for ROS 2, which cxbridge accepts and ignores."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.run.agent import Run
from cxbridge.run.components.table import needed_components
from cxbridge.run.options import RunOptions
from cxbridge_ros2.fawkes_keys import FAWKES_KEYS, has_cxbridge_keys
from cxbridge_ros2.settings import read_node_section
from tests.run.mini import write_scenario
from tests.support import ROBOTINO_DIR

ROBOT_CONFIG = """\
ros2:
  node-name: fawkesnode
  namespace: $HOSTNAME
  clock: {frequency: 100}
  tf:
    use_tf2: true
    use_namespace: false
    tf_prefix: $HOSTNAME
    tf_prefix_exclusions: [map, mps]
    static-update-interval: 1.0
"""
TREES = (
    *FAWKES_KEYS,
    *(f"/ros2/{tree}" for tree in ("node", "performers", "experts", "interfaces", "skiller")),
)


def load_configuration(folder: Path, text: str) -> Configuration:
    (folder / "robot.yaml").write_text(text)
    return Configuration.load(folder / "robot.yaml")


def test_run_with_fawkes_settings_joins_no_domain(tmp_path: Path):
    more = tmp_path / "robot.yaml"
    more.write_text(ROBOT_CONFIG)
    options = RunOptions(scenario=write_scenario(tmp_path / "mini"), config=(more,), skiller="none")
    with Run(options) as run:
        assert not [each.name for each in needed_components(run) if each.name.startswith("ros2")]
        run.start()


@pytest.mark.parametrize("tree", FAWKES_KEYS)
def test_misspelt_setting_is_reported_with_line(tree: str, tmp_path: Path):
    config = load_configuration(
        tmp_path, f"{ROBOT_CONFIG}---\nros2: {{{tree.removeprefix('/ros2/')}: {{domian: 7}}}}\n"
    )
    with pytest.raises(ConfigError, match="has no setting 'domian'") as caught:
        read_node_section(config, tree, (), tmp_path, "settings")
    assert caught.value.line == len(ROBOT_CONFIG.splitlines()) + 2


@pytest.mark.skipif(ROBOTINO_DIR is None, reason="ROBOTINO_DIR does not name a checkout")
def test_robot_files_have_no_settings_of_cxbridge():
    assert ROBOTINO_DIR is not None
    files = [each for each in ROBOTINO_DIR.glob("cfg/**/*.yaml") if "\nros2:" in each.read_text()]
    assert files
    assert not [
        (path, tree) for path in files for tree in TREES if has_cxbridge_keys(Configuration.load(path), tree)
    ]
