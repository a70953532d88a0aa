"""A command is a module in a folder: nothing else has to know of it."""

from __future__ import annotations

import pkgutil
import subprocess
import sys

import pytest

from cxbridge.cli import commands
from cxbridge.cli.main import invoke

GREET = '''
def greet(name: str) -> int:
    """Greet somebody."""
    print(f"Good morning, {name}.")
    return 7
'''


@pytest.fixture
def greet(tmp_path, monkeypatch):
    """A folder with one command in one file, as if it were one of ours; it is gone afterwards."""
    (tmp_path / "greet.py").write_text(GREET)
    monkeypatch.setattr(commands, "__path__", [*commands.__path__, str(tmp_path)])
    yield
    sys.modules.pop("cxbridge.cli.commands.greet", None)


def test_a_command_is_one_file(greet, capsys):
    assert invoke(["greet", "Robin"]) == 7
    assert capsys.readouterr().out == "Good morning, Robin.\n"
    assert invoke(["--help"]) == 0
    assert "Greet somebody." in capsys.readouterr().out


def test_a_command_without_its_file_is_gone(capsys):
    assert invoke(["greet", "Robin"]) == 2
    assert "No such command 'greet'" in capsys.readouterr().err


def test_the_help_lists_each_command_once():
    there = sorted(module.name.replace("_", "-") for module in pkgutil.iter_modules(commands.__path__))
    assert sorted(commands.HELP_ORDER) == there


def test_a_command_imports_no_other():
    program = (
        "import sys; from cxbridge.cli.main import invoke; invoke(['keys', '--help']); "
        "print(*(name for name in sys.modules if name.startswith('cxbridge.cli.commands.')))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "cxbridge.cli.commands.keys"
