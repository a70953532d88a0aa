"""A misspelt name is an error with the nearest name: for each command and each parameter with a name.

The parameters come from the commands: a new parameter needs a line here.
"""

from __future__ import annotations

import re
import shlex

import pytest

from cxbridge.cli.main import invoke
from tests.cli.test_help import COMMANDS
from tests.daemon.test_daemon import running
from tests.run.mini import write_scenario
from tests.support import ROOT, needs_all_plugins

pytestmark = needs_all_plugins

NO_NAMES = {
    "FILE", "DIR", "URL", "PORT", "[PORT]", "HOST", "ADDRESS", "N", "TEXT", "SECONDS|end", "OUT", "PATH", "A",
    "B...", "RUN", "[RUN]", "RUN...", "CONFIG", "OUT.html", "OUT.json", "FILE...", "DOMAIN", "PROBLEM",
    "PLAN", "(FACT)", "NUMBER...", "INDEX", "INDEX...", "KEY=VALUE", "K", "ACTION=CLASS",
    "virtual|real|scaled:N|ros2",
    "off|on",
}  # fmt: skip
"""Metavariables of places, numbers and texts; their errors have separate tests."""

NEW_NAMES = {
    ("new", "folder"), ("env create", "env"), ("keys", "name"),
    ("skill executor", "name"),
    ("explore", "out"),
}  # fmt: skip
"""Names that a user invents, or that may match no object."""

CASES = {
    # -- scenarios and recordings
    ("run", "scenario"): ("run tst-scenario", "test-scenario"),
    ("run", "spec"): ("run OWN --spec mimi", "it has: mini"),
    ("run", "agent"): ("run OWN --agent rob", "no agent 'rob'"),
    ("run", "skiller"): ("run OWN --skiller luaa", "lua, simulator, none"),
    ("run", "breaks"): ("run OWN --break rule:mini-begn", "did you mean mini-begin?"),
    ("explore", "properties"): ("explore OWN --property runs-end", "did you mean run-ends?"),
    ("mcp", "allow"): ("mcp OWN --allow exlore", "did you mean explore?"),
    ("mcp", "folders"): ("mcp nowhere", "there is no such folder"),
    ("new", "from_fawkes"): ("new OWN/x --from-fawkes tst", "--fawkes-dir"),
    ("check", "explain"): ("check --explain CX999", "there are: CX101"),
    ("coverage", "env"): ("coverage RECORDED --env executve", "did you mean executive?"),
    ("coverage", "spec"): ("coverage RECORDED --scenario OWN --spec mimi", "it has: mini"),
    ("coverage", "files"): ("coverage RECORDED --files mimi.clp", "no file with rules matches mimi.clp"),
    ("why", "words"): ("why mini-begn --run RECORDED", "did you mean mini-begin?"),
    ("why", "env"): ("why MINI --run RECORDED --env executve", "did you mean executive?"),
    ("why", "spec"): ("why MINI OWN --spec mimi", "it has: mini"),
    ("why", "core"): ("why MINI OWN --core builtn", "use one of: builtin"),
    ("why", "skiller"): ("why MINI OWN --skiller luaa", "use one of: lua"),
    ("plan", "strict"): ("plan OWN/d.pddl OWN/p.pddl --strict fawks", "write --strict fawkes"),
    ("plan", "planner"): ("plan OWN/d.pddl OWN/p.pddl --planner pyperpln", "pyperplan"),
    ("trace diff", "only"): ("trace diff RECORDED RECORDED --only goall", "use one of goal"),
    ("trace diff", "ignore"): ("trace diff RECORDED RECORDED --ignore goal:clas=X", "use one of"),
    ("trace cat", "kind"): ("trace cat RECORDED --kind gaol", "use one of log"),
    ("trace convert", "to"): ("trace convert RECORDED OWN/x --to cvs", "not one of mcap"),
    ("trace extract", "pattern"): ("trace extract RECORDED clps/* -o OWN/out", "no file in it matches"),
    ("trace replay", "patterns"): ("trace replay RECORDED -i Skillr* --connect BOARD", "none of its"),
    ("interface show", "type_or_file"): ("interface show Skilr", "did you mean Skiller"),
    ("interface hash", "names"): ("interface hash Skilr", "did you mean Skiller"),
    ("interface compile", "names"): ("interface compile Skilr -o OWN/out", "did you mean Skiller"),
    ("ros2 package", "names"): ("ros2 package Skilr -o OWN/out", "did you mean Skiller"),
    ("skill graph", "skill"): ("skill graph sya", "its skills are"),
    ("skill graph", "space"): ("skill graph say --space tst", "cannot load skill space 'tst'"),
    # -- a daemon
    ("daemon step", "unit"): ("daemon step ruel", "use one of: rule"),
    ("daemon component", "name"): ("daemon component executve", "executive"),
    ("daemon component", "transition"): ("daemon component executive fly", "use one of: configure"),
    ("daemon break add", "specs"): ("daemon break add rule:mini-begn", "did you mean mini-begin?"),
    ("env destroy", "env"): ("env destroy executve", "there are: executive"),
    ("env load", "env"): ("env load executve OWN/mini.clp", "there are: executive"),
    ("env feature", "env"): ("env feature executve config", "there are: executive"),
    ("env feature", "features"): ("env feature executive blakboard", "there are: blackboard"),
    ("env watch", "env"): ("env watch executve all", "there are: executive"),
    ("env watch", "item"): ("env watch executive ruels", "watch facts, rules or all"),
    ("env watch", "names"): ("env watch executive rules mini-begn", "did you mean mini-begin?"),
    ("env log", "env"): ("env log executve info", "there are: executive"),
    ("env log", "level"): ("env log executive inf", "use one of: debug"),
    ("env facts", "env"): ("env facts executve", "there are: executive"),
    ("env facts", "template"): ("env facts executive gaol", "did you mean goal?"),
    ("env agenda", "env"): ("env agenda executve", "there are: executive"),
    ("env eval", "env"): ("env eval executve (+ 1 2)", "there are: executive"),
    ("env eval", "expression"): ("env eval executive (goal-tre)", "goal-tre"),
    ("env assert", "env"): ("env assert executve (x)", "there are: executive"),
    ("env assert", "fact"): ("env assert executive '(goal (clas X))'", "did you mean class?"),
    ("env retract", "env"): ("env retract executve 1", "there are: executive"),
    ("env modify", "env"): ("env modify executve 1 a=1", "there are: executive"),
    ("env modify", "slots"): ("env modify executive GOAL mood=FINISHED", "did you mean mode?"),
    ("bb list", "glob"): ("bb list Skilr*", "did you mean SkillerInterface?"),
    ("bb show", "uid"): ("bb show SkillerInterface::Skilr", "did you mean SkillerInterface::Skiller?"),
    ("bb set", "uid"): ("bb set TestInterfac::x test_int=1", "did you mean TestInterface?"),
    ("bb set", "assignments"): ("bb set TestInterface::x tst_int=1", "test_int"),
    ("bb send", "uid"): ("bb send SkillerInterface::Skilr ExecSkill", "mean SkillerInterface::Skiller"),
    ("bb send", "message"): ("bb send SkillerInterface::Skiller ExecSkil", "ExecSkillMessage"),
    ("bb send", "assignments"): (
        "bb send SkillerInterface::Skiller ExecSkill skill_strin=x", "skill_string",
    ),
    ("skill exec", "skiller"): ("skill exec say{} --skiller Skilr", "no Skiller writes SkillerInterface"),
    ("skill graph", "skiller"): (
        "skill graph say --connect BOARD --skiller Skilr", "no Skiller writes",
    ),
}  # fmt: skip
"""By command and parameter: a line with a misspelt name, and a part of the error.

OWN is a scenario, RECORDED a recording of it, BOARD the address of its daemon, GOAL the index of a fact.
"""

WAITING = {
    ("bb watch", "globs"): "bb watch Skilr* --timeout 0.1 --count 1",
    ("bb hz", "globs"): "bb hz Skilr* --timeout 0.1 --count 9",
    ("skill monitor", "skiller"): "skill monitor --skiller Skilr --timeout 0.1 --count 2",
}
"""Commands that wait for a name report the missing name on stderr."""

ALIKE = {
    **{(command, "scenario"): ("run", "scenario") for command in ("check", "explore", "sweep", "game")},
    ("sweep", "against"): ("run", "scenario"),
    ("game", "against"): ("run", "scenario"),
    ("lsp", "scenario"): ("run", "scenario"),
    ("daemon start", "agent"): ("run", "agent"),
    ("daemon start", "spec"): ("run", "spec"),
    ("daemon start", "skiller"): ("run", "skiller"),
    **{
        (command, name): ("run", name)
        for command in ("check", "lsp", "explore", "sweep", "game")
        for name in ("spec", "agent")
    },
    ("lsp", "core"): ("check", "core"),
    ("check", "skiller"): ("run", "skiller"),
    ("gateway", "interface"): ("bb watch", "globs"),
    ("trace record", "patterns"): ("bb watch", "globs"),
}
"""Parameters that share code with those of another command."""

ELSEWHERE = {
    ("skill exec", "skill_string"): "the Skiller's own error: tests/cli/test_skill.py",
    ("skill executor", "target"): "tests/cli/test_skill_board.py",
    ("skill executor", "agent"): "a skill board takes any agent that comes",
    ("skill executor", "settings"): "tests/cli/test_skill_board.py",
    ("new", "from_ros2cx"): "plugins/cxbridge-ros2cx/tests/ros2cx_tests/test_projects.py",
    ("game", "simtest"): "plugins/cxbridge-rcll/tests/rcll_tests/test_team.py",
    ("ros2 terminal", "command"): "plugins/cxbridge-ros2/tests/ros2_tests/experts/test_terminal.py",
}


CHOICES = {
    (" ".join(path), parameter.name): parameter.metavar
    for path, command in COMMANDS.items()
    for parameter in command.params
    if parameter.opts[0].startswith("--")
    and (" ".join(path), parameter.name) not in {*CASES, *ALIKE}
    and re.fullmatch(r"[a-z]+(\|[a-z]+)+", parameter.metavar or "")
}
"""The options with metavariables."""


@pytest.fixture(name="own", scope="module")
def _own(tmp_path_factory):
    folder = write_scenario(tmp_path_factory.mktemp("misspelt") / "mini")
    (folder / "d.pddl").write_text("(define (domain d) (:predicates (p)) (:action a :effect (p)))")
    (folder / "p.pddl").write_text("(define (problem q) (:domain d) (:init) (:goal (p)))")
    return folder


@pytest.fixture(name="places", scope="module")
def _places(own, tmp_path_factory):
    recorded = own / "run.mcap"
    assert invoke(["run", str(own), "-q", "--trace", str(recorded), "--trace-level", "rules"]) == 0
    board = f"ipc://{tmp_path_factory.mktemp('b')}/bb"
    settings = (("fawkes/enable", False), ("zmq/endpoints", [board]))
    with running(config=own, settings=settings):
        yield {"OWN": str(own), "RECORDED": str(recorded), "BOARD": board}


@pytest.fixture(name="ask")
def _ask(places, monkeypatch, capsys):
    """Run a command; return exit status, stdout and stderr."""
    monkeypatch.setenv("CXBRIDGE_CONNECT", places["BOARD"])
    monkeypatch.delenv("FAWKES_DIR", raising=False)  # the default of an option

    def ask(line):
        words = shlex.split(line) if "'" in line else line.split(" ", line.split("(")[0].count(" "))
        for name, meant in places.items():
            words = [word.replace(name, meant) for word in words]
        capsys.readouterr()
        status = invoke(words)
        return status, *capsys.readouterr()

    return ask


def test_names_of_commands_have_cases():
    named = {
        (" ".join(path), parameter.name)
        for path, command in COMMANDS.items()
        for parameter in command.params
        if parameter.metavar not in {None, *NO_NAMES} and "float" not in parameter.type.name
    }
    known = {*CASES, *WAITING, *ALIKE, *ELSEWHERE, *NEW_NAMES}
    assert named - CHOICES.keys() - known == set()
    assert {*ALIKE.values()} <= {*CASES, *WAITING, *CHOICES}
    every = {
        (" ".join(path), parameter.name) for path, command in COMMANDS.items() for parameter in command.params
    }
    assert known - every == set()


@pytest.mark.parametrize("option", ["--spec mini", "--core builtin", "--skiller none", "--clips-dir OWN"])
@pytest.mark.parametrize("source", ["", " --run RECORDED"])
def test_option_without_effect_is_an_error(option, source, ask):
    status, _, error = ask(f"why MINI{source} {option}")
    assert (status, f"{option.split()[0]} needs a scenario" in error) == (2, True)


def test_spec_without_scenario_is_an_error(ask):
    assert ask("coverage RECORDED --spec mini")[0] == 2


@pytest.mark.parametrize("choice", CHOICES, ids=" ".join)
def test_misspelt_choice_is_an_error(choice, ask, monkeypatch):
    """The example of the help, with an unknown value."""
    monkeypatch.chdir(ROOT)
    (ROOT / "out").mkdir(exist_ok=True)  # where examples write
    command = COMMANDS[tuple(choice[0].split())]
    (example,) = re.findall(r"Example:\n  cxbridge (.+)", command.epilog or "")
    parameter = next(option for option in command.params if option.name == choice[1])
    status, _, error = ask(f"{example} {parameter.opts[0]} zebra")
    assert status == 2
    assert "zebra" in error
    assert CHOICES[choice].split("|")[0] in error


@pytest.mark.parametrize("case", CASES, ids=" ".join)
def test_misspelt_name_is_an_error(case, ask):
    line, said = CASES[case]
    assert line.startswith(case[0])
    if "GOAL" in line:
        _, out, _ = ask("env assert executive '(goal (id MISSPELT) (class X))'")
        line = line.replace("GOAL", re.findall(r"\d+", out)[0])
    status, out, error = ask(line)
    documented = 1 if case[0] == "trace extract" else 2
    assert (status, out) == (documented, "")
    assert said in error


@pytest.mark.parametrize("case", WAITING, ids=" ".join)
def test_waiting_command_reports_missing_name(case, ask):
    status, _, error = ask(WAITING[case])
    assert status == 3
    assert re.search(r"nothing matches \S+ yet \(did you mean SkillerInterface", error)
