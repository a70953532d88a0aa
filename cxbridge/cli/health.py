"""The checks of `cxbridge doctor`."""

from __future__ import annotations

import importlib.metadata
import platform
import shutil
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from cxbridge.extras import (
    CORE,
    EXTRA_PURPOSES,
    install_command,
    missing_requirements,
    pip_command,
    requirements_by_extra,
)
from cxbridge.plugins import Plugin, installed_plugins
from cxbridge.resources import VERSION

# The dependencies in pyproject.toml; a test compares both lists.
_PACKAGES = (
    "clipspy",
    "lupa",
    "msgspec",
    "protobuf",
    "pyttsx3",
    "pyyaml",
    "pyzmq",
    "rich",
    "typer",
)

_OLDEST_PYTHON = (3, 11)

# The programs that --speech on needs on Linux, as arguments of _check_program; other systems include both.
_SOUND_PROGRAMS = (
    (
        "speech",
        ("espeak-ng", "espeak"),
        "--speech on makes no sound (off is the default)",
        "apt install espeak-ng",
    ),
    ("speaker", ("aplay",), "--speech on makes no sound", "apt install alsa-utils"),
)


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of one check.

    :param what: the name of the checked part; like ``fine`` a key of the JSON output.
    :param fine: whether the part works.
    :param required: whether a run of the shipped scenario needs the part.
    :param detail: for a part that works its version, place or proof; otherwise the reason for the failure.
    :param remedy: how to install the part: a command or a sentence; empty if unknown. Printed for failures.
    """

    what: str
    fine: bool
    required: bool
    detail: str
    remedy: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return the result as an object for JSON."""
        return asdict(self)

    def to_lines(self) -> list[str]:
        """Return the result as a line for people, and the remedy of a failure as a second line."""
        mark = "ok" if self.fine else ("MISSING" if self.required else "absent")
        remedies = [f"{'':8}  -> {self.remedy}"] if self.remedy and not self.fine else []
        return [f"{mark:8}{self.what}: {self.detail}", *remedies]


def run_checks() -> list[Finding]:
    """Run all checks; return the findings in the order of the output.

    The checks use CLIPS and Lua, because an installed library may still fail.
    """
    return [
        Finding("cxbridge", fine=True, required=True, detail=VERSION),
        Finding(
            "Python",
            fine=sys.version_info >= _OLDEST_PYTHON,
            required=True,
            detail=f"{platform.python_version()} on {platform.system()} {platform.machine()}",
            remedy="install Python 3.11 or newer",
        ),
        *(_check_package(name) for name in _PACKAGES),
        *(_check_extra(name) for name in requirements_by_extra()),
        *map(_check_plugin, plugins := installed_plugins()),
        *(
            _check_extra(name, package)
            # once for each package, which may have several plug-ins; without the version after the name
            for package in dict.fromkeys(plugin.package.partition(" ")[0] for plugin in plugins)
            for name in requirements_by_extra(package)
        ),
        _check_attempt("CLIPS", _try_clips, "install clipspy 1.0.6 or newer"),
        _check_attempt("Lua", _try_lua, "install lupa, which includes Lua 5.1"),
        _check_attempt("shipped files", _find_shipped_files, "install cxbridge again"),
        *(_check_program(*sound) for sound in _SOUND_PROGRAMS if platform.system() == "Linux"),
        _check_program("graphviz", ("dot",), "no pictures of state graphs", "apt install graphviz"),
    ]


def _check_package(name: str) -> Finding:
    try:
        return Finding(name, fine=True, required=True, detail=importlib.metadata.version(name))
    except importlib.metadata.PackageNotFoundError:
        return Finding(name, fine=False, required=True, detail="not installed", remedy=pip_command(name))


def _check_extra(name: str, package: str = CORE) -> Finding:
    absent_requirements = missing_requirements(name, package)
    purpose = f"{EXTRA_PURPOSES[name]}; " if package == CORE and name in EXTRA_PURPOSES else ""
    return Finding(
        f"extra {name}" if package == CORE else f"extra {name} of {package}",
        fine=not absent_requirements,
        required=False,
        detail=f"{purpose}not installed: {', '.join(absent_requirements)}"
        if absent_requirements
        else "installed",
        remedy=install_command(name, package),
    )


def _check_plugin(plugin: Plugin) -> Finding:
    error = plugin.error
    return Finding(
        f"plug-in {plugin.name}",
        fine=error is None,
        required=False,
        detail=plugin.package if error is None else error.message,
        remedy=(error.hint or "") if error is not None else "",
    )


def _check_attempt(name: str, attempt: Callable[[], str], remedy: str) -> Finding:
    """Return the finding of an attempt to use a part.

    :param attempt: returns the detail; raises any error if the part does not work.
    """
    try:
        return Finding(name, fine=True, required=True, detail=attempt())
    except Exception as error:  # noqa: BLE001 - any error is a finding for the user
        return Finding(name, fine=False, required=True, detail=f"does not work: {error}", remedy=remedy)


def _try_clips() -> str:
    from cxbridge.clock import VirtualClock
    from cxbridge.events import EventBus
    from cxbridge.executive.host.environment import ClipsEnvironment

    env = ClipsEnvironment("doctor", EventBus(VirtualClock()))
    try:
        env.build("(defrule once (initial) => (assert (answer 42)))")
        env.assert_string("(initial)")
        if env.run() != 1 or [slots["implied"] for _, _, slots in env.facts("answer")] != [(42,)]:
            raise RuntimeError("a rule did not fire as it should")
    finally:
        env.destroy()
    return "a rule fires"


def _try_lua() -> str:
    from lupa import lua51

    if lua51.LuaRuntime(encoding="latin-1").eval("6 * 7") != 42:  # noqa: PLR2004 - the product
        raise RuntimeError("Lua computes wrong results")
    return "Lua 5.1 runs"


def _find_shipped_files() -> str:
    from cxbridge.interfaces.registry import InterfaceRegistry
    from cxbridge.resources import shipped_dir

    names = InterfaceRegistry([shipped_dir("interfaces")]).names()
    scenarios = [path.parent.name for path in sorted(shipped_dir("scenarios").glob("*/scenario.yaml"))]
    shipped_dir("luaskills")
    return f"{len(names)} interfaces, scenarios {', '.join(scenarios)}"


def _check_program(name: str, programs: tuple[str, ...], consequence: str, remedy: str) -> Finding:
    """Return the finding of a search for programs, one of which is enough.

    :param consequence: the effect of missing programs, for the user.
    """
    path = next(filter(None, map(shutil.which, programs)), None)
    return Finding(
        name,
        fine=path is not None,
        required=False,
        detail=path or f"not installed: {consequence}",
        remedy=remedy,
    )
