"""The wheel and the sdist: contents, and the work of the wheel without a checkout."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile

import pytest

from cxbridge import __version__
from cxbridge.cli.health import _PACKAGES
from tests import alone
from tests.run.mini import AGENT, write_scenario
from tests.support import PLUGIN_NAMES, ROOT, share

SHARED = ("interfaces", "luaskills", "scenarios", "templates")
"""Folders beside the package that are in `share` of the installed package."""

UNIT = ROOT / "share" / "systemd" / "cxbridge.service"


def tracked():
    """The files of the tree, as git knows them."""
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("no git checkout: nobody knows which files belong to the tree")
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return {name for name in done.stdout.split("\0") if name and (ROOT / name).is_file()}


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The folder of the wheel and the sdist, made by the back end of the build without a network."""
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-d", str(folder)],
        cwd=ROOT,
        capture_output=True,
        check=True,
        timeout=120,
    )
    return folder


def test_wheel_holds_package_and_shipped_files(built):
    expected = {name for name in tracked() if name.startswith("cxbridge/")}
    expected |= {f"cxbridge/share/{name}" for name in tracked() if name.startswith(SHARED)}
    (wheel,) = built.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if ".dist-info/" not in name}
        extra = {name.partition(".dist-info/")[2] for name in archive.namelist()} - {""}
    assert names == expected
    assert extra == {"METADATA", "WHEEL", "RECORD", "entry_points.txt", "licenses/LICENSE"}


def test_sdist_holds_tree(built):
    (sdist,) = built.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    # PKG-INFO is the metadata; hatchling adds .gitignore, to build as in the checkout
    assert names - {"PKG-INFO", ".gitignore"} == tracked() - {".gitattributes", ".gitignore"}


def test_sdist_makes_same_wheel(built, tmp_path):
    """Byte by byte, in a different folder: packagers build the tested wheel."""
    (sdist,), (wheel,) = built.glob("*.tar.gz"), built.glob("*.whl")
    with tarfile.open(sdist) as archive:
        # Python before 3.11.4 has no filters
        archive.extraction_filter = getattr(tarfile, "data_filter", lambda member, _path: member)
        archive.extractall(tmp_path)
    (source,) = tmp_path.iterdir()
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path / "again")],
        cwd=source,
        capture_output=True,
        check=True,
        timeout=120,
    )
    assert (tmp_path / "again" / wheel.name).read_bytes() == wheel.read_bytes()


def test_wheel_works_without_checkout(built, tmp_path):
    """Unpacked, before the checkout on the path, in an empty folder."""
    (wheel,) = built.glob("*.whl")
    site = tmp_path / "site"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    # folders of these names in further packages
    for name in SHARED:
        (site / name).mkdir()
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "test_it.py").write_text(
        "import cxbridge\n"
        "def test_it(cx):\n"
        f"    assert cxbridge.__file__.startswith({str(site)!r})\n"
        "    run = cx.run('test-scenario')\n"
        "    run.to_end()\n"
    )
    commands = """
from cxbridge.cli.main import invoke
for command in (
    "run -q test-scenario --trace a.mcap",
    "interface show SkillerInterface",
    "trace report a.mcap -o a.html",
):
    assert invoke(command.split()) == 0, command
"""
    for command in (
        ["-c", commands],
        ["-m", "cxbridge", "doctor"],
        ["-m", "pytest", "-q", "-p", "cxbridge", "-p", "no:cacheprovider", "test_it.py"],
    ):
        done = subprocess.run(
            [sys.executable, *command],
            cwd=tmp_path / "here",
            env=os.environ | {"PYTHONPATH": str(site), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
            capture_output=True,
            text=True,
            check=False,
            timeout=120,
        )
        assert done.returncode == 0, (command, done.stdout, done.stderr)


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    """A function that builds the wheels of a distribution and its dependencies, and returns their folder."""
    folder = tmp_path_factory.mktemp("wheels")
    built: set[str] = set()

    def build(name):
        for distribution in alone.closure([name])[0] - built:
            alone.build_wheel(distribution, folder)
            built.add(distribution)
        return folder

    return build


SMOKE = {
    "cxbridge": "run -q test-scenario",
    "cxbridge-explore": "explore test-scenario --faults 0",
    "cxbridge-fawkes": "gateway --help",
    "cxbridge-mcp": "mcp --help",
    "cxbridge-planning": "plan --list",
    "cxbridge-protobuf": "run -q {protobuf}",
    "cxbridge-rcll": "game test-scenario --refbox-dir {here}",
    "cxbridge-robot-memory": "run -q two-agents",
    "cxbridge-ros2": "doctor",
    "cxbridge-ros2cx": "doctor",
    "cxbridge-studio": "check test-scenario",
    "cxbridge-web": "trace report a.mcap -o a.html",
}
"""A command of each distribution."""

STATUS = {"cxbridge-rcll": 2}
"""The exit status of a command that ends with another than 0: the folder is no referee box."""


@pytest.mark.parametrize("name", share(SMOKE, 2, row=lambda name: name == "cxbridge"))
def test_wheel_works_with_declared_dependencies(name, wheels, tmp_path):
    """In an environment with the wheel and its dependencies alone; cxbridge's with no plug-in."""
    python = alone.make_environment(tmp_path / "venv", name, wheels(name))
    agent = tmp_path / "s"
    write_scenario(agent, agent=AGENT, feature="protobuf")

    def call(command):
        environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        done = subprocess.run(
            [str(python), "-m", "cxbridge", *command.format(protobuf=agent, here=tmp_path).split()],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=120,
        )
        return done.returncode, done.stdout + done.stderr

    assert call("run -q test-scenario --trace a.mcap")[0] == 0
    status, said = call(SMOKE[name])
    assert status == STATUS.get(name, 0), said
    _, version = call("--version")
    installed = set(re.findall(r"cxbridge-[\w-]+", version))
    assert installed == alone.closure([name])[0] - {"cxbridge"}


def test_distributions_are_tested_and_in_readme():
    assert (
        sorted(SMOKE)
        == alone.distributions()
        == ["cxbridge", *(f"cxbridge-{plugin}" for plugin in PLUGIN_NAMES)]
    )
    rows = re.findall(r"^\| `(cxbridge[\w-]*)` \|", (ROOT / "README.md").read_text(), re.MULTILINE)
    assert sorted(rows) == alone.distributions()


def test_all_distributions_have_one_version():
    """The release of a tag builds them all."""
    projects = [
        tomllib.loads((alone.folder_of(name) / "pyproject.toml").read_text())["project"]
        for name in alone.distributions()
    ]
    assert {project["version"] for project in projects} == {__version__}
    ours = {line for project in projects for line in project["dependencies"] if line.startswith("cxbridge")}
    assert {line.partition("==")[2] for line in ours} == {__version__}


def test_doctor_checks_dependencies_of_wheel():
    """An earlier doctor missed mcap, which only the tests need, in a complete installation."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert set(_PACKAGES) == {line.partition(">")[0] for line in project["dependencies"]}


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd-analyze")
def test_systemd_accepts_unit(tmp_path):
    unit = tmp_path / UNIT.name
    unit.write_text(UNIT.read_text().replace("/opt/cxbridge/bin/cxbridge", f'"{sys.executable}"'))
    done = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", str(unit)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, [line for line in done.stderr.splitlines() if UNIT.name in line]) == (0, [])
