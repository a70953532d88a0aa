"""A look at a program executes no function of its CLIPS files, and no Python or Lua.

The program has a trap in each kind of construct with each kind of effect. A run shows that the traps work.
Then each command that only looks is called in a folder with further traps.
"""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path
from urllib.request import urlopen

import pytest
from clips._clips import ffi

from cxbridge.cli.main import invoke
from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from cxbridge.executive.host.capi import EXTRA_FUNCTIONS, encode
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.plugins import GROUP
from cxbridge_studio.check.stubbed_environment import ENDLESS, KEPT_FUNCTIONS, StubbedEnvironment
from tests.cli.test_help import COMMANDS
from tests.support import module_files, needs_all_plugins, short_path

pytestmark = needs_all_plugins

RECORDING = "run.mcap"
PROGRAM = Path(sys.executable).with_name("cxbridge")

CONSTRUCTS = {
    "defglobal": "(defglobal ?*g{n}* = {call})",
    "deftemplate-default": "(deftemplate t{n} (slot a (default {call})))",
    "deftemplate-default-dynamic": """(deftemplate u{n} (slot a (default-dynamic {call})))
        (defrule u{n} (executive-initialized) => (assert (u{n})))""",
    "deffunction": "(deffunction f{n} () {call}) (defglobal ?*h{n}* = (f{n}))",
    "defrule-salience": "(defrule s{n} (declare (salience (progn {call} 5))) =>)",
    "defrule-test": "(defrule r{n} (test (progn {call} TRUE)) =>)",
    "defrule-constraint": "(defrule p{n} (executive-initialized $?x&:(progn {call} TRUE)) =>)",
    "defrule-actions": "(defrule q{n} (executive-initialized) => {call})",
    "deffacts": "(deffacts d{n} (x {call}))",
    "defclass-default": "(defclass C{n} (is-a USER) (slot s (default {call})))",
    "definstances": "(defclass D{n} (is-a USER) (slot s)) (definstances i{n} (of D{n} (s {call})))",
    "defmethod-query": "(defmethod m{n} ((?x (progn {call} TRUE))) 1) (defglobal ?*i{n}* = (m{n} 1))",
    "defmethod": "(defmethod o{n} (?x) {call}) (defglobal ?*o{n}* = (o{n} 1))",
    "defmessage-handler": """(defclass K{n} (is-a USER) (role concrete))
        (defmessage-handler K{n} init after () {call}) (defglobal ?*k{n}* = (make-instance of K{n}))""",
}
"""The places of expressions in constructs."""

COMMANDS_OF_FILES = {"command": "{call}", "bind": "(bind ?x {call})"}
"""The places of expressions in batch files."""

DORMANT = {"deffacts", "definstances"}
"""Constructs that only a reset of the environment evaluates; runs of agents do not reset."""

EFFECTS = {
    "system": '(system "touch {mark}")',
    "open": '(open "{mark}" l{n} "w")',
    "with-open-file": '(with-open-file ("{mark}" l{n} "w") 1)',
    "rename": '(rename "to-rename-{n}" "{mark}")',
    "remove": '(remove "to-remove-{n}")',
    "save": '(save "{mark}")',
    "bsave": '(bsave "{mark}")',
    "save-facts": '(save-facts "{mark}")',
    "bsave-facts": '(bsave-facts "{mark}")',
    "save-instances": '(save-instances "{mark}")',
    "bsave-instances": '(bsave-instances "{mark}")',
    "dribble-on": '(dribble-on "{mark}")',
    "build": '(build "(defglobal ?*b{n}* = (system \\"touch {mark}\\"))")',
    "eval": '(eval "(system \\"touch {mark}\\")")',
    "funcall": '(funcall system "touch {mark}")',
    "load": '(load "to-load-{n}.clp")',
    "load*": '(load* "to-load-{n}.clp")',
    "batch*": '(batch* "to-load-{n}.clp")',
}

SCENARIO = """
clips-executive:
  spec: evil
  specs:
    evil:
      init:
        stage-1:
          - {name: protobuf, feature-request: true}
          - {name: robot_memory, feature-request: true}
        stage-3: [{name: agent, files: [FILES]}]
      action-mapping: {go: 'wave{}'}
clips-protobuf: {proto-dirs: [.]}
cxbridge: {robot-memory: {file: ran-memory.db}}
skiller: {skillspace: evil}
skill-board:
  agents:
    robot1: {executors: {arm: {class: "evilexec.py:Wave"}}}
"""
WORLD = "skills: [{skill: wave, hangs: 0.5}]\n"
PYTHON = """
open({mark!r}, "w").close()
from cxbridge.skiller.board.executor import SkillExecutor
class Wave(SkillExecutor):
    skills = ("wave",)
    def execute(self, call):
        yield 1.0
"""
LUA = 'module(..., skillenv.module_init)\nname = "evil"\nerror("ran-lua")\n'


def make_traps() -> Iterator[tuple[str, str, str, str]]:
    """Yield place, effect, name and text of each trap."""
    for place, template in (CONSTRUCTS | COMMANDS_OF_FILES).items():
        for effect, call in EFFECTS.items():
            name = f"{place}-{effect}".replace("*", "-star")
            filled = call.replace("{n}", name).replace("{mark}", f"ran-{name}")
            yield place, effect, name, template.replace("{n}", name).replace("{call}", filled)


def write_program(folder: Path) -> Path:
    """Write the hostile program."""
    (folder / "lua" / "skills").mkdir(parents=True)
    files = []
    # separate files, because CLIPS loses its place in a file that loads a file
    for place, _, name, text in make_traps():
        (folder / f"{name}.clp").write_text(f"{text}\n")
        files.append(f"{'BATCH|' if place in COMMANDS_OF_FILES else ''}{name}.clp")
    (folder / "scenario.yaml").write_text(SCENARIO.replace("FILES", ", ".join(files)))
    (folder / "world.yaml").write_text(WORLD)
    (folder / "evilexec.py").write_text(PYTHON.format(mark="ran-executor"))
    (folder / "lua" / "skills" / "evil.lua").write_text(LUA)
    return folder


def write_targets(folder: Path) -> Path:
    """Write the files that the effects change, and modules and a plug-in for Python in the current folder."""
    for _, _, name, _ in make_traps():
        (folder / f"to-rename-{name}").touch()
        (folder / f"to-remove-{name}").touch()
        (folder / f"to-load-{name}.clp").write_text(f'(defglobal ?*l{name}* = (system "touch ran-{name}"))\n')
    for module in (*list_foreign_modules(), "evilmodule"):
        (folder / f"{module}.py").write_text(PYTHON.format(mark=f"ran-module-{module}"))
    metadata = folder / "evil-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: evil\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(f"[{GROUP}]\nevil = evilmodule\n")
    return folder


@cache
def list_foreign_modules() -> list[str]:
    """Return the modules of foreign packages that cxbridge imports."""
    imports = re.compile(r"^ *(?:from|import) (\w+)", re.MULTILINE)
    found = {name for text in read_modules().values() for name in imports.findall(text)}
    return sorted(found & packages_distributions().keys() - {"cxbridge"})


@cache
def read_modules() -> dict[str, str]:
    """Return the texts of the modules of cxbridge by their paths in the package."""
    return {short_path(file): file.read_text() for file in module_files().values()}


def find_sprung_traps(folder: Path) -> set[str]:
    """Return the names of the traps that left a mark in a folder."""
    found = {file.name.removeprefix("ran-") for file in folder.rglob("ran-*")}
    removed = (name for _, effect, name, _ in make_traps() if effect == "remove")
    return found | {name for name in removed if not (folder / f"to-remove-{name}").exists()}


@pytest.fixture(name="program", scope="module")
def _program(tmp_path_factory) -> Path:
    return write_program(tmp_path_factory.mktemp("program"))


@pytest.fixture(name="run", scope="module")
def _run(program, tmp_path_factory) -> Path:
    """A folder in which the program has run, with the recording."""
    folder = write_targets(tmp_path_factory.mktemp("run"))
    command = [PROGRAM, "run", program, "--lenient", "--skiller", "simulator", "--timeout", "1"]
    trace = ["--trace", folder / RECORDING, "--trace-level", "facts"]
    subprocess.run([*map(str, [*command, *trace])], cwd=folder, capture_output=True, timeout=120, check=False)
    return folder


def test_traps_spring_in_run(run):
    found = find_sprung_traps(run)
    live_traps = {(place, effect) for place, effect, name, _ in make_traps() if name in found}
    assert {place for place, _ in live_traps} == (CONSTRUCTS | COMMANDS_OF_FILES).keys() - DORMANT
    assert {effect for _, effect in live_traps} == EFFECTS.keys()
    assert "executor" in found


LOOKS = {
    "check": [
        ["check", "PROGRAM", "--skill-dir", "PROGRAM/lua"],
        ["check", "PROGRAM/defglobal-system.clp"],
        ["check", "ALONE"],
    ],
    "coverage": [["coverage", "RUN"], ["coverage", "RUN", "--scenario", "PROGRAM", "--core"]],
    "format": [["format", "--check", "PROGRAM"]],
    "lsp": [],  # tested below
    "monitor": [],  # like view for a recording, and a client for a daemon
    "trace cat": [["trace", "cat", "RUN"]],
    "trace convert": [["trace", "convert", "RUN", "OUT/run.txt", "--to", "transitions"]],
    "trace diff": [["trace", "diff", "RUN", "RUN", "--level", "facts"]],
    "trace exchange": [["trace", "exchange", "RUN"]],
    "trace extract": [["trace", "extract", "RUN", "-o", "OUT/extracted"]],
    "trace info": [["trace", "info", "RUN"]],
    "trace repair": [["trace", "repair", "RUN", "-o", "OUT/repaired.mcap"]],
    "trace report": [["trace", "report", "RUN", "-o", "OUT/report.html"]],
    "trace rules": [["trace", "rules", "RUN"]],
    "trace transitions": [["trace", "transitions", "RUN"]],
    "view": [],  # tested below
    "why": [
        ["why", "rule", "qdefrule-actions-system", "--run", "RUN"],
        ["why", "rule", "rdefrule-test-system", "PROGRAM", "--run", "RUN"],
        ["why", "rule", "sdefrule-salience-open", "PROGRAM", "--run", "RUN"],
        ["why", "goal", "NONE", "PROGRAM", "--run", "RUN"],
    ],
}
"""The commands that look, with calls."""

NO_LOOKS = {
    "runs a program, or a part of one": (
        *("run", "daemon start", "explore", "sweep", "game", "dap", "plan", "gateway"),
        *("skill executor", "skill board", "trace record", "trace replay", "ros2 terminal"),
    ),
    "asks a daemon, or a blackboard": ("daemon", "env", "bb", "skill", "mcp"),
    "reads no program": ("new", "interface", "ros2 package", "doctor", "keys"),
}
"""The remaining commands, or their groups."""


def test_each_command_is_in_one_table():
    names_without_look = [words for names in NO_LOOKS.values() for words in names]
    for words in map(" ".join, COMMANDS):
        assert (words in LOOKS) is not any(
            f"{words} ".startswith(f"{name} ") for name in names_without_look
        ), words
    assert LOOKS.keys() <= set(map(" ".join, COMMANDS))


@pytest.fixture(name="trap_folder")
def _trap_folder(tmp_path) -> Path:
    """The folder with traps in which the looks are called."""
    (tmp_path / "trap_folder").mkdir()
    return write_targets(tmp_path / "trap_folder")


def write_single_file(folder: Path) -> Path:
    """Write a hostile file without a scenario; a template name of the core makes the file a program."""
    file = folder / "alone.clp"
    trap = '(deftemplate goal (slot x (default (system "touch ran-alone"))))'
    file.write_text(f"{trap}\n(defrule a (goal (x 1)) =>)\n")
    return file


def check_look(call, program, run, out, look):
    """Assert that a look springs no trap."""
    before = find_sprung_traps(program)
    words = list(call)
    for name, path in {
        "PROGRAM": program,
        "RUN": run / RECORDING,
        "OUT": out,
        "ALONE": write_single_file(out),
    }.items():
        words = [word.replace(name, str(path)) for word in words]
    output = look(words)
    assert "Traceback" not in output, (words, output)
    assert "ran-lua" not in output, words
    assert find_sprung_traps(Path.cwd()) == set(), words
    assert find_sprung_traps(program) == before, words


def test_look_springs_no_trap(program, run, trap_folder, tmp_path, monkeypatch, capsys):
    def look(words):
        invoke(words)
        return "".join(capsys.readouterr())

    monkeypatch.chdir(trap_folder)
    for call in (call for calls in LOOKS.values() for call in calls):
        check_look(call, program, run, tmp_path, look)


@pytest.mark.parametrize(
    ("starter", "name"),
    [([str(PROGRAM)], "why"), ([sys.executable, "-m", "cxbridge"], "coverage")],
    ids=["program", "-m"],
)
def test_look_imports_no_module_of_current_folder(
    program, run, trap_folder, tmp_path, monkeypatch, starter, name
):
    def look(words):
        process = subprocess.run([*starter, *words], capture_output=True, text=True, timeout=120, check=False)
        return process.stdout + process.stderr

    monkeypatch.chdir(trap_folder)
    check_look(LOOKS[name][-1], program, run, tmp_path, look)


def test_page_of_recording_springs_no_trap(run, trap_folder):
    with subprocess.Popen(
        [PROGRAM, "view", run / RECORDING], cwd=trap_folder, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        url = re.search(r"http://\S+", process.stderr.readline())
        assert url is not None
        with urlopen(url[0], timeout=60) as answer:
            assert answer.status == 200
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0
    assert find_sprung_traps(trap_folder) == set()


def test_editor_springs_no_trap(program, trap_folder):
    pytest.importorskip("pygls", reason="the extra 'lsp' (pygls) is not installed")
    editing = pytest.importorskip("studio_tests.lsp.conftest")
    shutil.copytree(program, trap_folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("*.db", "*.pyc"))
    file = "deffunction-system.clp"
    editor = editing.Editor(trap_folder)
    editor.open(file)
    editor.hover(file, "system")
    editor.complete(file, "(system")
    editor.save(file)
    # only the check of the whole agent has a finding about the configuration
    editor.wait_until(lambda: "CX113" in [code for code, _ in editor.list_codes("scenario.yaml")])
    editor.close()
    assert find_sprung_traps(trap_folder) == set()


# ---- the mechanism: the table of functions of CLIPS


@pytest.fixture(name="env")
def _env() -> Iterator[StubbedEnvironment]:
    env = StubbedEnvironment("look", EventBus(VirtualClock()))
    yield env
    env.destroy()


def get_address(env: ClipsEnvironment, function: str) -> int:
    """Return the address that CLIPS calls for a function."""
    return int(ffi.cast("intptr_t *", EXTRA_FUNCTIONS.FindFunction(env.c_env, encode(function)))[3])


def test_each_function_is_kept_or_a_stub(env):
    env.define("from-a-feature", lambda: pytest.fail("the function is called"), 0)
    plain = ClipsEnvironment("plain", EventBus(VirtualClock()))
    names = {str(name) for name in env.call("get-function-list")}
    assert {str(name) for name in plain.call("get-function-list")} <= names
    stub_addresses = {int(ffi.cast("intptr_t", stub)) for stub in env.stubs.values()}
    stubs = {function for function in names if get_address(env, function) in stub_addresses}
    plain.destroy()
    assert stubs == names - KEPT_FUNCTIONS.keys()
    assert "from-a-feature" in stubs
    assert EFFECTS.keys() - KEPT_FUNCTIONS.keys() <= stubs


@pytest.mark.parametrize(
    ("call", "value"),
    [
        ('(system "false")', 0),
        ("(time)", 0.0),
        ("(read)", 0),
        ("(assert (a))", "FALSE"),
        ("(facts)", None),
        ("(find-all-instances ((?x USER)) TRUE)", ()),
    ],
)
def test_stub_returns_value_of_its_type(env, call, value):
    assert env.eval(call) == value


@pytest.mark.parametrize(
    "text",
    [
        "(defglobal ?*x* = (while TRUE do (+ 1 1)))",
        "(defglobal ?*x* = (loop-for-count 1000000000 (+ 1 1)))",
        """(deffunction f (?n) (if (> ?n 0) then (f (- ?n 1)) (f (- ?n 1))) 1)
           (defglobal ?*x* = (f 50))""",
        "(deftemplate t (slot a (default (while TRUE do 1))))",
        "(defrule r (declare (salience (while TRUE do 1))) =>)",
    ],
)
def test_endless_evaluation_ends(env, tmp_path, text):
    file = tmp_path / "endless.clp"
    file.write_text(text)
    env.load(file)
    assert ENDLESS in {each.code for each in env.loader.diagnostics}


ENVIRONMENTS = {"cli/health.py": 1, "cxbridge_rcll/referee.py": 1}
"""The modules that make environments with all functions, for constructs of cxbridge or a game."""


def test_only_listed_modules_make_environments_with_all_functions():
    for name, text in read_modules().items():
        assert len(re.findall(r"\bClipsEnvironment\([^\s):]", text)) == ENVIRONMENTS.get(name, 0), name


# ---- processes


def test_only_listed_modules_start_python_processes():
    for name, text in read_modules().items():
        assert text.count("sys.executable") == STARTS.get(name, 0), name
        assert text.count("get_context(") == SPAWNS.get(name, 0), name


STARTS = {
    "spawning.py": 1,  # with -P
    "extras.py": 1,  # in a message only
}
"""The modules that name the program of Python."""

SPAWNS = {"cxbridge_explore/spawning.py": 1, "cxbridge_explore/determinism.py": 1}
"""The modules that start processes of multiprocessing; determinism forks."""
