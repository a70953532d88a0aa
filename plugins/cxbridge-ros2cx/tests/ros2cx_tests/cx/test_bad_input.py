"""What is wrong is one error with its place; the rest goes on, and nothing hangs."""

from __future__ import annotations

import re

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.events import Level, LogLine
from cxbridge.run import run_scenario
from cxbridge.run.program.plain_options import make_options

HEAD = "/**:\n  ros__parameters:\n"


@pytest.fixture
def run(tmp_path):
    """Run parameters; return the result and the errors that were reported."""

    def run(text, program="", *, strict=None, seconds=1.0):
        (tmp_path / "agent.clp").write_text(program)
        file = tmp_path / "params.yaml"
        file.write_text(HEAD + text.replace("AGENT", str(tmp_path / "agent.clp")))
        errors = []

        def console(event):
            if isinstance(event, LogLine) and event.level is Level.ERROR and event.text:
                errors.append(event.text.replace(str(tmp_path), "T"))

        options = make_options(file, timeout=seconds, strict=strict, log_dir=tmp_path / "logs")
        return run_scenario(options, console), errors

    return run


ONE = "    environments: [one]\n    one: {plugins: [PLUGINS]}\n"


def plugins(*names, **classes):
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
        ("    environments: []\n", "names no environment", 3),
        ("    environments: [a, b, a]\n", "the environment 'a' twice", 3),
        ("    environments: [a, 1]\n", "values of several types: a string .*, an integer", 3),
        ("    environments: one\n", "must be a list of strings", 3),
        ("    environments: [a]\n    a:\n      watch: [fact]\n", "Unknown watch item: fact", 5),
        ("    environments: [a]\n    a:\n      plugins:\n", "has no value", 5),
        ("    environments: [a]\n    a: {watch: {}}\n    b: [[1]]\n", "must be a list of scalars", 5),
        (f"{RATE} 0.5\n", "must be an integer, not a double", 7),
        (f"{RATE} 0\n", "cannot be 0", 7),
    ],
)
def test_parameters_that_make_no_sense(run, text, message, line):
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
        ({"x": "plugin: 'cx::CXNoMsgsNothingPlugin'"}, "names a class that cxbridge does not have: cx::CXNo"),
        (
            {"x": "plugin: 'cx::FileLoadPlugin', load: [nope.clp]"},
            "T/params.yaml:5:45: .*not there: nope.clp",
        ),
        (
            {"x": "plugin: 'cx::FileLoadPlugin', pkg_share_dirs: [nope]"},
            "names a package that is not there: nope",
        ),
        (
            {"x": "plugin: 'cx::ProtobufPlugin', proto_paths: [nope]"},
            "names a folder that is not there: nope",
        ),
    ],
)
def test_a_plugin_that_cannot_be_made_is_left_out(run, classes, message):
    result, errors = run(plugins("x", "e", **classes, e="plugin: 'cx::ExecutivePlugin'"))
    (error,) = errors
    assert re.search(message, error.replace("\n", " "))
    assert (result.status, result.firings) == (1, 10)


def test_strict_does_not_start(run):
    with pytest.raises(CxbridgeError, match="names a class"):
        run(plugins("x", x="plugin: nope"), strict=True)


FILES = plugins(
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
        ('(ros-msgs-create-message "no_msgs/msg/No")', "there is no ROS 2 type no_msgs/msg/No"),
        ('(ros-msgs-create-message "???")', "is no name of a ROS 2 type"),
        (
            '(ros-msgs-publish (ros-msgs-create-message "std_msgs/msg/String") never)',
            "there is no publisher of never",
        ),
        ('(ros-msgs-create-publisher "bad name" "std_msgs/msg/String")', "is no whole name of a topic"),
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
def test_a_wrong_call_ends_the_rule_only(run, action, message):
    rules = f"(defrule wrong (declare (salience 1)) => {action} (printout t not-reached crlf))"
    result, errors = run(FILES, f"{rules} (defrule right (time ?) => (printout t right crlf))")
    assert any(message in error for error in errors)
    assert any("PRCCODE4" in error for error in errors)
    assert (result.status, result.firings) == (1, 21)


@pytest.mark.parametrize(
    ("kind", "field", "value", "message"),
    [
        ("Bool", "data", "1", "takes no 1"),
        ("String", "nope", '"x"', "Failed to set field nope"),
        ("String", "data", "1", "takes no 1"),
        ("Int32", "data", "2.5", "takes no 2.5"),
        ("Float64MultiArray", "data", "1.0", "expected multifield value!"),
        ("Header", "stamp", "1", "Failed to set unknown message"),
    ],
)
def test_a_value_that_a_field_does_not_take_changes_nothing(run, kind, field, value, message):
    program = (
        f'(defrule a => (bind ?m (ros-msgs-create-message "std_msgs/msg/{kind}"))'
        f' (ros-msgs-set-field ?m "{field}" {value}) (printout t reached crlf) (assert (reached)))'
        "(defrule b (reached) => (cx-shutdown))"
    )
    result, errors = run(FILES, program)
    (error,) = errors
    assert message in error
    assert result.run_seconds < 1


def test_files_that_execute_each_other_end(run, tmp_path):
    other = tmp_path / "other.clp"
    other.write_text(f'(batch* "{tmp_path / "agent.clp"}")')
    result, errors = run(FILES.replace("load:", "batch:"), f'(batch* "{other}")\n')
    assert any("agent.clp: this file reads itself" in error for error in errors)
    assert result.loops == 11


def test_an_agent_ends_its_run(run):
    result, errors = run(FILES, "(defrule end (time ?) => (cx-shutdown))")
    assert (result.status, errors) == (0, [])
    assert result.run_seconds < 0.3


def test_rules_without_an_end_are_a_fault(run):
    program = "(deffacts f (n 0)) (defrule on ?f <- (n ?x) => (retract ?f) (assert (n (+ ?x 1))))"
    result, errors = run(FILES, program)
    assert result.status == 4
    assert any("on" in error for error in errors)
