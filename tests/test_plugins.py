"""Plug-ins: the example of docs/plugins.md has each hook; broken plug-ins are left out.

The operation of the example: tests/daemon/operations/test_table.py.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pkgutil import resolve_name
from typing import get_type_hints

import pytest

from cxbridge import plugins
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.cli.main import invoke
from cxbridge.clock import RealClock, VirtualClock
from cxbridge.config import Configuration
from cxbridge.daemon.client import request
from cxbridge.daemon.settings import DaemonSettings
from cxbridge.errors import BrokenAgentError, ConfigError, CxbridgeError
from cxbridge.events import Event, Level, LogLine
from cxbridge.plugins import HOOKS, PluginError, Row, Table, installed_plugins, is_module, known_packages
from cxbridge.run import Run, RunOptions, run_scenario
from cxbridge.run.agents import make_configured_clock
from cxbridge.run.explainers import with_explanations
from cxbridge.run.pages import VIEWS
from cxbridge.run.program.finished import open_run as read_run
from cxbridge.run.program.plain_options import options_from_keywords
from cxbridge.run.source import source_of
from cxbridge.trace.formats.registry import copy_formats, open_run
from tests.blackboard.samples import SampleRegistry
from tests.daemon.test_daemon import WAIT_S, connected, running
from tests.plugins import example, forget, install
from tests.run.mini import AGENT, write_scenario
from tests.support import ROOT, module_files, needs_all_plugins


@pytest.fixture
def greeter(tmp_path, monkeypatch):
    install(tmp_path / "site", monkeypatch, "greeter", example())
    yield
    forget("greeter")


@pytest.fixture
def broken(tmp_path, monkeypatch):
    """Installs a plug-in whose module of tables has a text."""
    names = []

    def write(text, name="broken", entry=""):
        install(tmp_path / f"site-{name}", monkeypatch, name, {"plugin.py": text}, entry)
        names.append(name)

    yield write
    for name in names:
        forget(name)


@pytest.fixture
def alone(monkeypatch):
    """Has no plug-in installed."""
    monkeypatch.setattr(plugins, "installed_plugins", tuple)


def test_example_has_each_hook(greeter):
    (plugin,) = (plugin for plugin in installed_plugins() if plugin.name == "greeter")
    assert (plugin.error, plugin.package) == (None, "greeter 1.0")
    assert plugin.rows.keys() == HOOKS
    assert {row.origin for rows in plugin.rows.values() for row in rows} == {"greeter (greeter 1.0)"}


def test_page_describes_each_hook():
    page = (ROOT / "docs" / "plugins.md").read_text()
    assert [hook for hook in sorted(HOOKS) if hook not in page] == []


def recording(folder):
    """Return the recording of a run."""
    trace = folder / "run.mcap"
    run_scenario(RunOptions(scenario=write_scenario(folder / "recorded"), trace=trace))
    return trace


def start_lines(folder) -> list[str]:
    events: list[Event] = []
    run_scenario(RunOptions(scenario=folder), events.append)
    return [event.text for event in events if isinstance(event, LogLine)]


def command(site, *arguments):
    """Run a command in a separate process: a command has the options of the plug-ins at its import."""
    call = [sys.executable, "-c", "from cxbridge.cli.entry import main; main()", *map(str, arguments)]
    environ = {**os.environ, "PYTHONPATH": str(site)}
    return subprocess.run(call, capture_output=True, text=True, env=environ, check=False)


def test_feature_of_example(greeter, tmp_path):
    rules = (
        '(defrule greeting (executive-initialized) => (printout t (greet "Robin") crlf))'
        "(defrule guest (guest (name ?n) (mood happy)) => (printout t ?n crlf))"
    )
    agent = AGENT + rules
    lines = start_lines(
        write_scenario(tmp_path / "s", agent=agent, feature="greeting", more="greeting: Welcome\n")
    )
    assert "Welcome Robin" in lines
    assert "Robin" in lines


def test_component_of_example(greeter, tmp_path):
    uid = ("SwitchInterface", "Heartbeat")
    with Run(RunOptions(scenario=write_scenario(tmp_path / "s"))) as assembly:
        assembly.start()
        assert not assembly.board.list(*uid)  # the section is missing
    with Run(RunOptions(scenario=write_scenario(tmp_path / "s", more="heartbeat: {on: true}\n"))) as assembly:
        assembly.start()
        reader = assembly.board.open_for_reading(*uid, owner="test")
        assembly.loop.run(lambda: assembly.loop.cycle_count >= 3)
        reader.read()
        assert reader.as_dict()["value"] == 3.0


def test_command_of_example(greeter, capsys):
    assert invoke(["greet", "Robin"]) == 7
    assert capsys.readouterr().out == "Good morning, Robin.\n"
    assert invoke(["--help"]) == 0
    look = capsys.readouterr().out.partition("\nLook:\n")[2].partition("\n\n")[0]
    assert "Greet a person." in look


def test_command_of_example_has_common_options(greeter, capsys, tmp_path):
    endpoint = f"ipc://{tmp_path}/bb"
    with running(settings=(("fawkes/enable", False), ("zmq/endpoints", [endpoint]))):
        assert invoke(["writers", "--json", "--connect", endpoint]) == 0
        assert "SkillerLua" in json.loads(capsys.readouterr().out)
    assert invoke(["writers", "--connect", f"ipc://{tmp_path}/none?timeout=1"]) == 2


def test_transport_of_example(greeter):
    near, far = (open_blackboard("shelf://one", SampleRegistry(), VirtualClock()) for _ in "ab")
    assert near is far


def test_format_of_example(greeter, tmp_path):
    (tmp_path / "run").write_bytes(b"HELLO")
    assert list(open_run(tmp_path / "run")) == [LogLine(0, Level.INFO, "shout", "HELLO")]
    assert list(copy_formats())[-1] == "shouted"


def test_source_of_example(greeter, tmp_path):
    write_scenario(tmp_path / "s")
    (tmp_path / "agent.greet").write_text("s\n")
    options = RunOptions(scenario=tmp_path / "agent.greet")
    assert source_of(options).load_configuration()[1].name == "scenario.yaml"
    assert run_scenario(options).status == 0


def test_options_of_example(greeter, tmp_path):
    folder = write_scenario(tmp_path / "s")
    refused = command(tmp_path / "site", "run", folder, "--greeting", "")
    assert refused.returncode == 2
    assert "--greeting is empty" in refused.stderr
    assert command(tmp_path / "site", "run", folder, "--greeting", "Hi").returncode == 0
    assert options_from_keywords(folder, greeting="Hi").option("greeting") == "Hi"
    assert options_from_keywords(folder).option("greeting") is None


def test_template_of_example(greeter, tmp_path):
    site, folder = tmp_path / "site", tmp_path / "hall"
    refused = command(site, "new", folder, "--from-greet", "")
    assert (refused.returncode, folder.exists()) == (2, False)
    assert "--from-greet is empty" in refused.stderr
    assert command(site, "new", folder, "--from-greet", "Robin").returncode == 0
    assert {file.name for file in folder.iterdir()} == {"hall.clp", "conftest.py"}
    assert "Hello Robin" in (folder / "hall.clp").read_text()
    other = ["--from-fawkes", "test", "--fawkes-dir", tmp_path]
    assert "cannot be combined" in command(site, "new", tmp_path / "x", "--from-greet", "R", *other).stderr


def test_decider_of_example(greeter, tmp_path):
    folder = write_scenario(tmp_path / "s", mapping="act: bow{deep=?(text)s}")
    with Run(RunOptions(scenario=folder, skiller="simulator")) as assembly:
        assembly.start()
        assembly.loop.run(lambda: assembly.is_over)
        (skiller,) = assembly.board.list("SkillerInterface")
        reader = assembly.board.open_for_reading("SkillerInterface", skiller.id, owner="test")
        reader.read()
        assert reader.as_dict()["error"] == "my back"


def test_member_of_example(greeter, tmp_path, cx):
    folder = write_scenario(tmp_path / "s", agent=AGENT, feature="greeting")
    run = cx.run(folder)
    run.to_end()
    with pytest.raises(AssertionError, match="nobody has greeted Robin"):
        run.assert_greeted("Robin")
    run.assert_fact('(guest (name "Robin"))')
    run.assert_greeted("Robin")


def test_unknown_member_is_an_error(cx, monkeypatch):
    with pytest.raises(AttributeError, match=r"cx has no member 'greet'; docs/testing\.md"):
        cx.greet()
    monkeypatch.setattr(plugins, "installed_plugins", tuple)
    with pytest.raises(AttributeError, match=r"plug-in cxbridge-explore: .* install"):
        cx.explore("scenarios/courier")


def test_table_of_example(greeter, tmp_path, monkeypatch):
    tables = (
        'from cxbridge.plugins import Row\nAPI = 1\nGREETER_VOICES = (Row("loud", "loud.voice:shout"),)\n'
    )
    voice = "def shout(text):\n    return text.upper()\n"
    install(tmp_path / "second", monkeypatch, "loud", {"plugin.py": tables, "voice.py": voice})
    try:
        assert resolve_name("greeter.choir:sing")("hello") == "HELLO"
    finally:
        forget("loud")


def test_explainer_of_example(greeter, monkeypatch, tmp_path):
    only = tuple(plugin for plugin in installed_plugins() if plugin.name == "greeter")
    monkeypatch.setattr(plugins, "installed_plugins", lambda: only)
    assert read_run(recording(tmp_path)).why("MINI") == "MINI of run.mcap: the guests were polite"
    options = RunOptions(scenario=tmp_path / "s")
    error = with_explanations(BrokenAgentError([CxbridgeError("it is broken", file=tmp_path / "s")]), options)
    assert "say hello first" in str(error)


def test_run_without_explainer_is_an_error(alone, tmp_path):
    with pytest.raises(PluginError, match="no installed package explains runs") as caught:
        read_run(recording(tmp_path)).why("MINI")
    assert "cxbridge-studio" in str(caught.value.hint)
    error = BrokenAgentError([CxbridgeError("it is broken")])
    assert with_explanations(error, RunOptions()) is error


def test_run_imports_tables_of_plug_in_only(greeter, tmp_path):
    start_lines(write_scenario(tmp_path / "s"))
    assert [name for name in sys.modules if name.startswith("greeter")] == ["greeter", "greeter.plugin"]


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ("API = 1\nimport nothing_of_this_name", "the plug-in 'broken' of broken 1.0 cannot be loaded"),
        ("raise SystemError('x')", "cannot be loaded: SystemError: x"),
        ("", "is for version None of the hooks"),
        ("API = 2", "is for version 2 of the hooks, this cxbridge has version 1"),
        ("API = 1\nFEATURE = ()", "has a table FEATURE, but no hook has that name"),
        (
            "API = 1\nFEATURES = ['a']",
            "FEATURES of the plug-in 'broken' of broken 1.0 is not a tuple of rows",
        ),
    ],
)
def test_broken_plug_in_is_reported_and_skipped(broken, tables, message, tmp_path, capsys):
    broken(tables)
    (plugin,) = (plugin for plugin in installed_plugins() if plugin.name == "broken")
    assert message in str(plugin.error)
    assert not plugin.rows
    assert any(message in line for line in start_lines(write_scenario(tmp_path / "s")))
    assert invoke(["doctor"]) == 0
    assert message in capsys.readouterr().out


def test_plug_ins_of_same_name_are_an_error_with_packages(broken):
    broken("API = 1")
    broken("API = 1", "other", "broken = other.plugin")
    (plugin,) = (plugin for plugin in installed_plugins() if plugin.name == "broken")
    assert "broken 1.0 and other 1.0 both have" in str(plugin.error)


@pytest.mark.parametrize(
    ("table", "use"),
    [
        ("COMMANDS = (Row('run', 'x:y'),)", lambda folder: invoke(["run", str(folder)])),
        ("FEATURES = (Row('tf', 'x:y'),)", start_lines),
        ("COMPONENTS = (Row('speech', 'x:y'),)", start_lines),
    ],
)
def test_rows_of_same_name_are_an_error_with_packages(broken, table, use, tmp_path, capsys):
    broken(f"from cxbridge.plugins import Row\nAPI = 1\n{table}\n")
    try:
        assert use(write_scenario(tmp_path / "s")) == 2
        text = capsys.readouterr().err
    except PluginError as error:
        text = str(error)
    assert "of cxbridge, and x:y of broken (broken 1.0)" in text


@pytest.mark.parametrize("target", ["no_such_module:X", "broken.plugin:NOTHING", "broken.plugin:API"])
def test_unusable_object_is_an_error_with_package(broken, target, monkeypatch):
    broken(f"from cxbridge.plugins import Row\nAPI = 1\nFORMATS = (Row('bad', '{target}'),)\n")
    monkeypatch.setattr(plugins, "HOOKS", HOOKS)
    table: Table[object] = Table("FORMATS", is_module, "a module")
    row = table.find("bad")
    with pytest.raises(PluginError, match=r"the format 'bad' \(\S+ of broken \(broken 1.0\)\)"):
        table.load_target(row)


def test_unknown_name_is_an_error_with_nearest_name():
    with pytest.raises(PluginError, match="there is no format 'mcapp'") as caught:
        Table("FORMATS", is_module, "a module", Row("mcap", "json")).find("mcapp")
    assert caught.value.hint == "did you mean mcap?"


def test_settings_of_example(greeter):
    config = Configuration()
    config.set("/cxbridge/greeter/host", "0.0.0.0")
    settings = DaemonSettings.from_config(config)
    assert not settings.sections["greeter"].is_local
    assert not settings.rights.programs
    config.set("/cxbridge/greeter/port", 1)
    with pytest.raises(ConfigError, match="/cxbridge/greeter/port is not a setting"):
        DaemonSettings.from_config(config)


def test_clock_of_example(greeter, tmp_path):
    assert isinstance(make_configured_clock("quick", Configuration(), tmp_path), RealClock)
    assert run_scenario(RunOptions(scenario=write_scenario(tmp_path / "s"), clock="quick")).status == 0


def test_view_of_example(greeter, tmp_path):
    (tmp_path / "run").write_bytes(b"HELLO")
    view = VIEWS.load_target(VIEWS.find("greeting"))
    assert view(open_run(tmp_path / "run")) == "<h1>Hello run</h1>"


def names_of_options(options):
    for name, hint in get_type_hints(options, include_extras=True).items():
        for option in getattr(hint, "__metadata__", ()):
            if hasattr(option, "param_decls"):
                names = (option.default, *(option.param_decls or ()), f"--{name.replace('_', '-')}")
                yield next(text for text in names if str(text).startswith("--"))


def names_of_operations(operations):
    """Yield the names of requests, and the first parts of routes."""
    for operation in operations:
        if operation.is_verb:
            yield f"request {operation.name}"
        for route in operation.routes:
            yield "/api" + "/".join(route.path.split("/")[:3])


def names_of(plugin):
    """Yield the names by which users select a plug-in: commands, options, features, formats, sections."""
    for hook, rows in plugin.rows.items():
        for row in rows:
            if hook in {"CLOCKS", "FEATURES", "MEMBERS", "SETTINGS", "VIEWS"}:
                yield row.name
            elif hook == "COMMANDS":
                yield row.name.rpartition(" ")[2]
            elif hook in {"OPTIONS", "TEMPLATES"}:
                yield from names_of_options(resolve_name(row.target))
            elif hook == "OPERATIONS":
                yield from names_of_operations(resolve_name(row.target).OPERATIONS)
            elif hook == "FORMATS":
                yield from (copy.name for copy in getattr(resolve_name(row.target), "COPIES", ()))
            elif hook == "TRANSPORTS":
                yield f"{row.name}://"
            if hook == "SETTINGS" and resolve_name(row.target).in_runs:
                yield resolve_name(row.target).SECTION


@needs_all_plugins
def test_names_of_plug_ins_of_repository_are_known():
    """Without the plug-in, its names lead to the package."""
    own = [plugin for plugin in installed_plugins() if plugin.package.startswith("cxbridge-")]
    wanted = {name: plugin.package.partition(" ")[0] for plugin in own for name in names_of(plugin)}
    assert {name: known_packages().get(name) for name in wanted} == wanted


@pytest.mark.parametrize(
    ("arguments", "package"),
    [
        (["run", "SCENARIO", "--web"], "cxbridge-web"),
        (["trace", "report", "RUN"], "cxbridge-web"),
        (["view", "run.mcap"], "cxbridge-web"),
        (["run", "SCENARIO", "--clock", "ros2"], "cxbridge-ros2"),
        (["trace", "convert", "RUN", "out.mcap", "--to", "rosbag"], "cxbridge-ros2"),
        (["trace", "convert", "RUN", "out.csv", "--to", "csv"], "cxbridge-fawkes"),
        (["trace", "repair", "RUN"], "cxbridge-studio"),
        (["run", "ROS2"], "cxbridge-ros2"),
        (["run", "PLANNER"], "cxbridge-planning"),
        (["run", "MEMORY"], "cxbridge-robot-memory"),
        (["run", "WAITING"], "cxbridge-robot-memory"),
        (["run", "BLACKBOARD"], "cxbridge-planning"),
        (["daemon", "start", "WEB"], "cxbridge-web"),
        (["bb", "list", "--connect", "fawkes://robot"], "cxbridge-fawkes"),
        (["gateway", "fawkes://robot", "local:"], "cxbridge-fawkes"),
        (["daemon", "SCENARIO", "--fawkes-port", "0"], "cxbridge-fawkes"),
        (["daemon", "start", "FAWKES"], "cxbridge-fawkes"),
        (["run", "SCENARIO", "--skiller", "fawkes://robot"], "cxbridge-fawkes"),
        (["run", "SCENARIO", "--bblog", "NEW"], "cxbridge-fawkes"),
        (["trace", "info", "LOG"], "cxbridge-fawkes"),
        (["trace", "info", "LOGS"], "cxbridge-fawkes"),
        (["trace", "record", "-i", "*", "-o", "NEW", "--connect", "local:"], "cxbridge-fawkes"),
    ],
)
def test_error_of_absent_plug_in_names_package(arguments, package, alone, tmp_path, monkeypatch, capsys):
    # monkeypatch restores the modules, and forgets those that the test imports without the plug-ins' options
    for module in [name for name in module_files() if name.startswith("cxbridge.cli.commands")]:
        monkeypatch.setitem(sys.modules, module.removesuffix(".__init__"), sys)
        del sys.modules[module.removesuffix(".__init__")]
    monkeypatch.setattr("cxbridge.run.agent.installed_plugins", tuple)
    sections = {
        "SCENARIO": "",
        "ROS2": "ros2: {interfaces: {a: b}}\n",
        "WEB": "cxbridge: {web: {port: 1}}\n",
        "FAWKES": "cxbridge: {fawkes: {port: 1}}\n",
    }
    places = {name: write_scenario(tmp_path / name, more=text) for name, text in sections.items()}
    folders = {"LOGS": tmp_path / "logs", "NEW": tmp_path / "new"}
    places |= folders | {"RUN": tmp_path / "run.txt", "LOG": folders["LOGS"] / "a.log"}
    places["RUN"].write_text("")
    places["LOGS"].mkdir()
    places["LOG"].write_bytes(b"\xff\xbb\xff\xbb\0\0\0\x01")
    for name, feature in (("PLANNER", "planner"), ("MEMORY", "robot_memory")):
        places[name] = write_scenario(tmp_path / name, feature=feature)
    for name, file_name in (("BLACKBOARD", "pddl-init.clp"), ("WAITING", "BATCH|robmem-wait-init.clp")):
        places[name] = write_scenario(tmp_path / name)
        scenario_file = places[name] / "scenario.yaml"
        scenario_file.write_text(
            scenario_file.read_text().replace("[mini.clp,", f'[mini.clp, "{file_name}",')
        )
    status = invoke([str(places.get(argument, argument)) for argument in arguments])
    assert status == (0 if arguments[-1] in ("ROS2", "WAITING") else 2)
    assert f"belongs to the plug-in {package}: " in capsys.readouterr().err


def test_server_of_absent_plug_in_may_be_off(alone):
    with running(settings=(("fawkes/enable", False), ("zmq/endpoints", []))) as (_, _lines, outcome):
        assert outcome == []
    assert outcome == [0]


def test_error_of_request_to_absent_plug_in_names_package(alone):
    with (
        running(settings=(("executive", False),)) as (daemon, _lines, _),
        connected(daemon) as board,
        pytest.raises(CxbridgeError, match="the request 'facts' is unknown to this daemon") as caught,
    ):
        request(board, "facts", WAIT_S, env="executive")
    assert "request facts belongs to the plug-in cxbridge-studio: " in str(caught.value.hint)
