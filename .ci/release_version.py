"""Checks that a tag is the version of all distributions: ``python3 .ci/release_version.py v0.2.0``."""

import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def main(tag: str) -> int:
    """Return 0 if each pyproject.toml has the version of the tag, otherwise 1; print those that differ."""
    files = [ROOT / "pyproject.toml", *sorted(ROOT.glob("plugins/*/pyproject.toml"))]
    versions = {file: tomllib.loads(file.read_text())["project"]["version"] for file in files}
    differing = {file: version for file, version in versions.items() if f"v{version}" != tag}
    for file, version in differing.items():
        print(f"{file.relative_to(ROOT)}: version {version}, but the tag is {tag}", file=sys.stderr)
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
