"""Extras, the optional parts of an installation, and the commands that install them."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from cxbridge.errors import CxbridgeError

CORE: Final = "cxbridge"
"""The package of cxbridge itself; the names of the plug-ins of this repository start with its name."""

_DEV_EXTRA = "dev"  # the extra for work on cxbridge, which no command suggests to users
EXTRA_PURPOSES: Final[Mapping[str, str]] = {
    "test": "pytest, which the plug-in for tests needs; `make run` installs it",
    "planners": "planners of unified-planning, e.g. for durations, which the scenario `temporal` needs",
    "mongodb": "a robot memory on MongoDB, and files of mongodump",
    "packed": "recordings that another program has packed with zstd or lz4; cxbridge itself uses neither",
    "all": "all plug-ins of this repository, `planners` and `test`",
    _DEV_EXTRA: "everything that the tests and the manual need",
}
"""The purposes of the core's extras for docs/installing.md and `cxbridge doctor`."""
# The extra in the marker of a requirement: extra == "mongodb".
_EXTRA_MARKER = re.compile(r"""\bextra\s*==\s*["']([\w.-]+)["']""")
_PACKAGE_NAME = re.compile(r"[\w.-]+")
# The requirement of a plug-in of this repository, perhaps with an extra: cxbridge-web[foxglove].
_PLUGIN_REQUIREMENT = re.compile(rf"({CORE}-[\w-]+)(?:\[([\w-]+)\])?")


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
        specifier, _, marker = requirement.partition(";")
        extra = _EXTRA_MARKER.search(marker)
        if extra is not None and extra[1] != _DEV_EXTRA:
            by_extra.setdefault(extra[1], []).append(specifier.strip())
    return by_extra


def missing_requirements(extra: str, package: str = CORE) -> list[str]:
    """Return the requirements of an extra that are not installed."""
    return [
        requirement
        for requirement in requirements_by_extra(package).get(extra, ())
        if not _is_installed(requirement)
    ]


def install_command(extra: str, package: str = CORE) -> str:
    """Return the shell command that installs an extra, or a package without extras if ``extra`` is empty.

    cxbridge is on no package index: the command names the folders of a checkout, including those of the
    plug-ins that the extra needs. Without a checkout, it lists the packages of the extra.
    """
    if folders := _checkout_folders(package, extra):
        # pip keeps an editable installation only if the folder is named in the command
        return pip_command(*(word for folder in folders for word in ("-e", folder)))
    requirements = requirements_by_extra(package).get(extra)
    return pip_command(*requirements) if requirements else pip_command(_with_extra(package, extra))


def plugin_command(package: str) -> str:
    """Return the shell command that installs a plug-in."""
    return install_command("", package)


def pip_command(*arguments: str) -> str:
    """Return the shell command that installs packages into this Python.

    The pip on the PATH may belong to another Python.
    """
    return shlex.join([_shorten_path(Path(sys.executable)), "-m", "pip", "install", *arguments])


def _checkout_folders(package: str, extra: str) -> dict[str, None]:
    """Return the folders of a package and of the plug-ins that it needs, with extras, e.g. ``.[packed]``.

    The folders are the keys of a dict, which keeps each folder once, in order. Empty if the package is not in
    the checkout of this cxbridge.
    """
    import tomllib  # noqa: PLC0415 - seldom needed

    source_folder = _source_folder()
    project_file = (
        source_folder if package == CORE else source_folder / "plugins" / package
    ) / "pyproject.toml"
    if not project_file.is_file():
        return {}
    folders = {_with_extra(_shorten_path(project_file.parent), extra): None}
    # the plug-in may not be installed, and has no metadata then
    dependencies = tomllib.loads(project_file.read_text("utf-8"))["project"]["dependencies"]
    for requirement in (*dependencies, *requirements_by_extra(package).get(extra, ())):
        if plugin := _PLUGIN_REQUIREMENT.match(requirement):
            folders |= _checkout_folders(plugin[1], plugin[2] or "")
    return folders


def _source_folder() -> Path:
    """Return the folder of the sources of cxbridge: a checkout, or the argument of ``pip install``.

    Without sources, the folder has no ``pyproject.toml``.
    """
    import json  # noqa: PLC0415 - seldom needed
    from importlib import metadata  # noqa: PLC0415 - as above
    from urllib.parse import urlsplit  # noqa: PLC0415 - as above
    from urllib.request import url2pathname  # noqa: PLC0415 - as above

    folder = Path(__file__).resolve().parent.parent
    if (folder / "pyproject.toml").is_file():
        return folder
    origin = json.loads(metadata.distribution(CORE).read_text("direct_url.json") or "{}")
    return Path(url2pathname(urlsplit(origin.get("url", folder.as_uri())).path))


def _with_extra(package: str, extra: str) -> str:
    return f"{package}[{extra}]" if extra else package


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
            specifier, _, marker = requirement.partition(";")
            name, extra = _PACKAGE_NAME.match(specifier), _EXTRA_MARKER.search(marker)
            is_match = name is not None and _module_name(name[0]) == module.lower()
            if is_match and (extra is None or extra[1] != _DEV_EXTRA):
                hint = plugin_command(package) if extra is None else install_command(extra[1], package)
                return CxbridgeError(f"the package '{module}' is not installed", hint=hint)
    return None


def _cxbridge_packages() -> list[str]:
    """Return the names of the installed packages ``cxbridge`` and ``cxbridge-*``, in this order.

    cxbridge itself is missing if it is imported from its source tree without an installation.
    """
    from importlib import metadata  # noqa: PLC0415 - as above

    # an installation that was broken off has no name; the added hyphen lets CORE match, too
    return sorted({dist.name for dist in metadata.distributions() if f"{dist.name}-".startswith(f"{CORE}-")})


def _module_name(package: str) -> str:
    return package.replace("-", "_").lower()


def _is_installed(requirement: str) -> bool:
    """Return whether a package is installed in any version, and the extra of a plug-in, too."""
    from importlib import metadata  # noqa: PLC0415 - slow to import, and seldom needed

    name, plugin = _PACKAGE_NAME.match(requirement), _PLUGIN_REQUIREMENT.match(requirement)
    try:
        metadata.version(name[0] if name else requirement)
    except metadata.PackageNotFoundError:
        return False
    return plugin is None or not plugin[2] or not missing_requirements(plugin[2], plugin[1])


def _shorten_path(path: Path) -> str:
    """Return a path, relative to the working directory if the path is within that folder."""
    working_dir = Path.cwd()
    return str(path.relative_to(working_dir)) if path.is_relative_to(working_dir) else str(path)
