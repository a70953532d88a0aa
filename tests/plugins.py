"""Installs plug-ins for a test: packages in a folder of sys.path, with entry points."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from cxbridge.plugins import GROUP
from tests.support import ROOT


def example(page: str = "plugins.md", name: str = "greeter") -> dict[str, str]:
    """Return the files of a plug-in on a page of the manual."""
    file = re.compile(rf"`{name}/(\w+\.py)`[^`]*?:\n\n```python\n(.*?)```", re.DOTALL)
    return dict(file.findall((ROOT / "docs" / page).read_text()))


def install(
    folder: Path, monkeypatch: pytest.MonkeyPatch, name: str, files: Mapping[str, str], entry: str = ""
) -> None:
    """Install a package with a plug-in of its name.

    :param files: the package's modules by file name; ``plugin.py`` has the tables.
    :param entry: the line of the entry point.
    """
    package = folder / name
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    for file, text in files.items():
        (package / file).write_text(text)
    information = folder / f"{name}-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    entry = entry or f"{name} = {name}.plugin"
    (information / "entry_points.txt").write_text(f"[{GROUP}]\n{entry}\n")
    monkeypatch.syspath_prepend(str(folder))
    for module in [module for module in sys.modules if module.partition(".")[0] == name]:
        monkeypatch.delitem(sys.modules, module)


def forget(name: str) -> None:
    """Remove the modules of a package that a test has installed."""
    for module in [module for module in sys.modules if module.partition(".")[0] == name]:
        del sys.modules[module]
