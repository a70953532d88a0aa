"""A checkout of the thesis' executive, ros2-clips-executive (2021), and the folders of its packages.

The executive finds its installed files through the index of ament, the build system of ROS 2. A checkout
without a build has the same files in its source folders.
"""

from __future__ import annotations

from pathlib import Path

from msgspec import Struct

from cxbridge.errors import CxbridgeError

# corrections of the checkout's core, which are loaded unless the mode is `original`
ROS2CX_SANE_CLIPS = Path(__file__).parent / "clips" / "sane"

# the commit that cxbridge was compared with: branch `idoychev/minor-fixes`, October 2021
_KNOWN_COMMIT = "0abace1"

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
        package_by_folder = {
            _HOST_CLIPS: "cx_clips",
            _CORE_CLIPS: "cx_clips_executive",
            _PARAMETERS: _BRINGUP,
        }
        missing_packages = [
            package for folder, package in package_by_folder.items() if not (checkout.root / folder).is_dir()
        ]
        if missing_packages:
            raise CxbridgeError(
                f"this is not a checkout of ros2-clips-executive that cxbridge supports: "
                f"it lacks the CLIPS files or parameters of {', '.join(missing_packages)}",
                file=root,
                hint=f"name the top folder of the repository, at commit {_KNOWN_COMMIT} "
                "(branch idoychev/minor-fixes); later versions are organised differently",
            )
        return checkout

    @property
    def bringup_folder(self) -> Path:
        """The share folder of the package cx_bringup: the value of ``@CONFDIR@`` in parameter files."""
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
