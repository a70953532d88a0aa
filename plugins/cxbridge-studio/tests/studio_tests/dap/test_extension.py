"""The manifest of the extension of VS Code. `make editor` tests the grammar."""

from __future__ import annotations

import json
import re

from cxbridge import __version__
from cxbridge.cli.discovery import top_level_rows
from cxbridge.run.options import RunOptions
from tests.support import ROOT

FOLDER = ROOT / "editors" / "vscode"
MANIFEST = json.loads((FOLDER / "package.json").read_text())
ADAPTER_OPTIONS = {"stopOnEntry", "stopInRules", "cwd"}


def test_version_and_licence_equal_those_of_cxbridge():
    assert MANIFEST["version"] == __version__
    assert MANIFEST["license"] == "GPL-2.0-or-later"


def test_named_files_exist():
    contributes = MANIFEST["contributes"]
    named = [MANIFEST["main"]]
    named += [each["configuration"] for each in contributes["languages"]]
    named += [each["path"] for each in contributes["grammars"]]
    assert [name for name in named if not (FOLDER / name).is_file()] == []


def test_launch_configuration_has_options_of_run():
    (debugger,) = MANIFEST["contributes"]["debuggers"]
    properties = debugger["configurationAttributes"]["launch"]["properties"]
    names = properties.keys() - ADAPTER_OPTIONS
    snake = {re.sub("[A-Z]", lambda match: f"_{match[0].lower()}", name) for name in names}
    assert snake - RunOptions.__dataclass_fields__.keys() == set()
    page = (ROOT / "docs" / "editors.md").read_text()
    assert [name for name in ADAPTER_OPTIONS if f"`{name}`" not in page] == []


def test_extension_starts_dap_and_lsp():
    program = (FOLDER / "extension.js").read_text()
    assert set(re.findall(r'\["(\w+)"\]', program)) == {"dap", "lsp"}
    assert "dap" in [row.name for row in top_level_rows()]
