"""Optional parts of an installation ("extras" of the package) and the command that installs one."""

from __future__ import annotations

import os
import re
import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from cxbridge.errors import CxbridgeError

_DEVELOPERS = "dev"
PURPOSES: Final[Mapping[str, str]] = {
    "test": "pytest, which the plug-in for tests needs; `make run` installs it",
    "planners": "temporal and other planners by unified-planning; the scenario `temporal`",
    "monitor": "`cxbridge monitor`",
    "lsp": "`cxbridge lsp`, for editors",
    "protobuf": "the feature `protobuf` with .proto files and encrypted peers",
    "ros2": "skills that are actions and services of ROS 2, or go to PlanSys2 and come from it",
    "ros2-zenoh": "the same for robots with rmw_zenoh_cpp",
    "foxglove": "live connections to Foxglove",
    "dask": "`cxbridge sweep` on a cluster",
    "parquet": "rows of `cxbridge sweep` as Parquet",
    "zstd": "recordings that another program has packed with zstd; cxbridge writes none",
    _DEVELOPERS: "everything that the tests and the manual need",
}
"""What each extra is for, as docs/installing.md and `cxbridge doctor` say it."""
_EXTRA = re.compile(r"""\bextra\s*==\s*["']([\w.-]+)["']""")
_NAME = re.compile(r"[\w.-]+")
_MODULES = {"eclipse-zenoh": "zenoh"}
"""The modules of packages that have other names."""
_CHECKOUT = Path(__file__).resolve().parent.parent


def extras() -> Mapping[str, Sequence[str]]:
    """Return the requirements of each extra for users, e.g. ``{"monitor": ["textual<9,>=1"]}``.

    Empty where cxbridge is not installed but imported from its source tree.
    """
    from importlib import metadata  # noqa: PLC0415 - slow to import, and seldom needed

    found: dict[str, list[str]] = {}
    try:
        requirements = metadata.requires("cxbridge") or []
    except metadata.PackageNotFoundError:
        return {}
    for requirement in requirements:
        what, _, marker = requirement.partition(";")
        extra = _EXTRA.search(marker)
        if extra is not None and extra[1] != _DEVELOPERS:
            found.setdefault(extra[1], []).append(what.strip())
    return found


def missing(extra: str) -> list[str]:
    """Return the requirements of an extra whose packages are not installed."""
    return [requirement for requirement in extras().get(extra, ()) if not _installed(requirement)]


def install_command(extra: str) -> str:
    """Return the shell command that installs an extra.

    It works while cxbridge is on no package index: a checkout is installed with its extra; elsewhere
    the command names the packages of the extra.
    """
    if (_CHECKOUT / "pyproject.toml").is_file():
        # pip leaves an editable installation as it is only when it is named as one
        return _pip("-e", f"{_shown(_CHECKOUT)}[{extra}]")
    requirements = extras().get(extra)
    return _pip(*requirements) if requirements else _pip(f"cxbridge[{extra}]")


def plugin_command(package: str) -> str:
    """Return the shell command that installs a plug-in, from the checkout or from the package index."""
    folder = _CHECKOUT / "plugins" / package
    return _pip("-e", _shown(folder)) if folder.is_dir() else _pip(package)


def missing_package(error: ModuleNotFoundError) -> CxbridgeError | None:
    """Return the error for a user who lacks an extra; None when the module is of no extra.

    :param error: of the import.
    """
    module = (error.name or "").partition(".")[0]
    for extra, requirements in extras().items():
        for requirement in requirements:
            name = _NAME.match(requirement)
            if name is not None and module and _module(name[0]) == module.lower():
                return CxbridgeError(f"the package '{module}' is not there", hint=install_command(extra))
    return None


def _module(package: str) -> str:
    """Return the name of the module that a package has."""
    return _MODULES.get(package, package.replace("-", "_").lower())


def _installed(requirement: str) -> bool:
    from importlib import metadata  # noqa: PLC0415 - slow to import, and seldom needed

    name = _NAME.match(requirement)
    try:
        metadata.version(name[0] if name else requirement)
    except metadata.PackageNotFoundError:
        return False
    return True


def _pip(*arguments: str) -> str:
    """Return a call of the pip of this Python: the one on the PATH may be another's."""
    python = Path(sys.executable)
    return shlex.join([_shown(python), "-m", "pip", "install", *arguments])


def _shown(path: Path) -> str:
    """Return a path relative to the current folder where that is shorter."""
    try:
        folder = Path.cwd()
    except OSError:  # it was removed
        return str(path)
    if path == folder:
        return os.curdir
    return str(path.relative_to(folder)) if path.is_relative_to(folder) else str(path)
