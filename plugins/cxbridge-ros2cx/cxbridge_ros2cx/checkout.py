"""A checkout of ros2-clips-executive as of 2021: where its packages have their files.

The original finds files through ament's index, after an installation. A checkout that was never built has the
same files in its source folders.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from msgspec import Struct

from cxbridge.errors import CxbridgeError

ROS2CX_CLIPS = Path(__file__).parent / "clips"
"""What our own core has otherwise for agents of the executive for ROS 2: skills of several agents, plans."""

ROS2CX_SANE_CLIPS = ROS2CX_CLIPS / "sane"
"""The differences of the original's core, unless its defects are wanted."""

KNOWN_COMMIT = "0abace1"
"""The commit that everything was compared with: branch ``idoychev/minor-fixes``, October 2021."""

_KNOWN_FILES = Path(__file__).parent / "known_files.txt"
"""The CLIPS and PDDL files of that commit, with the beginnings of their SHA-256."""

_HOST_CLIPS = "cx_clips/src/cx_clips/clips"
_CORE_CLIPS = "cx_clips_executive/src/cx_clips_executive/clips"
_BRINGUP = "cx_bringup"
_PARAMETERS = f"{_BRINGUP}/params"


class Ros2CxCheckout(Struct, frozen=True):
    """The folders of a checkout.

    :param root: the folder that holds the packages.
    """

    root: Path

    @classmethod
    def open(cls, root: Path) -> Ros2CxCheckout:
        """Return the checkout in a folder.

        :raises CxbridgeError: when packages are missing, with the names of all of them.
        """
        checkout = cls(root.resolve())
        needed = {_HOST_CLIPS: "cx_clips", _CORE_CLIPS: "cx_clips_executive", _PARAMETERS: "cx_bringup"}
        missing = [package for folder, package in needed.items() if not (checkout.root / folder).is_dir()]
        if missing:
            raise CxbridgeError(
                f"this is not a checkout of ros2-clips-executive that cxbridge knows: "
                f"it lacks the CLIPS files or parameters of {', '.join(missing)}",
                file=root,
                hint=f"name the top folder of the repository, at commit {KNOWN_COMMIT} "
                "(branch idoychev/minor-fixes); later versions are organised differently",
            )
        return checkout

    @property
    def known_commit(self) -> str:
        """The commit that the checkout should be at."""
        return KNOWN_COMMIT

    def compare(self) -> dict[str, list[str]]:
        """Compare the CLIPS and PDDL files with those of the commit that is known.

        :returns: for each part (a package, or an agent's folder in it) the files that differ or are missing.
        """
        parts: dict[str, list[str]] = {}
        for line in _KNOWN_FILES.read_text(encoding="ascii").splitlines():
            digest, path = line.split()
            package, _, inner = path.partition("/")
            inner = inner.rpartition("/clips/")[2]
            folder, slash, _name = inner.partition("/")
            agent = slash and folder.startswith("test-scenario")
            others = parts.setdefault(f"{package}/{folder}" if agent else package, [])
            if digest_of(self.root / path) != digest:
                others.append(inner.removeprefix(f"{folder}/") if agent else inner)
        return parts

    @property
    def bringup(self) -> Path:
        """What ``@CONFDIR@`` stands for: the share folder of the package cx_bringup."""
        return self.root / _BRINGUP

    @property
    def parameters(self) -> Path:
        """The folder of the parameter files."""
        return self.root / _PARAMETERS

    @property
    def library(self) -> Path:
        """The folder of utils.clp, time.clp, path.clp and ff-config.clp."""
        return self.root / _HOST_CLIPS

    @property
    def core(self) -> Path:
        """The folder of the CX core and of the shipped agents."""
        return self.root / _CORE_CLIPS


def digest_of(file: Path) -> str:
    """Return the beginning of a text file's SHA-256, with any line ends; empty when it is missing."""
    try:
        data = file.read_bytes()
    except OSError:
        return ""
    return hashlib.sha256(data.replace(b"\r\n", b"\n")).hexdigest()[:16]
