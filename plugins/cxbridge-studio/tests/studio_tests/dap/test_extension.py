"""The extension of VS Code: the files that it names exist. Its grammar is tested by `make editor`."""

from __future__ import annotations

import json
import re

from cxbridge import __version__
from cxbridge.cli.discovery import top_level_rows
from cxbridge.run.options import RunOptions
from tests.support import ROOT

FOLDER = ROOT / "editors" / "vscode"
MANIFEST = json.loads((FOLDER / "package.json").read_text())
OF_ADAPTER = {"stopOnEntry", "stopInRules", "cwd"}


def test_its_version_and_licence_are_ours():
    assert MANIFEST["version"] == __version__
    assert MANIFEST["license"] == "GPL-2.0-or-later"


def test_the_files_that_it_names_are_there():
    contributes = MANIFEST["contributes"]
    named = [MANIFEST["main"]]
    named += [each["configuration"] for each in contributes["languages"]]
    named += [each["path"] for each in contributes["grammars"]]
    assert [name for name in named if not (FOLDER / name).is_file()] == []


def test_a_launch_configuration_has_options_of_run():
    (debugger,) = MANIFEST["contributes"]["debuggers"]
    properties = debugger["configurationAttributes"]["launch"]["properties"]
    names = properties.keys() - OF_ADAPTER
    snake = {re.sub("[A-Z]", lambda found: f"_{found[0].lower()}", name) for name in names}
    assert snake - RunOptions.__dataclass_fields__.keys() == set()
    page = (ROOT / "docs" / "editors.md").read_text()
    assert [name for name in OF_ADAPTER if f"`{name}`" not in page] == []


def test_it_starts_commands_that_there_are():
    program = (FOLDER / "extension.js").read_text()
    assert set(re.findall(r'\["(\w+)"\]', program)) == {"dap", "lsp"}
    assert "dap" in [row.name for row in top_level_rows()]
