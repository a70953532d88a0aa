"""Runs a distribution alone: its wheel and declared dependencies, in a separate environment.

``python -m tests.alone NAME [ARGUMENT...]`` passes the tests of a distribution in such an environment, e.g.
``python -m tests.alone cxbridge-protobuf -x``. The packages are links to those beside these tests: nothing is
fetched.
"""

from __future__ import annotations

import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path

from packaging.requirements import Requirement

from tests.support import ROOT

CORE = "cxbridge"
TOOLS = ("pytest", "pytest-xdist", "hypothesis", "jsonschema-rs", "mcap", "mongomock", "psutil")
"""The tools of the tests, if installed."""

PLANNERS = "cxbridge-planning"
TESTED_WITH_PLANNERS = ("cxbridge-explore", "cxbridge-ros2", "cxbridge-studio", "cxbridge-web")
"""The distributions whose tests run agents that plan. They do not import the planners' distribution."""

SOURCES = (CORE, "plugins", "tests", "conftest.py", "pyproject.toml")
"""The parts of the checkout without links: the sources, and copied parts."""

OF_THE_CHECKOUT = ("architecture", "dependencies", "extras", "long", "output_files", "packaging", "release")
"""The tests of the checkout as a whole, which has no sources here."""


def folder_of(name: str) -> Path:
    """Return the folder of a distribution of this repository."""
    return ROOT if name == CORE else ROOT / "plugins" / name


def distributions() -> list[str]:
    """Return the names of the distributions of this repository."""
    return [CORE, *sorted(file.parent.name for file in (ROOT / "plugins").glob("*/pyproject.toml"))]


def build_wheel(name: str, folder: Path) -> Path:
    """Build the wheel of a distribution of this repository."""
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=folder_of(name), capture_output=True, check=True, timeout=120)
    (wheel,) = folder.glob(f"{name.replace('-', '_')}-*.whl")
    return wheel


def declared(name: str) -> list[str]:
    """Return the requirements of a distribution of this repository."""
    project = tomllib.loads((folder_of(name) / "pyproject.toml").read_text())["project"]
    return list(project["dependencies"])


def closure(requirements: Iterable[str]) -> tuple[set[str], set[str]]:
    """Return the distributions of this repository and the other packages that requirements need."""
    ours: set[str] = set()
    others: set[str] = set()
    waiting = [(Requirement(text), "") for text in requirements]
    while waiting:
        requirement, extra = waiting.pop()
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": extra}):
            continue
        name = re.sub(r"[-_.]+", "-", requirement.name).lower()
        known = ours if name in distributions() else others
        if name in known and not requirement.extras:
            continue
        known.add(name)
        more = declared(name) if known is ours else importlib.metadata.requires(name) or []
        waiting += [
            (Requirement(text), needed_extra)
            for text in more
            for needed_extra in (requirement.extras or {""})
        ]
    return ours, others


def entries(package: str) -> Iterator[Path]:
    """Yield the files and folders in the folder of packages that belong to an installed package."""
    distribution = importlib.metadata.distribution(package)
    tops = {file.parts[0] for file in distribution.files or [] if file.parts[0] not in ("..", "__pycache__")}
    yield from (Path(str(distribution.locate_file(top))) for top in tops)


def make_environment(folder: Path, name: str, wheels: Path, tools: Iterable[str] = ()) -> Path:
    """Make an environment with the wheel of a distribution and its dependencies; return its Python.

    :param wheels: the folder with the wheels of this repository.
    :param tools: further packages of the environment.
    """
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True, timeout=60)
    (site,) = folder.glob("lib/python*/site-packages")
    ours, others = closure([name, *tools])
    for package in others:
        for entry in entries(package):
            if entry.exists() and not (site / entry.name).exists():
                (site / entry.name).symlink_to(entry)
    for distribution in ours:
        (wheel,) = wheels.glob(f"{distribution.replace('-', '_')}-*.whl")
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(site)
    write_scripts(folder / "bin", site)
    return folder / "bin" / "python"


def write_scripts(folder: Path, site: Path) -> None:
    """Write the programs of the packages of this repository that are in an environment."""
    for package in importlib.metadata.distributions(path=[str(site)]):
        if package.name in distributions():
            for script in package.entry_points.select(group="console_scripts"):
                file = folder / script.name
                file.write_text(
                    f"#!{folder / 'python'}\nfrom {script.module} import {script.attr}\n{script.attr}()\n"
                )
                file.chmod(0o755)


def lay_out(folder: Path, name: str) -> Path:
    """Copy the tests of a distribution without the sources; return the folder of its tests.

    Tests of a plug-in use the helpers of the core's tests, and of the tests of the plug-ins that it declares.
    """
    ours, _ = closure([name])
    shutil.copytree(ROOT / "tests", folder / "tests", ignore=shutil.ignore_patterns("__pycache__"))
    for file in ("conftest.py", "pyproject.toml"):
        shutil.copy(ROOT / file, folder / file)
    for entry in ROOT.iterdir():
        if entry.name not in SOURCES and not entry.name.startswith(".git"):
            (folder / entry.name).symlink_to(entry)
    for module in OF_THE_CHECKOUT:
        (folder / "tests" / f"test_{module}.py").unlink()
    for distribution in ours - {CORE}:
        here = folder / "plugins" / distribution
        shutil.copytree(
            folder_of(distribution) / "tests", here / "tests", ignore=shutil.ignore_patterns("__pycache__")
        )
        shutil.copy(folder_of(distribution) / "pyproject.toml", here)
    return folder / "tests" if name == CORE else folder / "plugins" / name / "tests"


def main(name: str, *arguments: str) -> int:
    """Pass the tests of a distribution alone; return pytest's exit status."""
    tools = [tool for tool in TOOLS if any(importlib.metadata.distributions(name=tool))]
    with tempfile.TemporaryDirectory(prefix="cxbridge-alone-") as root:
        folder = Path(root)
        (folder / "wheels").mkdir()
        if name in TESTED_WITH_PLANNERS:
            tools.append(PLANNERS)
        for distribution in closure([name, *tools])[0]:
            build_wheel(distribution, folder / "wheels")
        python = make_environment(folder / "venv", name, folder / "wheels", tools)
        here = folder / "checkout"
        here.mkdir()
        tests = lay_out(here, name)
        call = [str(python), "-m", "pytest", str(tests), *arguments]
        environment = {
            key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")
        }
        return subprocess.run(call, cwd=here, env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
