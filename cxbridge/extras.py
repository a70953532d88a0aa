"""Extras, the optional parts of an installation, and the commands that install them."""

from __future__ import annotations

import os
import re
import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from cxbridge.errors import CxbridgeError

CORE: Final = "cxbridge"
_DEVELOPERS = "dev"  # the extra for work on cxbridge, which no command suggests to users
PURPOSES: Final[Mapping[str, str]] = {
    "test": "pytest, which the plug-in for tests needs; `make run` installs it",
    "planners": "temporal and other planners by unified-planning; the scenario `temporal`",
    "mongodb": "a robot memory on MongoDB, and files of mongodump; the one in this process needs nothing",
    "packed": "recordings that another program has packed with zstd or lz4; cxbridge writes none",
    "all": "all plug-ins of this repository, `planners` and `test`",
    _DEVELOPERS: "everything that the tests and the manual need",
}
"""The purposes of the core's extras for docs/installing.md and `cxbridge doctor`."""
# The extra in the marker of a requirement: extra == "mongodb".
_EXTRA = re.compile(r"""\bextra\s*==\s*["']([\w.-]+)["']""")
_NAME = re.compile(r"[\w.-]+")
# An extra that requires an extra of a plug-in: cxbridge-explore[dask].
_PLUGIN_EXTRA = re.compile(rf"({CORE}-[\w-]+)\[([\w-]+)\]")
# The modules of packages with other names.
_MODULES = {"eclipse-zenoh": "zenoh"}
_CHECKOUT = Path(__file__).resolve().parent.parent


def extras(package: str = CORE) -> Mapping[str, Sequence[str]]:
    """Return the requirements of each extra for users, e.g. ``{"mongodb": ["pymongo<5,>=4.9"]}``.

    Empty if the package is not installed, for example imported from its source tree.

    :param package: cxbridge, or the package of a plug-in.
    """
    from importlib import metadata  # noqa: PLC0415 - slow to import, and seldom needed

    by_extra: dict[str, list[str]] = {}
    try:
        requirements = metadata.requires(package) or []
    except metadata.PackageNotFoundError:
        return {}
    for requirement in requirements:
        name, _, marker = requirement.partition(";")
        extra = _EXTRA.search(marker)
        if extra is not None and extra[1] != _DEVELOPERS:
            by_extra.setdefault(extra[1], []).append(name.strip())
    return by_extra


def missing_requirements(extra: str, package: str = CORE) -> list[str]:
    """Return the requirements of an extra that are not installed."""
    return [requirement for requirement in extras(package).get(extra, ()) if not _installed(requirement)]


def install_command(extra: str, package: str = CORE) -> str:
    """Return the shell command that installs an extra.

    cxbridge is on no package index, so a checkout is installed with the extra; otherwise the command lists
    the packages of the extra, because pip would not find cxbridge itself.
    """
    if folder := _checkout_of(package):
        # pip keeps an editable installation only if the folder is named in the command
        return _pip("-e", f"{folder}[{extra}]")
    requirements = extras(package).get(extra)
    return _pip(*requirements) if requirements else _pip(f"{package}[{extra}]")


def plugin_command(package: str) -> str:
    """Return the shell command that installs a plug-in, from the checkout or the package index."""
    folder = _checkout_of(package)
    return _pip("-e", folder) if folder else _pip(package)


def _checkout_of(package: str) -> str:
    """Return the folder of a package in the checkout of this cxbridge; empty if there is none."""
    folder = _CHECKOUT if package == CORE else _CHECKOUT / "plugins" / package
    return _short(folder) if (folder / "pyproject.toml").is_file() else ""


def missing_package(error: ModuleNotFoundError) -> CxbridgeError | None:
    """Return the error for a missing package of cxbridge or a plug-in; None for other packages.

    :param error: the error of the failed import.
    """
    from importlib import metadata  # noqa: PLC0415 - as above

    module = (error.name or "").partition(".")[0]
    if module.startswith(f"{CORE}_"):
        hint = plugin_command(module.replace("_", "-"))
        return CxbridgeError(f"the package '{module}' is not there", hint=hint)
    for package in _packages():
        for requirement in metadata.requires(package) or []:
            text, _, marker = requirement.partition(";")
            name, extra = _NAME.match(text), _EXTRA.search(marker)
            is_match = name is not None and module and _module(name[0]) == module.lower()
            if is_match and (extra is None or extra[1] != _DEVELOPERS):
                hint = plugin_command(package) if extra is None else install_command(extra[1], package)
                return CxbridgeError(f"the package '{module}' is not there", hint=hint)
    return None


def _packages() -> list[str]:
    """Return cxbridge and the installed packages whose names start with its name."""
    from importlib import metadata  # noqa: PLC0415 - as above

    names = {package.name for package in metadata.distributions() if package.name}
    return [CORE, *sorted(name for name in names if name.startswith(f"{CORE}-"))]


def _module(package: str) -> str:
    return _MODULES.get(package, package.replace("-", "_").lower())


def _installed(requirement: str) -> bool:
    from importlib import metadata  # noqa: PLC0415 - slow to import, and seldom needed

    name, of_plugin = _NAME.match(requirement), _PLUGIN_EXTRA.match(requirement)
    try:
        metadata.version(name[0] if name else requirement)
    except metadata.PackageNotFoundError:
        return False
    return of_plugin is None or not missing_requirements(of_plugin[2], of_plugin[1])


def _pip(*arguments: str) -> str:
    """Return a pip command of this Python, because the pip on the PATH may belong to another one."""
    python = Path(sys.executable)
    return shlex.join([_short(python), "-m", "pip", "install", *arguments])


def _short(path: Path) -> str:
    """Return a path, relative to the working directory if that is shorter."""
    try:
        folder = Path.cwd()
    except OSError:  # the working directory was removed
        return str(path)
    if path == folder:
        return os.curdir
    return str(path.relative_to(folder)) if path.is_relative_to(folder) else str(path)
