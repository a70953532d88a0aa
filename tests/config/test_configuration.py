"""Typed values by path, their errors, and the search below the executive's config-load."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.config import ConfigType, Configuration
from cxbridge.errors import ConfigError
from tests.support import SHARED, needs_shared

TEXT = """\
robot:
  name: caesar
  speed: 0.5
  wheels: 4
  offset: -3
  mask: 0x1F
  enabled: yes
  nothing:
  quoted: "17"
  names: [a, "b c"]
  ports: [1, 2]
  offsets: [-1, 0x2]
  factors: [1, .5]
  flags: [on, off]
  none: []
  arms:
  - joint: 1
  - joint: 2
"""


@pytest.fixture
def config() -> Configuration:
    return Configuration.from_text(TEXT, "robot.yaml")


def test_typed_values(config: Configuration) -> None:
    assert config.get_str("/robot/name") == "caesar"
    assert config.get_str("robot//mask/") == "0x1F"
    assert config.get_str("/robot/nothing") == ""
    assert config.get_uint("/robot/mask") == 31
    assert config.get_uint("/robot/quoted") == 17
    assert config.get_int("/robot/offset") == -3
    assert config.get_float("/robot/speed") == 0.5
    assert config.get_float("/robot/wheels") == 4.0
    assert config.get_bool("/robot/enabled") is True
    assert config.get_strings("/robot/names") == ["a", "b c"]
    assert config.get_uints("/robot/ports") == [1, 2]
    assert config.get_floats("/robot/factors") == [1.0, 0.5]
    assert config.exists("/robot/nothing")
    assert not config.exists("/robot/arms")
    assert (config.keys("/robot/arms"), config.keys(), config.keys("/gone")) == (["0", "1"], ["robot"], [])
    assert config.get_strings("/robot/none") == []


def test_defaults_replace_missing_values_only(config: Configuration) -> None:
    assert config.get_uint("/robot/gone", default=7) == 7
    assert config.get_str("/robot/gone", default=None) is None
    assert config.get_strings("/gone", default=["x"]) == ["x"]
    assert config.get_uint("/robot/wheels", default=7) == 4
    with pytest.raises(ConfigError):
        config.get_uint("/robot/name", default=7)


@pytest.mark.parametrize(
    ("getter", "path", "line", "message"),
    [
        ("get_uint", "/robot/name", 2, "/robot/name must be an unsigned integer, but is 'caesar'"),
        ("get_int", "/robot/speed", 3, "/robot/speed must be an integer, but is '0.5'"),
        ("get_uint", "/robot/nothing", 8, "/robot/nothing must be an unsigned integer, but is empty"),
        ("get_bool", "/robot/wheels", 4, "/robot/wheels must be true or false, but is '4'"),
        ("get_str", "/robot/names", 10, "/robot/names must be a single value, but is a list"),
        ("get_strings", "/robot/name", 2, "/robot/name must be a list, but is 'caesar'"),
        ("get_uints", "/robot/names", 10, "element 0 is 'a'"),
    ],
)
def test_error_of_wrong_type_has_place(
    config: Configuration, getter: str, path: str, line: int, message: str
) -> None:
    with pytest.raises(ConfigError) as caught:
        getattr(config, getter)(path)
    assert (caught.value.file, caught.value.line) == ("robot.yaml", line)
    assert message in caught.value.message


def test_missing_value_suggests_paths(config: Configuration) -> None:
    with pytest.raises(ConfigError) as caught:
        config.get_str("robot/nmae")
    assert caught.value.message == "there is no configuration value /robot/nmae"
    assert "/robot/name" in str(caught.value.hint)
    with pytest.raises(ConfigError) as caught:
        config.get("/robot/arms")
    assert "a list of maps" in caught.value.message
    with pytest.raises(ConfigError):
        config.get("/robot/name/deeper")


# ---- search


def test_search_has_lexicographic_order_and_given_prefix() -> None:
    config = Configuration.from_text("b: {z: 1, a-b: 2, a: {c: 3}}\na: 1\n")
    assert [value.path for value in config.search("/b/")] == ["/b/a-b", "/b/a/c", "/b/z"]
    assert [value.path for value in config.search("b")] == ["b/a-b", "b/a/c", "b/z"]
    assert [value.path for value in config.search()] == ["/a", "/b/a-b", "/b/a/c", "/b/z"]
    assert [*config.search("/a"), *config.search("/gone")] == []


def test_search_yields_type_raw_text_and_line(config: Configuration) -> None:
    rows = {
        value.path.removeprefix("/robot/"): (
            value.type.name,
            value.is_list,
            value.text,
            value.items,
            value.line,
        )
        for value in config.search("/robot")
    }
    assert rows["quoted"] == ("UINT", False, "17", (), 9)
    assert rows["nothing"] == ("STRING", False, "", (), 8)
    assert rows["names"] == ("STRING", True, "", ("a", "b c"), 10)
    assert rows["flags"] == ("BOOL", True, "", ("on", "off"), 14)
    assert rows["none"] == ("UINT", True, "", (), 15)
    assert rows["arms/1/joint"] == ("UINT", False, "2", (), 18)


# ---- changing


def test_set_changes_and_adds_values(config: Configuration) -> None:
    config.set("/robot/name", 5)
    config.set("/robot/new/flag", True)
    config.set("/robot/names", ["x", 2, False])
    config.set("/robot/nothing/below", 1.5)
    assert config.get("/robot/name").type is ConfigType.UINT
    assert config.get_bool("/robot/new/flag") is True
    assert config.get_strings("/robot/names") == ["x", "2", "false"]
    assert config.get_float("/robot/nothing/below") == 1.5
    assert (config.get("/robot/name").file, config.get("/robot/name").line) == ("", 0)


@pytest.mark.parametrize("path", ["/robot", "/", "/".join("a" * 101), "/robot/name/below", "/robot/names/0"])
def test_set_refuses_maps(config: Configuration, path: str) -> None:
    before = list(config.search())
    with pytest.raises(ConfigError):
        config.set(path, 1)
    assert list(config.search()) == before


# ---- real files


@needs_shared
def test_files_of_fawkes_load() -> None:
    files = sorted((SHARED / "fawkes-data" / "config").glob("*.yaml"))
    assert files
    for file in files:
        if file.name != "config.yaml":  # includes a missing folder
            Configuration.load(file)
    config = Configuration.load(SHARED / "fawkes-data" / "config" / "clips-executive.yaml")
    spec = "/clips-executive/specs/test"
    assert config.keys(f"{spec}/init/stage-3") == [str(n) for n in range(8)]
    assert config.get_str(f"{spec}/init/stage-3/0/file") == "test-scenario/test-domain.clp"
    assert config.get_str(f"{spec}/action-mapping/say-hello") == 'say{text="Hello ?(name)y", wait=true}'
    assert config.get(f"{spec}/parameters/coordination/mutex/max-age-sec").type is ConfigType.UINT


def test_missing_value_names_file_of_another_host(tmp_path: Path) -> None:
    (tmp_path / "config.yaml").write_text("include: [!ignore-missing host_$host.d/]\n---\narm: {y: 1}\n")
    for host, text in (("one", "arm/x: 1"), ("here", "arm/z: 3")):
        (tmp_path / f"host_{host}.d").mkdir()
        (tmp_path / f"host_{host}.d" / "arm.yaml").write_text(text)
    config = Configuration.load(tmp_path, host="here")
    file = tmp_path / "host_one.d" / "arm.yaml"
    with pytest.raises(ConfigError) as caught:
        config.get("arm/x")
    assert caught.value.hint == f"{file} defines the value for another host: --config {file}"
