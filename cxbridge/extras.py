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
EXTRA_PURPOSES: Final[Mapping[str, str]] = {
    "test": "pytest, which the plug-in for tests needs; `make run` installs it",
    "planners": "temporal and other planners by unified-planning; the scenario `temporal`",
    "mongodb": "a robot memory on MongoDB, and files of mongodump; a memory in this process needs no extra",
    "packed": "recordings that another program has packed with zstd or lz4; cxbridge itself uses neither",
    "all": "all plug-ins of this repository, `planners` and `test`",
    _DEVELOPERS: "everything that the tests and the manual need",
}
"""The purposes of the core's extras for docs/installing.md and `cxbridge doctor`."""
# The extra in the marker of a requirement: extra == "mongodb".
_EXTRA_MARKER = re.compile(r"""\bextra\s*==\s*["']([\w.-]+)["']""")
_PACKAGE_NAME = re.compile(r"[\w.-]+")
# An extra that requires an extra of a plug-in: cxbridge-explore[dask].
_PLUGIN_EXTRA = re.compile(rf"({CORE}-[\w-]+)\[([\w-]+)\]")
# The modules of packages whose module has another name.
_MODULE_BY_PACKAGE = {"eclipse-zenoh": "zenoh"}
_CHECKOUT = Path(__file__).resolve().parent.parent


def requirements_by_extra(package: str = CORE) -> Mapping[str, Sequence[str]]:
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
        extra = _EXTRA_MARKER.search(marker)
        if extra is not None and extra[1] != _DEVELOPERS:
            by_extra.setdefault(extra[1], []).append(name.strip())
    return by_extra


def missing_requirements(extra: str, package: str = CORE) -> list[str]:
    """Return the requirements of an extra that are not installed."""
    return [
        requirement
        for requirement in requirements_by_extra(package).get(extra, ())
        if not _is_installed(requirement)
    ]


def install_command(extra: str, package: str = CORE) -> str:
    """Return the shell command that installs an extra.

    cxbridge is on no package index, so a checkout is installed with the extra; otherwise the command lists
    the packages of the extra, because pip would not find cxbridge itself.
    """
    if folder := _checkout_folder(package):
        # pip keeps an editable installation only if the folder is named in the command
        return _pip_command("-e", f"{folder}[{extra}]")
    requirements = requirements_by_extra(package).get(extra)
    return _pip_command(*requirements) if requirements else _pip_command(f"{package}[{extra}]")


def plugin_command(package: str) -> str:
    """Return the shell command that installs a plug-in, from the checkout or the package index."""
    folder = _checkout_folder(package)
    return _pip_command("-e", folder) if folder else _pip_command(package)


def _checkout_folder(package: str) -> str:
    """Return the folder of a package in the checkout of this cxbridge; empty if there is none."""
    folder = _CHECKOUT if package == CORE else _CHECKOUT / "plugins" / package
    return _shorten_path(folder) if (folder / "pyproject.toml").is_file() else ""


def missing_package_error(error: ModuleNotFoundError) -> CxbridgeError | None:
    """Return the error for a missing package of cxbridge or a plug-in; None for other packages.

    :param error: the error of the failed import.
    """
    from importlib import metadata  # noqa: PLC0415 - as above

    module = (error.name or "").partition(".")[0]
    if module.startswith(f"{CORE}_"):
        hint = plugin_command(module.replace("_", "-"))
        return CxbridgeError(f"the package '{module}' is not installed", hint=hint)
    for package in _cxbridge_packages():
        for requirement in metadata.requires(package) or []:
            text, _, marker = requirement.partition(";")
            name, extra = _PACKAGE_NAME.match(text), _EXTRA_MARKER.search(marker)
            is_match = name is not None and module and _module_name(name[0]) == module.lower()
            if is_match and (extra is None or extra[1] != _DEVELOPERS):
                hint = plugin_command(package) if extra is None else install_command(extra[1], package)
                return CxbridgeError(f"the package '{module}' is not installed", hint=hint)
    return None


def _cxbridge_packages() -> list[str]:
    """Return cxbridge and the installed packages whose names start with its name."""
    from importlib import metadata  # noqa: PLC0415 - as above

    names = {package.name for package in metadata.distributions() if package.name}
    return [CORE, *sorted(name for name in names if name.startswith(f"{CORE}-"))]


def _module_name(package: str) -> str:
    return _MODULE_BY_PACKAGE.get(package, package.replace("-", "_").lower())


def _is_installed(requirement: str) -> bool:
    from importlib import metadata  # noqa: PLC0415 - slow to import, and seldom needed

    name, plugin_extra = _PACKAGE_NAME.match(requirement), _PLUGIN_EXTRA.match(requirement)
    try:
        metadata.version(name[0] if name else requirement)
    except metadata.PackageNotFoundError:
        return False
    return plugin_extra is None or not missing_requirements(plugin_extra[2], plugin_extra[1])


def _pip_command(*arguments: str) -> str:
    """Return a pip command of this Python, because the pip on the PATH may belong to another Python."""
    python = Path(sys.executable)
    return shlex.join([_shorten_path(python), "-m", "pip", "install", *arguments])


def _shorten_path(path: Path) -> str:
    """Return a path, relative to the working directory if that is shorter."""
    try:
        folder = Path.cwd()
    except OSError:  # the working directory was removed
        return str(path)
    if path == folder:
        return os.curdir
    return str(path.relative_to(folder)) if path.is_relative_to(folder) else str(path)
