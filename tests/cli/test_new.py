"""``cxbridge new``: the project runs, its test passes, and existing files are not overwritten."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from tests.docs.test_samples import PART, write
from tests.forked import IGNORED, nursery
from tests.support import FAWKES_DIR, ROOT, needs_fawkes, needs_plugin, share


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def files_in(folder: Path) -> set[str]:
    return {str(file.relative_to(folder)) for file in folder.rglob("*") if file.is_file()}


def passes_its_test(project: Path) -> None:
    options = ["-q", "-p", "cxbridge", "-p", "no:cacheprovider", "-W", IGNORED]
    environment = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    for name in ("FAWKES_DIR", "ROS2CX_DIR"):
        environment.pop(name, None)
    done = nursery().run(options, folder=project, program="pytest", environment=environment)
    assert done.returncode == 0, done.stdout.decode()


def launches(project: Path) -> None:
    """The launch file names a configuration of the debugger."""
    text = (project / ".vscode" / "launch.json").read_text()
    (launch,) = json.loads(text.replace("${workspaceFolder}", str(project)))["configurations"]
    assert (launch["type"], launch["request"], launch["name"]) == ("cxbridge", "launch", project.name)
    if find_spec("cxbridge_studio"):
        from cxbridge_studio.dap.launching import make_debugged_run

        make_debugged_run(launch)


@needs_plugin("planning")
@needs_plugin("studio")
def test_new_agent_runs_and_passes_tests_and_checks(folder, capsys):
    assert invoke(["new", "my-robot"]) == 0
    lines = capsys.readouterr().out.splitlines()
    project = folder / "my-robot"
    assert set(lines[:-1]) == {f"my-robot/{name}" for name in files_in(project)}
    assert files_in(project) == {
        "README.md",
        "conftest.py",
        "my-robot/scenario.yaml",
        "my-robot/domain.pddl",
        "my-robot/my-robot.clp",
        "test_my_robot.py",
        "golden/test_my_robot/test_the_cup_is_delivered.transitions",
        ".github/workflows/agent.yml",
        ".vscode/launch.json",
    }
    assert not [name for name in files_in(project) if "courier" in (project / name).read_text().lower()]
    assert invoke(["check", "my-robot/my-robot"]) == 0
    assert "no findings" in capsys.readouterr().out
    assert invoke(["run", "my-robot/my-robot", "--skiller", "simulator", "-q"]) == 0
    passes_its_test(project)
    launches(project)


@pytest.mark.parametrize("is_in_path", share([True, False], 1))
def test_pytest_without_cxbridge_prints_remedy(folder, monkeypatch, is_in_path):
    invoke(["new", "my-robot"])
    programs = str(Path(sys.executable).parent)
    monkeypatch.setenv("PATH", f"{programs}{os.pathsep}/usr/bin" if is_in_path else "/usr/bin")
    command = [sys.executable, "-m", "pytest", "-p", "no:cxbridge"]
    done = subprocess.run(command, cwd=folder / "my-robot", capture_output=True, text=True, check=False)
    assert done.returncode == pytest.ExitCode.USAGE_ERROR
    assert "these tests need cxbridge" in done.stderr
    python = f"{programs}/python" if is_in_path else "PYTHON-OF-CXBRIDGE"
    assert f"{python} -m pytest" in done.stderr
    assert "Traceback" not in done.stderr


def test_template_equals_tutorial(folder):
    invoke(["new", "courier"])
    created, expected = folder / "courier", folder / "expected"
    expected.mkdir()
    for part in PART.finditer((ROOT / "docs" / "tutorial-agent.md").read_text()):
        if part["file"]:
            write(part, expected)
    for name in files_in(expected):
        assert (created / name).read_text() == (expected / name).read_text(), name
    assert len(files_in(expected)) == 4


@needs_fawkes
@needs_plugin("studio")
def test_agent_of_fawkes_stays_in_place(folder, capsys):
    assert FAWKES_DIR is not None
    assert invoke(["new", "talker", "--from-fawkes", "test", "--fawkes-dir", str(FAWKES_DIR)]) == 0
    project = folder / "talker"
    assert files_in(project) == {
        *("README.md", "config.yaml", "conftest.py", "test_agent.py"),
        *(".github/workflows/agent.yml", ".vscode/launch.json"),
    }
    where = ["--fawkes-dir", str(FAWKES_DIR), "--config", "talker/config.yaml"]
    assert invoke(["run", *where, "-q"]) == 0
    capsys.readouterr()
    invoke(["check", *where, "--json"])
    assert not [finding for finding in json.loads(capsys.readouterr().out) if "talker" in finding["file"]]
    passes_its_test(project)
    launches(project)


@needs_fawkes
def test_unknown_spec_of_checkout_is_an_error(folder, capsys):
    assert invoke(["new", "talker", "--from-fawkes", "tset", "--fawkes-dir", str(FAWKES_DIR)]) == 2
    assert "no spec 'tset'" in capsys.readouterr().err
    assert not (folder / "talker").exists()


@pytest.mark.parametrize(
    "file", ["courier/README.md", "courier/courier/courier.clp", "courier/.vscode/launch.json"]
)
def test_existing_files_are_not_overwritten(file, folder, capsys):
    (folder / file).parent.mkdir(parents=True)
    (folder / file).write_text("mine")
    assert invoke(["new", "courier"]) == 2
    assert f"{file}: this file exists already" in capsys.readouterr().err
    assert files_in(folder) == {file}
    assert (folder / file).read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["a b"], "'a b' cannot be the name of an agent"),
        (["1st"], "'1st' cannot be the name of an agent\n  hint: begin with a letter"),
        (["yes"], "YAML does not read it as a string"),
        (["x", "--from-fawkes", "test"], "needs a checkout"),
        (["x", "--from-fawkes", "test", "--fawkes-dir", "nowhere"], "no such folder"),
    ],
)
def test_invalid_arguments_create_no_files(arguments, message, folder, capsys, monkeypatch):
    monkeypatch.delenv("FAWKES_DIR", raising=False)
    assert invoke(["new", *arguments]) == 2
    assert message in capsys.readouterr().err
    assert files_in(folder) == set()
