"""Invalid parameters, plug-ins and calls, which are reported with their place and do not stop the run."""

from __future__ import annotations

import re
import sys

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.errors import CxbridgeError
from cxbridge.events import Level, LogLine
from cxbridge.mainloop import Hook
from cxbridge.run import run_scenario
from cxbridge.run.program.plain_options import options_from_keywords
from cxbridge_ros2.actions import GoalHandler, GoalResponse, GoalServer, GoalStatus
from cxbridge_ros2cx.cx import plugin
from cxbridge_ros2cx.cx.node import CxNode
from cxbridge_ros2cx.cx.plugin import CxPlugin
from ros2cx_tests.cx.recordings import FOLDER
from tests.support import CX_DIR, needs_cx, needs_shared

HEAD = "/**:\n  ros__parameters:\n"


class Run:
    """A function that runs parameters.

    :ivar lines: the log lines of the environment ``one``.
    :ivar warnings: the reported warnings.
    """

    def __init__(self, folder):
        self.folder, self.warnings = folder, []
        self.lines: list[str] = []

    def __call__(self, text, program="", *, strict=None, seconds=1.0, ros2cx=None, peer=None):
        """Run parameters, and return the result and the reported errors."""
        (self.folder / "agent.clp").write_text(program)
        file = self.folder / "params.yaml"
        file.write_text(HEAD + text.replace("AGENT", str(self.folder / "agent.clp")))
        errors = []

        def console(event):
            if isinstance(event, LogLine) and event.level is Level.ERROR and event.text:
                errors.append(event.text.replace(str(self.folder), "T"))
            elif isinstance(event, LogLine) and event.level is Level.WARN:
                self.warnings.append(event.text)

        def attach(assembly):
            if peer is not None:
                assert isinstance(assembly.executive, CxNode)
                node = assembly.executive.manager.context.ros.graph.join("peer")
                step, begun_us = peer(node), assembly.clock.now_us()
                assembly.loop.add(Hook.PRE_LOOP, lambda: step((assembly.clock.now_us() - begun_us) / 1e6))

        logs = self.folder / "logs"
        options = options_from_keywords(file, timeout=seconds, strict=strict, log_dir=logs, ros2cx=ros2cx)
        result = run_scenario(options, console, attach=attach)
        log = logs / "one.log"
        self.lines = (
            [each.split("[info] ")[-1] for each in log.read_text().splitlines()] if log.is_file() else []
        )
        return result, errors


@pytest.fixture
def run(tmp_path):
    return Run(tmp_path)


ONE = "    environments: [one]\n    one: {plugins: [PLUGINS]}\n"


def make_plugins(*names, **classes):
    rows = "".join(f"    {name}: {{{text}}}\n" for name, text in classes.items())
    return ONE.replace("PLUGINS", ", ".join(names)) + rows


RATE = """    environments: [a]
    a: {plugins: [e]}
    e:
      plugin: 'cx::ExecutivePlugin'
      refresh_rate:"""


@pytest.mark.parametrize(
    ("text", "message", "line"),
    [
        ("    environments: []\n", "must name an environment", 3),
        ("    environments: [a, b, a]\n", "the environment 'a' twice", 3),
        ("    environments: [a, 1]\n", "values of several types: a string .*, an integer", 3),
        ("    environments: one\n", "must be a list of strings", 3),
        ("    environments: [.INF, .NaN]\n", "must be a list of strings, not a list of 2 values", 3),
        ("    environments: [a]\n    a:\n      watch: [fact]\n", "Unknown watch item: fact", 5),
        ("    environments: [a]\n    a:\n      plugins:\n", "has no value", 5),
        ("    environments: [a]\n    a: {watch: {}}\n    b: [[1]]\n", "must be a list of scalars", 5),
        (f"{RATE} 0.5\n", "must be an integer, not a double", 7),
        (f"{RATE} 0\n", "cannot be 0", 7),
    ],
)
def test_invalid_parameters_are_refused_with_line(run, text, message, line):
    with pytest.raises(CxbridgeError, match=message) as raised:
        run(text)
    assert raised.value.line == line


@pytest.mark.parametrize(
    ("classes", "message"),
    [
        ({"x": "plugin: 'cx::ConfigPlugins'"}, "T/params.yaml:5:17: .* names a class .* cx::ConfigPlugins"),
        ({"x": "plugins: 'cx::ConfigPlugin'"}, "T/params.yaml: the plug-in 'x' has no class"),
        ({}, "T/params.yaml: the plug-in 'x' has no class"),
        ({"x": "plugin: 3"}, "T/params.yaml:5:17: .* must be a string"),
        (
            {"x": "plugin: 'cx::CXNoMsgsNothingPlugin'"},
            "names a class without a stand-in in cxbridge: cx::CXNo",
        ),
        (
            {"x": "plugin: 'cx::FileLoadPlugin', load: [nope.clp]"},
            "T/params.yaml:5:45: .*does not exist: nope.clp",
        ),
        (
            {"x": "plugin: 'cx::FileLoadPlugin', pkg_share_dirs: [nope]"},
            "names a package that does not exist: nope",
        ),
        (
            {"x": "plugin: 'cx::ProtobufPlugin', proto_paths: [nope]"},
            "names a folder that does not exist: nope",
        ),
    ],
)
def test_invalid_plugin_is_reported_and_skipped(run, classes, message):
    result, errors = run(make_plugins("x", "e", **classes, e="plugin: 'cx::ExecutivePlugin'"))
    (error,) = errors
    assert re.search(message, error.replace("\n", " "))
    assert (result.status, result.firings) == (1, 10)


def test_strict_run_does_not_start(run):
    with pytest.raises(CxbridgeError, match="names a class"):
        run(make_plugins("x", x="plugin: nope"), strict=True)


FILE_PLUGINS = make_plugins(
    "e",
    "m",
    "f",
    e="plugin: 'cx::ExecutivePlugin'",
    m="plugin: 'cx::RosMsgsPlugin'",
    f="plugin: 'cx::FileLoadPlugin', load: [AGENT]",
)


BOOL = '(ros-msgs-create-message "std_msgs/msg/Bool")'
FIBONACCI = "example_interfaces/action/Fibonacci"


@pytest.mark.parametrize(
    ("action", "message"),
    [
        ('(ros-msgs-create-message "no_msgs/msg/No")', "unknown ROS 2 type no_msgs/msg/No"),
        ('(ros-msgs-create-message "???")', "is not the name of a ROS 2 type"),
        (
            '(ros-msgs-publish (ros-msgs-create-message "std_msgs/msg/String") never)',
            "there is no publisher of never",
        ),
        (
            '(ros-msgs-create-publisher "bad name" "std_msgs/msg/String")',
            "is not an absolute name of a topic",
        ),
        (f'(bind ?m {BOOL}) (ros-msgs-destroy-message ?m) (ros-msgs-get-field ?m "data")', "Invalid pointer"),
        (
            '(ros-msgs-async-send-request (ros-msgs-create-request "std_srvs/srv/SetBool") never)',
            "there is no client of never",
        ),
        (
            f'(ros-msgs-create-action-client a "{FIBONACCI}") (ros-msgs-async-cancel-goal a {BOOL})',
            "Unknown goal handle",
        ),
    ],
)
def test_invalid_call_ends_only_its_rule(run, action, message):
    rules = f"(defrule wrong (declare (salience 1)) => {action} (printout t not-reached crlf))"
    result, errors = run(FILE_PLUGINS, f"{rules} (defrule right (time ?) => (printout t right crlf))")
    assert all(any(text in error for error in errors) for text in (message, "PRCCODE4"))
    assert (result.status, result.firings) == (1, 21)
    assert any("open a action client, cleaning up" in text for text in run.warnings) == (
        "create-action-client" in action
    )


@pytest.mark.parametrize(
    ("kind", "field", "value", "message"),
    [
        ("Bool", "data", "1", "cannot be 1"),
        ("String", "nope", '"x"', "Failed to set field nope"),
        ("String", "data", "1", "cannot be 1"),
        ("Int32", "data", "2.5", "cannot be 2.5"),
        ("Float64MultiArray", "data", "1.0", "expected multifield value!"),
        ("Header", "stamp", "1", "takes a message of type builtin_interfaces/msg/Time, not 1"),
    ],
)
def test_invalid_value_of_field_is_reported_without_effect(run, kind, field, value, message):
    program = (
        f'(defrule a => (bind ?m (ros-msgs-create-message "std_msgs/msg/{kind}"))'
        f' (ros-msgs-set-field ?m "{field}" {value}) (printout t reached crlf) (assert (reached)))'
        "(defrule b (reached) => (cx-shutdown))"
    )
    result, errors = run(FILE_PLUGINS, program)
    (error,) = errors
    assert message in error
    assert result.run_seconds < 1


HOOKS = ("initialize", "init_context", "receive_messages", "tick", "context_destroyed", "finalize")


@pytest.mark.parametrize("hook", ["__init__", *HOOKS])
def test_exception_in_plugin_hook_is_reported_with_place(run, hook, monkeypatch):
    """The executive plug-in continues: a rule fires in each tick."""

    def fail(self, *_arguments):
        raise ValueError("no door")

    failing = type("Failing", (CxPlugin,), {hook: fail})
    monkeypatch.setitem(plugin._SHIPPED_CLASSES, "door::Door", f"{__name__}:Failing")
    monkeypatch.setattr(sys.modules[__name__], "Failing", failing, raising=False)
    text = make_plugins("x", "e", x="plugin: 'door::Door'", e="plugin: 'cx::ExecutivePlugin'")
    result, errors = run(text)
    assert [re.sub(r"^.*/|py:\d+", "", error) for error in errors] == [
        "test_bad_input.: the plug-in 'x' failed: ValueError: no door"
    ]
    is_counted = hook not in {"context_destroyed", "finalize"}  # these hooks follow the result
    assert (result.status, result.firings) == (int(is_counted), 10)


def test_hook_table_is_complete():
    helpers = {"parameter", "name", "with_false_on_error", "find_share_folders", "log_parameter_error"}
    hooks = {name for name in vars(CxPlugin) if not name.startswith("_")} - helpers
    assert hooks == {*HOOKS} - {"context_destroyed"}  # a hook of the base class


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("int32 a\nint32 a b c\n", "Broken.msg"),
        ("Nothing a\n", "unknown ROS 2 type own_msgs/msg/Nothing"),
    ],
)
def test_unreadable_definition_fails_rule(run, tmp_path, text, message):
    package = tmp_path / "own_msgs"
    (package / "msg").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>own_msgs</name></package>")
    (package / "msg" / "Broken.msg").write_text(text)
    rules = '(defrule wrong => (ros-msgs-create-message "own_msgs/msg/Broken"))'
    result, errors = run(
        FILE_PLUGINS, f"{rules} (defrule right (time ?) => (printout t right crlf))", ros2cx=package
    )
    assert any(message in error for error in errors)
    assert (result.status, result.firings) == (1, 21)


def test_message_of_different_type_is_not_received(run):
    def peer(node):
        publisher = node.create_publisher("/talk", "std_msgs/msg/Int32")
        return lambda _seconds: publisher.publish({"data": 1})

    rules = '(defrule listen => (ros-msgs-create-subscription "/talk" "std_msgs/msg/String"))'
    result, errors = run(
        FILE_PLUGINS, f"{rules} (defrule came (ros-msgs-message) => (printout error came crlf))", peer=peer
    )
    assert (result.status, errors) == (0, [])


@needs_cx
def test_plugin_in_use_can_be_unloaded(run):
    """Each firing of a rule with a function of the plug-in is an error, and the node continues."""

    def peer(node):
        client = node.create_client("/clips_manager/unload_plugin", "cx_msgs/srv/UnloadClipsPlugin")
        requests = [{"env_name": "one", "plugin_name": "m"}]

        def step(seconds):
            if requests and seconds > 0.5:
                client.call(requests.pop(), lambda _response: None)

        return step

    program = '(defrule use (time ?) => (ros-msgs-destroy-publisher "x") (printout t used crlf))'
    result, errors = run(FILE_PLUGINS, program, peer=peer, ros2cx=CX_DIR)
    assert any("the plug-in 'm' was unloaded from the environment 'one'" in error for error in errors)
    assert (result.status, result.loops) == (1, 11)


STATES = {
    "unknown": ("", ""),
    "accepted": ("waits", ""),
    "executing": ("runs", ""),
    "canceling": ("runs", "cancel"),
    "ended": ("ends", ""),
}
"""By state of the goal: the behaviour of the server and the request of the client before the end."""


class Server(GoalHandler):
    """A server of Fibonacci that leaves 0.3 s after the arrival of a goal."""

    def __init__(self, node, behaviour):
        self.node, self.behaviour, self.begin_s = node, behaviour, None
        self.server = GoalServer(node, "/count", FIBONACCI, self, VirtualClock())

    def decide(self, served):
        return GoalResponse.ACCEPT_AND_DEFER if self.behaviour == "waits" else GoalResponse.ACCEPT_AND_EXECUTE

    def begin(self, served):
        self.begin_s = -1.0
        if self.behaviour == "ends":
            served.finish(GoalStatus.SUCCEEDED, {"sequence": [1]})

    def step(self, seconds):
        if self.begin_s is not None and self.begin_s < 0:
            self.begin_s = seconds
        if self.node is not None and (not self.behaviour or (self.begin_s and seconds > self.begin_s + 0.3)):
            self.node.close()
            self.node = None


@pytest.mark.parametrize("state", STATES)
def test_run_continues_after_server_leaves(run, state):
    behaviour, client_request = STATES[state]
    program = f"""
(defrule begin => (ros-msgs-create-action-client "/count" "{FIBONACCI}")
  (ros-msgs-async-send-goal (ros-msgs-create-goal-request "{FIBONACCI}") "/count"))
(defrule stop (ros-msgs-goal-response (client-goal-handle-ptr ?p)) (test (eq "{client_request}" "cancel"))
  => (ros-msgs-async-cancel-goal "/count" ?p))
(defrule ended (ros-msgs-wrapped-result (code ?code)) => (printout t "ended " ?code crlf))
(defrule on (time ?) => (printout t on crlf))
"""
    result, errors = run(FILE_PLUGINS, program, peer=lambda node: Server(node, behaviour).step, seconds=3.0)
    assert (result.status, errors) == (0, [])
    assert run.lines.count("on") == 30
    assert run.lines.count("ended SUCCEEDED") == (behaviour == "ends")


@pytest.mark.parametrize("recording", ["empty_plugins", "two_envs_no_log"])
@needs_shared
def test_parameters_that_crash_original_are_run(recording, tmp_path):
    file = FOLDER / recording / "params.yaml"
    assert run_scenario(options_from_keywords(file, timeout=1.0, log_dir=tmp_path)).status == 0
    assert {each.stem for each in tmp_path.glob("*.log")} == {"one", "two"}


def test_recursive_files_are_reported(run, tmp_path):
    second_file = tmp_path / "other.clp"
    second_file.write_text(f'(batch* "{tmp_path / "agent.clp"}")')
    result, errors = run(FILE_PLUGINS.replace("load:", "batch:"), f'(batch* "{second_file}")\n')
    assert any("agent.clp: this file reads itself" in error for error in errors)
    assert result.loops == 11


def test_endless_rules_are_fault(run):
    program = "(deffacts f (n 0)) (defrule on ?f <- (n ?x) => (retract ?f) (assert (n (+ ?x 1))))"
    result, errors = run(FILE_PLUGINS, program)
    assert result.status == 4
    assert any("on" in error for error in errors)
