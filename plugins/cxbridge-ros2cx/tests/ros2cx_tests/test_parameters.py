"""Parameter files of ROS 2 nodes, with their values and facts."""

from __future__ import annotations

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError, CxbridgeError
from cxbridge.events import EventBus
from cxbridge.executive.host.values import Symbol
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.interfaces import InterfaceRegistry
from cxbridge_ros2cx.checkout import Ros2CxCheckout
from cxbridge_ros2cx.confvals import ConfvalFeature, find_scalar_type
from cxbridge_ros2cx.features import make_features
from cxbridge_ros2cx.parameters import (
    FeatureEntry,
    load_executive_parameters,
    load_feature_entries,
    read_refresh_period_us,
)
from cxbridge_ros2cx.settings import Ros2CxSettings

PARAMETERS = """
clips_executive:
  ros__parameters:
    spec: courier
    refresh-rate: 2
    debug: {enable: yes, level: 3}
    hex: 0x10
    ratio: 1.5
    minus: -4
    clips-dirs: ["@CONFDIR@/params", 7]
    nothing: []
    specs:
      courier:
        init:
          stage-3:
            - name: b
              files: [x.clp, y.clp]
            - name: a
              count: 2
              feature-request: false
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "clips_executive.yaml").write_text(PARAMETERS)
    return tmp_path


@pytest.fixture
def bus():
    return EventBus(VirtualClock())


@pytest.fixture
def load_facts(folder, bus):
    """Return a function that loads the parameters, and returns path, type and value of each fact."""
    feature = ConfvalFeature(load_executive_parameters(folder))
    manager = EnvironmentManager(bus, [feature])
    env = manager.create("executive")
    env.build(
        "(deftemplate confval (slot path) (slot type) (slot value) (slot is-list) (multislot list-value))"
    )
    env.define("config-load", lambda prefix: feature._load(env, prefix), 1, types="*;sy")

    def load(prefix="/clips_executive"):
        env.call("config-load", prefix)
        return [
            (str(slots["path"]), str(slots["type"]), slots["list-value"] or slots["value"])
            for _, _, slots in env.facts("confval")
        ]

    yield load
    manager.close()


def test_facts_have_order_of_file_and_original_types(load_facts):
    rows = load_facts()
    assert rows == [
        ("/clips_executive/spec", "STRING", "courier"),
        ("/clips_executive/refresh-rate", "INT", 2),
        ("/clips_executive/debug/enable", "BOOL", "TRUE"),
        ("/clips_executive/debug/level", "INT", 3),
        ("/clips_executive/hex", "INT", "0x10"),
        ("/clips_executive/ratio", "FLOAT", 1.5),
        ("/clips_executive/minus", "INT", -4),
        ("/clips_executive/clips-dirs", "STRING", ("@CONFDIR@/params", "7")),
        ("/clips_executive/specs/courier/init/stage-3/0/name", "STRING", "b"),
        ("/clips_executive/specs/courier/init/stage-3/0/files", "STRING", ("x.clp", "y.clp")),
        ("/clips_executive/specs/courier/init/stage-3/1/name", "STRING", "a"),
        ("/clips_executive/specs/courier/init/stage-3/1/count", "INT", "2"),
        ("/clips_executive/specs/courier/init/stage-3/1/feature-request", "BOOL", "FALSE"),
    ]
    # the original makes a string of the last value, which its init.clp treats as neither TRUE nor FALSE
    assert all(isinstance(value, Symbol) for _, kind, value in rows if kind == "BOOL")


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("on", "BOOL"),
        ("N", "BOOL"),
        ("12", "INT"),
        ("+3", "INT"),
        ("1e3", "FLOAT"),
        (".5", "FLOAT"),
        ("1 2", "STRING"),
    ],
)
def test_types_of_scalars(text, kind):
    assert find_scalar_type(text) == kind


@pytest.mark.parametrize("rate", ["0", "-1", "1e9"])
def test_invalid_refresh_rate_is_refused(folder, rate):
    (folder / "clips_executive.yaml").write_text(
        PARAMETERS.replace("refresh-rate: 2", f"refresh-rate: {rate}")
    )
    with pytest.raises(ConfigError, match="refresh-rate cannot be") as caught:
        read_refresh_period_us(load_executive_parameters(folder))
    assert caught.value.line == 5


def test_file_without_node_is_refused(folder):
    (folder / "clips_executive.yaml").write_text("other: {ros__parameters: {a: 1}}")
    with pytest.raises(ConfigError, match="no parameters of the node clips_executive"):
        load_executive_parameters(folder)


def test_feature_without_plugin_is_refused(tmp_path):
    (tmp_path / "cx_params.yaml").write_text(
        "clips_features_manager:\n  ros__parameters:\n    clips_features: [planning]\n"
    )
    with pytest.raises(ConfigError, match="the feature 'planning' has no plugin") as caught:
        load_feature_entries(tmp_path)
    assert caught.value.line == 3


def test_unknown_plugin_is_refused_with_choices():
    entries = [FeatureEntry("teleport", "cx::Teleport", "cx_params.yaml", 7)]
    board = LocalBlackBoard(InterfaceRegistry(), VirtualClock())
    with pytest.raises(ConfigError, match="no plugin 'cx::Teleport'") as caught:
        make_features(entries, Configuration(), board, lambda: None)
    assert (str(caught.value.file), caught.value.line) == ("cx_params.yaml", 7)
    assert "cx::Plansys2Feature" in str(caught.value.hint)


def test_incomplete_checkout_names_missing_packages(tmp_path):
    (tmp_path / "cx_bringup" / "params").mkdir(parents=True)
    with pytest.raises(CxbridgeError, match="parameters of cx_clips, cx_clips_executive\n"):
        Ros2CxCheckout.open(tmp_path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("ros2cx: {mode: exact}", "ros2cx/mode cannot be 'exact'"),
        ("ros2cx: {moode: sane}", "there is no ros2cx/moode"),
        ("ros2cx: {removal-blocks: [1.0]}", "removal-blocks requires mode: original"),
    ],
)
def test_invalid_settings_are_refused(text, message):
    with pytest.raises(ConfigError, match=message) as caught:
        Ros2CxSettings.from_config(Configuration.from_text(text))
    assert caught.value.line == 1


def test_settings_are_parsed():
    assert Ros2CxSettings.from_config(Configuration()) == Ros2CxSettings()
    config = Configuration.from_text("ros2cx: {mode: original, removal-blocks: [0.5, 1]}")
    assert Ros2CxSettings.from_config(config) == Ros2CxSettings(
        repeats_defects=True, removal_block_times_s=(0.5, 1.0)
    )
