"""A checkout of the thesis' executive, ros2-clips-executive (2021), and the folders of its packages.

The executive finds its installed files through the index of ament, the build system of ROS 2. A checkout
without a build has the same files in its source folders.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from msgspec import Struct

from cxbridge.errors import CxbridgeError

# additions to cxbridge's own core for agents of the thesis' executive: skills of several agents, plans
ROS2CX_CLIPS = Path(__file__).parent / "clips"

# corrections of the checkout's core, which are loaded unless the mode is `original`
ROS2CX_SANE_CLIPS = ROS2CX_CLIPS / "sane"

# the commit that cxbridge was compared with: branch `idoychev/minor-fixes`, October 2021
KNOWN_COMMIT = "0abace1"

# the list of that commit's CLIPS and PDDL files: a line has the short digest of a file, then its path
_KNOWN_FILES = Path(__file__).parent / "known_files.txt"
_SHORT_DIGEST_DIGITS = 16  # hexadecimal digits of the short digests in that list: enough to notice a change

# folders of a checkout
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
        missing_packages = [
            package for folder, package in packages.items() if not (checkout.root / folder).is_dir()
        ]
        if missing_packages:
            raise CxbridgeError(
                f"this is not a checkout of ros2-clips-executive that cxbridge supports: "
                f"it lacks the CLIPS files or parameters of {', '.join(missing_packages)}",
                file=root,
                hint=f"name the top folder of the repository, at commit {KNOWN_COMMIT} "
                "(branch idoychev/minor-fixes); later versions are organised differently",
            )
        return checkout

    def find_changed_files(self) -> dict[str, list[str]]:
        """Return the CLIPS and PDDL files that are missing or differ from the files of the known commit.

        :returns: the files by package; the files of a shipped agent by ``PACKAGE/FOLDER``. The list of a
            package without changes is empty.
        """
        changed_files: dict[str, list[str]] = {}
        for line in _KNOWN_FILES.read_text(encoding="ascii").splitlines():
            digest, path = line.split()
            package, _, inner_path = path.partition("/")
            inner_path = inner_path.rpartition("/clips/")[2]
            folder, slash, _name = inner_path.partition("/")
            # the package of the core also contains the shipped agents, each in a folder
            is_agent = slash and folder.startswith("test-scenario")
            changed = changed_files.setdefault(f"{package}/{folder}" if is_agent else package, [])
            if compute_short_digest(self.root / path) != digest:
                changed.append(inner_path.removeprefix(f"{folder}/") if is_agent else inner_path)
        return changed_files

    @property
    def bringup_folder(self) -> Path:
        """The value of ``@CONFDIR@``: the share folder of the package cx_bringup."""
        return self.root / _BRINGUP

    @property
    def parameter_folder(self) -> Path:
        return self.root / _PARAMETERS

    @property
    def library_folder(self) -> Path:
        """The folder with utils.clp, time.clp, path.clp and ff-config.clp."""
        return self.root / _HOST_CLIPS

    @property
    def core_folder(self) -> Path:
        """The folder with the CX core and the shipped agents."""
        return self.root / _CORE_CLIPS


def compute_short_digest(file: Path) -> str:
    """Return the first digits of a text file's SHA-256; empty if the file is missing."""
    try:
        data = file.read_bytes()
    except OSError:
        return ""
    # Git on Windows writes CRLF at line ends
    return hashlib.sha256(data.replace(b"\r\n", b"\n")).hexdigest()[:_SHORT_DIGEST_DIGITS]
