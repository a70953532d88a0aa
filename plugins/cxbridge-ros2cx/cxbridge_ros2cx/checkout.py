"""A checkout of ros2-clips-executive as of 2021, and the folders of its packages.

The original finds files of an installation through ament's index. A checkout without a build has the same
files in its source folders.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from msgspec import Struct

from cxbridge.errors import CxbridgeError

# The additions to cxbridge's own core for agents of the ROS 2 executive: skills of several agents, plans.
ROS2CX_CLIPS = Path(__file__).parent / "clips"

# The changes to the original's core, loaded unless the mode is `original`.
ROS2CX_SANE_CLIPS = ROS2CX_CLIPS / "sane"

KNOWN_COMMIT = "0abace1"  # commit of all comparisons: branch `idoychev/minor-fixes`, October 2021

# The CLIPS and PDDL files of that commit, each with the start of its SHA-256.
_KNOWN_FILES = Path(__file__).parent / "known_files.txt"

_HOST_CLIPS = "cx_clips/src/cx_clips/clips"
_CORE_CLIPS = "cx_clips_executive/src/cx_clips_executive/clips"
_BRINGUP = "cx_bringup"
_PARAMETERS = f"{_BRINGUP}/params"


class Ros2CxCheckout(Struct, frozen=True):
    """The folders of a checkout.

    :param root: the folder with the packages.
    """

    root: Path

    @classmethod
    def open(cls, root: Path) -> Ros2CxCheckout:
        """Return the checkout in a folder.

        :raises CxbridgeError: if packages are missing; the error lists all of them.
        """
        checkout = cls(root.resolve())
        packages = {_HOST_CLIPS: "cx_clips", _CORE_CLIPS: "cx_clips_executive", _PARAMETERS: _BRINGUP}
        missing = [package for folder, package in packages.items() if not (checkout.root / folder).is_dir()]
        if missing:
            raise CxbridgeError(
                f"this is not a checkout of ros2-clips-executive that cxbridge knows: "
                f"it lacks the CLIPS files or parameters of {', '.join(missing)}",
                file=root,
                hint=f"name the top folder of the repository, at commit {KNOWN_COMMIT} "
                "(branch idoychev/minor-fixes); later versions are organised differently",
            )
        return checkout

    def compare(self) -> dict[str, list[str]]:
        """Compare the CLIPS and PDDL files with those of the known commit.

        :returns: the missing or different files of each package, or of each agent's folder in a package.
        """
        differences: dict[str, list[str]] = {}
        for line in _KNOWN_FILES.read_text(encoding="ascii").splitlines():
            digest, path = line.split()
            package, _, inner = path.partition("/")
            inner = inner.rpartition("/clips/")[2]
            folder, slash, _name = inner.partition("/")
            # the shipped agents are in folders of the core's package
            is_agent = slash and folder.startswith("test-scenario")
            files = differences.setdefault(f"{package}/{folder}" if is_agent else package, [])
            if digest_of(self.root / path) != digest:
                files.append(inner.removeprefix(f"{folder}/") if is_agent else inner)
        return differences

    @property
    def bringup(self) -> Path:
        """The value of ``@CONFDIR@``: the share folder of the package cx_bringup."""
        return self.root / _BRINGUP

    @property
    def parameters(self) -> Path:
        return self.root / _PARAMETERS

    @property
    def library(self) -> Path:
        """The folder with utils.clp, time.clp, path.clp and ff-config.clp."""
        return self.root / _HOST_CLIPS

    @property
    def core(self) -> Path:
        """The folder with the CX core and the shipped agents."""
        return self.root / _CORE_CLIPS


def digest_of(file: Path) -> str:
    """Return the start of a text file's SHA-256; empty if the file is missing."""
    try:
        data = file.read_bytes()
    except OSError:
        return ""
    # a checkout on Windows may have other line ends
    return hashlib.sha256(data.replace(b"\r\n", b"\n")).hexdigest()[:16]
