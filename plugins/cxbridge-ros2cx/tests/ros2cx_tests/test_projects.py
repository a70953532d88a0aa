"""The command ``cxbridge new --from-ros2cx``."""

from __future__ import annotations

from pathlib import Path

import pytest

import cxbridge_ros2cx
from cxbridge.cli.main import invoke
from tests.cli.test_new import files_in, launches, passes_its_test
from tests.support import CX_DIR, needs_cx, share

EXAMPLES = Path(cxbridge_ros2cx.__file__).parent / "examples" / "params"
AGENTS = ("hello.yaml", "chat.yaml", "count.yaml")


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("agent", share(AGENTS, 1))
def test_project_of_example_agent_passes_its_test(agent, folder):
    assert invoke(["new", "mine", "--from-ros2cx", str(EXAMPLES / agent)]) == 0
    passes_its_test(folder / "mine")
    launches(folder / "mine")


@needs_cx
def test_project_of_checkout_agent_passes_its_test(folder, capsys):
    parameters = Path(str(CX_DIR)) / "cx_bringup" / "params" / "plugin_examples" / "fibonacci_action.yaml"
    arguments = [str(parameters), "--ros2cx", str(CX_DIR)]
    assert invoke(["new", "counter", "--from-ros2cx", *arguments]) == 0
    project = folder / "counter"
    assert files_in(project) == {
        *("README.md", "conftest.py", "test_agent.py"),
        *(".github/workflows/agent.yml", ".vscode/launch.json"),
    }
    readme = (project / "README.md").read_text()
    assert f"cxbridge check {' '.join(arguments)}\n" in readme
    assert "@" not in readme
    passes_its_test(project)
    launches(project)


@needs_cx
def test_project_test_fails_on_error_of_agent(folder):
    (folder / "agent.clp").write_text('(defrule wrong => (printout error "no door" crlf))')
    (folder / "agent.yaml").write_text(
        "clips_manager: {ros__parameters: {environments: [one], one: {plugins: [files]},"
        f' files: {{plugin: "cx::FileLoadPlugin", load: ["{folder}/agent.clp"]}}}}}}\n'
    )
    assert invoke(["new", "mine", "--from-ros2cx", "agent.yaml"]) == 0
    with pytest.raises(AssertionError, match="no door"):
        passes_its_test(folder / "mine")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--from-ros2cx", "nowhere"], "no parameters of clips_manager"),
        (["--from-ros2cx", "other.yaml"], "no parameters of clips_manager"),
        (["--from-ros2cx", "broken.yaml"], "broken.yaml:1"),
        (["--from-ros2cx", ".", "--from-fawkes", "test"], "cannot be combined"),
    ],
)
def test_invalid_arguments_make_no_project(arguments, message, folder, capsys, monkeypatch):
    monkeypatch.delenv("FAWKES_DIR", raising=False)
    (folder / "other.yaml").write_text("a: 1\n")
    (folder / "broken.yaml").write_text("clips_manager: {ros__parameters: {environments: [1, a]}}\n")
    assert invoke(["new", "x", *arguments]) == 2
    assert message in capsys.readouterr().err
    assert not (folder / "x").exists()
