"""Paths of checkouts and tools outside the repository, and marks that skip tests without them."""

from __future__ import annotations

import ast
import os
import random
import socket
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from functools import cache
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

import pytest

T = TypeVar("T")

ROOT = Path(__file__).resolve().parent.parent
"""The checkout."""


TEST_FOLDERS = tuple(map(str, sorted((ROOT / "plugins").glob("*/tests"))))
"""The folders with the tests of the plug-ins."""


@cache
def module_files() -> dict[str, Path]:
    """Return the modules of :data:`PACKAGES`: files by dotted names."""
    return {
        ".".join(file.relative_to(package.parent).with_suffix("").parts): file
        for package in PACKAGES
        for file in sorted(package.rglob("*.py"))
    }


def short_path(file: Path) -> str:
    """Return the path of a module below the package of cxbridge, or below the folder of its plug-in."""
    package = next(package for package in PACKAGES if file.is_relative_to(package))
    return file.relative_to(package if package.name == "cxbridge" else package.parent).as_posix()


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the statements within a node. Their expressions, most of a file, are left out: none imports."""
    for part in ("body", "handlers", "orelse", "finalbody", "cases"):
        for child in getattr(node, part, ()):
            yield child
            yield from statements(child)


def imported_packages(files: Iterable[Path]) -> set[str]:
    """Return the packages that modules import, for types or at run time."""
    found = set()
    for file in files:
        for node in statements(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module:
                found.add(node.module.partition(".")[0])
            elif isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
    return found


SHARED = ROOT.parent / "shared"
"""Facts and recordings of the real Fawkes; may be absent."""


def _checkout(variable: str) -> Path | None:
    """Return the folder that an environment variable names; None without."""
    return Path(os.environ[variable]) if os.environ.get(variable) else None


FAWKES_DIR = _checkout("FAWKES_DIR")
"""A Fawkes checkout, named by the environment variable FAWKES_DIR; may be absent."""
ROBOTINO_DIR = _checkout("ROBOTINO_DIR")
"""A checkout of the RCLL agent (fawkes-robotino), named by ROBOTINO_DIR; may be absent."""

PLUGIN_NAMES = (
    "explore",
    "fawkes",
    "mcp",
    "planning",
    "protobuf",
    "rcll",
    "robot-memory",
    "ros2",
    "ros2cx",
    "studio",
    "web",
)
"""The plug-ins of the repository."""


def _find_plugin(name: str) -> ModuleSpec | None:
    return find_spec(f"cxbridge_{name}".replace("-", "_"))


_FOUND = [find_spec("cxbridge"), *map(_find_plugin, PLUGIN_NAMES)]

PACKAGES = tuple(Path(spec.origin).parent for spec in _FOUND if spec is not None and spec.origin)
"""The packages of cxbridge and of the plug-ins of this repository that are installed, wherever these are."""

WHOLE = all(_FOUND)
"""Whether all plug-ins of the repository are installed."""


_PLUGIN_OF_FEATURE = {"- name: robot_memory": "robot-memory"}


def needs_plugin(name: str) -> pytest.MarkDecorator:
    """Mark a test that needs a plug-in of the repository, e.g. ``web``."""
    return pytest.mark.skipif(
        _find_plugin(name) is None, reason=f"needs cxbridge-{name}, which is not installed"
    )


def scenarios_of_installed_plugins() -> list[Path]:
    """Return the folders of the shipped scenarios, except those whose plug-ins are not installed."""
    files = sorted((ROOT / "scenarios").glob("*/scenario.yaml"))
    absent = [feature for feature, name in _PLUGIN_OF_FEATURE.items() if _find_plugin(name) is None]
    return [file.parent for file in files if not any(text in file.read_text() for text in absent)]


needs_pymongo = pytest.mark.skipif(find_spec("pymongo") is None, reason="needs pymongo (the extra mongodb)")
"""For tests of the robot memory on MongoDB, and of files of mongodump."""

needs_all_plugins = pytest.mark.skipif(not WHOLE, reason="a plug-in of the repository is not installed")
"""For tests that enumerate parts of all distributions: commands, pages, servers."""

needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="the recordings (../shared) are absent")
needs_robotino = pytest.mark.skipif(
    FAWKES_DIR is None or ROBOTINO_DIR is None,
    reason="FAWKES_DIR and ROBOTINO_DIR do not both name checkouts",
)
needs_fawkes = pytest.mark.skipif(FAWKES_DIR is None, reason="FAWKES_DIR names no Fawkes checkout")

ROS2CX_DIR = _checkout("ROS2CX_2021_DIR")
"""A checkout of ros2-clips-executive at commit 0abace1, named by ROS2CX_2021_DIR; may be absent."""

needs_ros2cx = pytest.mark.skipif(
    ROS2CX_DIR is None, reason="ROS2CX_2021_DIR names no checkout of ros2-clips-executive (2021)"
)

CX_DIR = _checkout("ROS2CX_DIR")
"""A checkout of carologistics/clips_executive at commit 90f440b1, named by ROS2CX_DIR; may be absent."""

CX_NEWER_DIR = _checkout("ROS2CX_PR33_DIR")
"""A checkout of pull request 33 of clips_executive (0589fb2c), named by ROS2CX_PR33_DIR; may be absent."""

needs_newer_cx = pytest.mark.skipif(
    CX_NEWER_DIR is None, reason="ROS2CX_PR33_DIR names no checkout of clips_executive's pull request 33"
)

needs_cx = pytest.mark.skipif(CX_DIR is None, reason="ROS2CX_DIR names no checkout of clips_executive")

FULL = bool(os.environ.get("FULL"))
"""Whether enumerations and proofs by many examples are whole (docs/evidence/proofs.md)."""

SEED = int(os.environ.setdefault("SEED", str(random.randrange(1_000_000))))
"""Draws the part of an enumeration that is tried without FULL, by default anew in each run.

The summary prints the seed. The environment holds the seed, so that all workers draw the same part.
"""

needs_full = pytest.mark.skipif(not FULL, reason="FULL=1 runs it")
"""For tests that repeat a test of every run with much effort."""


def share(cases: Iterable[T], usual: int, row: Callable[[Any], object] = lambda case: None) -> list[T]:
    """Return the cases that an enumeration tries: all with FULL, else a part that SEED draws.

    :param usual: the number of cases without FULL; there are more if there are more rows.
    :param row: returns the row of a case. At least one case of each row is drawn.
    """
    whole = list(cases)
    if FULL or usual >= len(whole):
        return whole
    drawn = random.Random(SEED).sample(range(len(whole)), len(whole))
    firsts = {row(whole[index]): index for index in reversed(drawn)}
    chosen = {*firsts.values()}
    for index in drawn:
        if len(chosen) >= usual:
            break
        chosen.add(index)
    return [whole[index] for index in sorted(chosen)]


def many(full: int, usual: int) -> int:
    """Number of examples of a proof: all with FULL in the environment, else the usual number."""
    return full if FULL else usual


_SLICE = 1_500
_WORKER = int("0" + os.environ.get("PYTEST_XDIST_WORKER", "").lstrip("gw")) % 8
_START = random.randrange(_SLICE)
_UNTRIED = (20_000 + _SLICE * _WORKER + (_START + step) % _SLICE for step in range(_SLICE))
"""Below the ports that the system hands out; each once, and none that another worker tries."""


def free_port(kind: int = socket.SOCK_STREAM) -> int:
    """A free port that no further test of this run uses."""
    for port in _UNTRIED:
        with socket.socket(socket.AF_INET, kind) as probe, suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port
    raise AssertionError("no port is left")
