"""Features that other packages bring along; the example of docs/features.md is one."""

from __future__ import annotations

import re
import sys
from importlib.metadata import EntryPoint

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.config import Configuration
from cxbridge.errors import ClipsError
from cxbridge.events import Level
from cxbridge.executive.feature import Feature, FeatureContext
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.executive.plugins import GROUP, find_plugins
from cxbridge.interfaces.registry import InterfaceRegistry
from tests.support import ROOT


def example():
    """The blocks of code of the documentation."""
    text = (ROOT / "docs" / "features.md").read_text()
    python, toml = (re.findall(rf"```{kind}\n(.*?)```", text, re.DOTALL)[0] for kind in ("python", "toml"))
    return python, toml


@pytest.fixture
def context(bus, tmp_path):
    board = LocalBlackBoard(InterfaceRegistry(), bus.clock, bus)
    yield FeatureContext(Configuration.from_text("a: {b: 7}", "test.yaml"), board, bus, {}, tmp_path)
    board.shutdown()


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Installs a package with the example and with what else is given."""
    folder = tmp_path / "site"
    (folder / "hello-1.0.dist-info").mkdir(parents=True)
    (folder / "hello-1.0.dist-info" / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: hello\nVersion: 1.0\n"
    )
    python, toml = example()
    monkeypatch.syspath_prepend(str(folder))

    def install(code="", entries=""):
        (folder / "hello_feature.py").write_text(python + code)
        line = toml.splitlines()[1].replace('"', "")
        (folder / "hello-1.0.dist-info" / "entry_points.txt").write_text(f"[{GROUP}]\n{line}\n{entries}\n")

    yield install
    sys.modules.pop("hello_feature", None)


def managed(bus, context, *features: Feature):
    manager = EnvironmentManager(bus, features)
    for plugin in find_plugins(context):
        manager.add_plugin(plugin)
    return manager, manager.create("executive")


def test_the_example_of_the_documentation(bus, context, installed):
    installed()
    manager, env = managed(bus, context)
    assert {"hello"} <= {str(slots["implied"][0]) for _, _, slots in env.facts("ff-feature")}
    assert env.call("ff-feature-request", "hello") == "TRUE"
    assert env.call("hello", "Alice") == "Hello Alice"
    manager.before_run("executive")
    assert [slots for _, _, slots in env.facts("guest")] == [{"name": "Alice", "mood": "happy"}]
    manager.close()


def test_the_example_has_about_20_lines():
    python, toml = example()
    assert len(python.splitlines()) <= 21
    assert len(toml.splitlines()) == 2


def test_a_package_is_not_imported_before_its_feature_is_asked_for(bus, context, installed):
    installed("raise RuntimeError('broken package')\n")
    manager, env = managed(bus, context)
    assert "hello" in manager.features
    with pytest.raises(ClipsError):
        env.call("ff-feature-request", "hello")
    manager.close()


@pytest.mark.parametrize(
    ("entry", "problem"),
    [
        ("hello_feature:Nothing", "Nothing"),
        ("hello_feature:ClipsEnvironment", "make"),
        ("no_such_module:X", "no_such_module"),
        ("hello_feature:Wrong", "is not a cxbridge.executive.feature.Feature"),
        ("hello_feature:Symbol", "make"),
    ],
)
def test_what_cannot_be_loaded_is_told_with_its_package(bus, log, context, installed, entry, problem):
    installed(
        "class Wrong:\n    @classmethod\n    def make(cls, context):\n        return cls()\n",
        f"bad = {entry}",
    )
    manager, env = managed(bus, context)
    with pytest.raises(ClipsError):
        env.call("ff-feature-request", "bad")
    (text,) = log.texts(Level.ERROR)
    assert "'bad'" in text
    assert "of hello" in text
    assert problem in text
    assert env.call("ff-feature-request", "hello") == "TRUE"
    manager.close()


def test_a_plugin_gets_its_surroundings(bus, context, installed):
    code = (
        "\nclass Configured(Hello):\n"
        "    @classmethod\n"
        "    def make(cls, context):\n"
        "        made = cls()\n"
        "        made.number = context.config.get_uint('/a/b')\n"
        "        return made\n"
        "    def init_context(self, env):\n"
        "        env.define('number', lambda: self.number)\n"
    )
    installed(code, "configured = hello_feature:Configured")
    manager, env = managed(bus, context)
    env.call("ff-feature-request", "configured")
    assert env.call("number") == 7
    manager.close()


def test_ours_comes_before_a_plugin_of_its_name(bus, log, context, installed):
    class Own(Feature):
        name = "hello"

        def init_context(self, env):
            env.define("own", lambda: 1)

    installed()
    manager, env = managed(bus, context, Own())
    env.call("ff-feature-request", "hello")
    assert env.call("own") == 1
    assert log.texts(Level.WARN) == [
        "There is a CLIPS feature 'hello' already, hello_feature:Hello of hello is not used"
    ]
    manager.close()


def test_nothing_installed_is_nothing_found(context):
    assert find_plugins(context, []) == []
    entry = EntryPoint("b", "x:y", GROUP)
    assert [plugin.name for plugin in find_plugins(context, [entry, EntryPoint("a", "x:y", GROUP)])] == [
        "a",
        "b",
    ]
    assert str(find_plugins(context, [entry])[0]) == "x:y of ?"
