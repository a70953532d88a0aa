"""``cxbridge new --from-ros2cx``: the new project passes its test; the agent stays in its folder."""

from __future__ import annotations

from pathlib import Path

import pytest

import cxbridge_ros2cx
from cxbridge.cli.main import invoke
from tests.cli.test_new import files_in, launches, passes_its_test
from tests.support import CX_DIR, needs_cx, share

OWN = Path(cxbridge_ros2cx.__file__).parent / "examples" / "params"
AGENTS = ("hello.yaml", "chat.yaml", "count.yaml")


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("agent", share(AGENTS, 1))
def test_an_agent_of_parameters_without_a_checkout(agent, here):
    assert invoke(["new", "mine", "--from-ros2cx", str(OWN / agent)]) == 0
    passes_its_test(here / "mine")
    launches(here / "mine")


@needs_cx
def test_an_agent_of_parameters_and_a_checkout(here, capsys):
    parameters = Path(str(CX_DIR)) / "cx_bringup" / "params" / "plugin_examples" / "fibonacci_action.yaml"
    where = [str(parameters), "--ros2cx", str(CX_DIR)]
    assert invoke(["new", "counter", "--from-ros2cx", *where]) == 0
    project = here / "counter"
    assert files_in(project) == {
        *("README.md", "conftest.py", "test_agent.py"),
        *(".github/workflows/agent.yml", ".vscode/launch.json"),
    }
    said = (project / "README.md").read_text()
    assert f"cxbridge check {' '.join(where)}\n" in said
    assert "@" not in said
    passes_its_test(project)
    launches(project)


@needs_cx
def test_the_test_of_a_project_fails_when_the_agent_reports_an_error(here):
    (here / "agent.clp").write_text('(defrule wrong => (printout error "no door" crlf))')
    (here / "agent.yaml").write_text(
        "clips_manager: {ros__parameters: {environments: [one], one: {plugins: [files]},"
        f' files: {{plugin: "cx::FileLoadPlugin", load: ["{here}/agent.clp"]}}}}}}\n'
    )
    assert invoke(["new", "mine", "--from-ros2cx", "agent.yaml"]) == 0
    with pytest.raises(AssertionError, match="no door"):
        passes_its_test(here / "mine")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--from-ros2cx", "nowhere"], "no parameters of clips_manager"),
        (["--from-ros2cx", "other.yaml"], "no parameters of clips_manager"),
        (["--from-ros2cx", "broken.yaml"], "broken.yaml:1"),
        (["--from-ros2cx", ".", "--from-fawkes", "test"], "cannot be combined"),
    ],
)
def test_a_mistake_makes_nothing(arguments, message, here, capsys, monkeypatch):
    monkeypatch.delenv("FAWKES_DIR", raising=False)
    (here / "other.yaml").write_text("a: 1\n")
    (here / "broken.yaml").write_text("clips_manager: {ros__parameters: {environments: [1, a]}}\n")
    assert invoke(["new", "x", *arguments]) == 2
    assert message in capsys.readouterr().err
    assert not (here / "x").exists()
