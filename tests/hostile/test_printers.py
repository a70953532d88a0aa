"""Hostile text reaches no terminal as control sequence, and begins no line of a log: every printer.

The list of commands comes from the program: a command without a row here fails the test.
"""

from __future__ import annotations

import ast
import json
import os
import pty
import re
import select
import socket
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from msgspec.structs import replace

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.zmq import ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.daemon.systemd import SystemdNotifier
from cxbridge.events import (
    Event,
    EventBus,
    FactChange,
    GoalTransition,
    InterfaceMessage,
    InterfaceWrite,
    Level,
    LogLine,
    PlanActionTransition,
    PlannerCall,
    RuleFired,
    SkillStatus,
)
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface
from cxbridge.printing import UNSAFE_CODE_POINTS
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.formats.registry import open_run
from tests.cli.test_help import COMMANDS
from tests.daemon.test_daemon import QUIET, running
from tests.forked import Nursery, nursery
from tests.programs import Started
from tests.run.mini import AGENT, write_scenario
from tests.support import module_files, needs_all_plugins, share

pytestmark = needs_all_plugins

FORGED = "E 12:00:00.000000 Forged: a line of nobody"
ATTACKS = (
    "\x1b[31mred\x1b[0m",
    "\x1b]8;;http://example.invalid\x1b\\link\x1b]8;;\x07",
    "\x1b]52;c;SE9TVElMRQ==\x07",
    "\x9b31mC1\x9d0;title\x9c\x85next",
    f"cr\rlf\n{FORGED}\r\n{FORGED}",
    "bell\x07back\x08\x08\x7f",
    "\u202egnp.exe\u202c \u2066\u2069 \u2028\u2029",
    "[red]markup[/red] [link=http://example.invalid]x[/link]",
    "\udc9b31m \udcff \ud800",
)
HOSTILE = " ".join(ATTACKS)
SHORT = "\x1b]52;c;QQ==\x07\x9bm\n\r\u202e"
"""For names, which have 31 bytes."""
UNICODE = "".join(character for character in HOSTILE if not 0xD800 <= ord(character) < 0xE000)
MODES = ("FORMULATED", "SELECTED", "DISPATCHED", "FINISHED")
UNSAFE_TEXT = frozenset(map(chr, UNSAFE_CODE_POINTS))


def check(output: bytes, *, own_lines: bool = False) -> str:
    """Return the output of a command after the check.

    :param own_lines: whether the output is that of a program, line by line.
    """
    text = output.decode("utf-8", "surrogateescape")
    found = UNSAFE_TEXT & set(text)
    assert not found, (sorted(hex(ord(character)) for character in found), text[-2000:])
    assert own_lines or not [line for line in text.split("\n") if line.startswith("E 12:00")], text
    return text


@pytest.fixture(scope="module")
def cxbridge() -> Callable[..., str]:
    """Runs a command as a program."""
    return partial(run_checked, nursery())


def run_checked(forks: Nursery, *arguments: object) -> str:
    """Run a command; check both streams, and return them together."""
    done = forks.run([str(argument) for argument in arguments])
    out = check(done.stdout, own_lines=arguments[:2] == ("env", "eval"))
    errors = check(done.stderr)
    assert "Traceback" not in errors, errors
    if "--json" in arguments:
        for text in out.splitlines() if not out.startswith(("{\n", "[\n")) else [out]:
            json.loads(text)
    return out + errors


TICKET = {"board": SHORT, "epoch": 1, "master": 2}
EXCHANGE = (
    *(
        (f"SkillExecutorInterface::{HOSTILE}", "RequestMessage", 1, HOSTILE, "queued", TICKET | values)
        for values in (
            {
                "skill": HOSTILE,
                "parameters": json.dumps({HOSTILE: HOSTILE}),
                "agent": HOSTILE,
                "name": HOSTILE,
            },
            {"master": 3, "parameters": "[1]"},
            {"master": HOSTILE, "epoch": HOSTILE, "parameters": "[" * 100_000},
        )
    ),
    *(
        (f"SkillBoardInterface::{SHORT}", f"{kind}Message", 1, HOSTILE, "queued", TICKET | values)
        for kind in ("Response", "Feedback", "Finish")
        for values in (
            {"executor": HOSTILE, "text": HOSTILE, "outcome": HOSTILE, "error": HOSTILE, "progress": 0.5},
            {"executor": 1, "text": 1, "outcome": "SUCCEEDED", "progress": HOSTILE},
        )
    ),
)
"""Messages between masters and executors of a skill board."""


def events() -> list[Event]:
    """A run in which everything that can be hostile is."""
    h, now = HOSTILE, 1_000_000_000
    values = {"skill_string": h, "error": h, "status": "S_RUNNING", "msgid": 7, "exclusive_controller": h}
    fact = f'(goal (id g) (class C) (message "{h}") (error "{h}"))'
    return [
        *(GoalTransition(now, "executive", "g", h, h, "nil", mode, "FAILED", h) for mode in MODES),
        PlanActionTransition(now, "executive", h, "g", h, h, "WAITING"),
        SkillStatus(now, "executive", h, h, 7, "S_RUNNING"),
        PlanActionTransition(now, "executive", h, "g", h, h, "RUNNING"),
        SkillStatus(now, "executive", h, h, 7, "S_FAILED"),
        RuleFired(now, "executive", 1, h, h),
        FactChange(now, "executive", True, 1, "goal", fact),
        *(LogLine(now, level, h, h) for level in Level),
        InterfaceWrite(now, f"SkillerInterface::{h}", values),
        InterfaceMessage(now, f"SkillerInterface::{h}", h, 1, h, "queued", {"skill_string": h}),
        *(InterfaceMessage(now, *message) for message in EXCHANGE),
        PlannerCall(now, "executive", h, h, h, h, h, "failed", 1, 0, h, h),
        GoalTransition(now + 1, "executive", h, h, h, h, "FORMULATED", h, h),
    ]


def write(path: Path, run: list[Event]) -> Path:
    writer = McapWriter(path, files=False)
    writer.describe({"spec": HOSTILE, HOSTILE: HOSTILE})
    for event in run:
        writer.write(event)
    writer.close()
    return path


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Path | str]]:
    """Inputs of the commands: recordings with hostile names and content, and servers of them."""
    tmp = tmp_path_factory.mktemp("hostile")
    run = write(tmp / f"run{SHORT}.mcap", events())
    other = [*events()[:3], GoalTransition(2, "executive", "h", HOSTILE, "x", "nil", "SELECTED", "", "")]
    broken = tmp / f"broken{SHORT}.mcap"
    broken.write_bytes(run.read_bytes()[:-40])
    bblog = tmp / "bblog"
    bblog.mkdir()
    bus = EventBus(RealClock())
    local = LocalBlackBoard(InterfaceRegistry(), RealClock(), bus)
    url = f"ipc://{tmp}/bb"
    scenario = write_scenario(tmp / f"agent{SHORT}", agent="")
    (scenario / "mini.clp").write_bytes(os.fsencode(AGENT + HOSTILE_RULES.replace(HOSTILE, TEXT)))
    wrong = tmp / "wrong.yaml"
    wrong.write_text(json.dumps({"cxbridge": {"skiller": UNICODE}}))
    definition = tmp / f"Bad{SHORT}Interface.xml"
    definition.write_text("<interface name='Bad' author='&#x9b;x'><nonsense a='\u202e'/></interface>")
    endpoint = f"ipc://{tmp}/daemon"
    settings = (*QUIET, ("zmq/endpoints", [endpoint]), ("skiller", "lua"))
    with local.open_for_writing("SkillerInterface", f"S{SHORT}", owner=f"o{SHORT}") as opened:
        writer: Any = opened
        writer.skill_string = writer.error = TEXT
        writer.exclusive_controller = SHORT
        writer.status = SkillerInterface.SkillStatusEnum.S_FAILED
        writer.write()
        with ZmqBlackBoardServer(local, [url]), running(config=scenario, settings=settings):
            yield {
                "run": run,
                "other": write(tmp / "other.mcap", other),
                "broken": broken,
                "url": url,
                "daemon": endpoint,
                "tmp": tmp,
                "scenario": scenario,
                "wrong": wrong,
                "definition": definition,
                "uid": f"SkillerInterface::S{SHORT}",
                "text": TEXT,
            }
    local.shutdown()


HOSTILE_RULES = f"""
(defrule hostile-says
  (executive-initialized)
  =>
  (printout t "{HOSTILE}" crlf)
  (printout error "{HOSTILE}" crlf)
  (assert (hostile "{HOSTILE}")))
"""
TEXT = HOSTILE.replace(" \ud800", "")
"""The hostile text without the character that a command line cannot hold."""

BOARD = ("--connect", "{url}")
DAEMON = ("--connect", "{daemon}")
DRIVEN: dict[tuple[str, ...], list[tuple[str, ...]]] = {
    ("run",): [
        ("{scenario}", "--skiller", "simulator", "-v"),
        ("{scenario}", "--skiller", "simulator", "--json"),
        ("{scenario}", "--config", "{wrong}"),
        ("{text}",),
    ],
    ("new",): [
        ("{text}",),
        ("{tmp}/fresh",),
        ("{tmp}/x", "--from-fawkes", "{text}", "--fawkes-dir", "{tmp}"),
    ],
    ("explore",): [("{scenario}", "--faults", "0"), ("{scenario}", "--json"), ("{text}",)],
    ("sweep",): [("{scenario}", "--runs", "2"), ("{scenario}", "--runs", "1", "--json"), ("{text}",)],
    ("game",): [
        *(("{scenario}",), ("workshop", "--minutes", "0.2", "--json"), ("{text}",)),
        ("{text}", "--fawkes-dir", "{tmp}", "--refbox-dir", "{text}"),
    ],
    ("plan",): [("{text}", "{text}"), ("--list",)],
    ("check",): [("{scenario}",), ("{scenario}", "--json"), ("{text}",)],
    ("format",): [("{text}",), ("{definition}",)],
    ("lsp",): [],  # these three speak a protocol on stdout
    ("dap",): [],
    ("mcp",): [],
    ("view",): [("{text}",)],  # the command serves until Ctrl-C
    ("doctor",): [(), ("--json",)],
    ("gateway",): [("{text}", "{text}")],
    ("keys",): [("{text}", "-o", "{tmp}/{text}")],
    ("why",): [
        ("goal", "g", "--run", "{run}"),
        ("goal", "g", "--run", "{run}", "--json"),
        ("rule", "{text}", "--run", "{run}"),
        ("rule", "hostile-says", *DAEMON),
        ("{text}", *DAEMON),
    ],
    ("monitor",): [("{text}",)],
    ("coverage",): [("{run}",), ("{run}", "--json")],
    ("interface", "list"): [(), ("--interface-dir", "{text}")],
    ("interface", "show"): [("{text}",), ("SkillerInterface",)],
    ("interface", "check"): [("{definition}",), ("{definition}", "--json")],
    ("interface", "hash"): [("{text}",)],
    ("interface", "compile"): [("{definition}", "-o", "{tmp}/out")],
    ("ros2", "package"): [("SkillerInterface", "-o", "{tmp}/packages")],
    ("ros2", "terminal"): [("--domain", "213", "help")],
    ("trace", "diff"): [
        ("{run}", "{other}"),
        ("{run}", "{other}", "--order", "partial"),
        ("{run}", "{other}", "--json"),
        ("{run}", "{other}", "--level", "facts"),
        ("{run}", "{other}", "--only", "{text}"),
    ],
    ("trace", "extract"): [("{run}", "-o", "{tmp}/files")],
    ("trace", "record"): [("-i", "*", "-o", "{tmp}/rec{text}.mcap", "--duration", "0.2", *BOARD)],
    ("trace", "repair"): [("{broken}",), ("{broken}", "--json")],
    ("trace", "replay"): [("{run}", "-v", *BOARD)],
    ("trace", "report"): [("{run}", "-o", "{tmp}/report{text}.html")],
    ("trace", "transitions"): [("{run}",), ("{broken}",)],
    ("trace", "rules"): [("{run}",)],
    ("trace", "exchange"): [("{run}",), ("{run}", "--json"), ("{broken}",)],
    ("trace", "info"): [("{run}",), ("{run}", "--json")],
    ("trace", "cat"): [("{run}",), ("{run}", "--json"), ("{run}", "--match", "{text}")],
    ("trace", "convert"): [("{run}", "{tmp}/converted.csv", "--to", "csv"), ("{run}", "x", "--to", "{text}")],
    ("daemon", "start"): [("{wrong}",), ("{text}",)],
    ("daemon", "status"): [DAEMON, ("--json", *DAEMON), BOARD],
    ("daemon", "pause"): [BOARD],
    ("daemon", "resume"): [BOARD],
    ("daemon", "reset"): [BOARD],
    ("daemon", "shutdown"): [BOARD],
    ("daemon", "interrupt"): [BOARD],
    ("daemon", "component"): [DAEMON, ("--json", *DAEMON), ("{text}", "configure", *DAEMON)],
    ("daemon", "step"): [DAEMON],
    ("daemon", "break", "add"): [("rule:{text}", *DAEMON)],
    ("daemon", "break", "list"): [DAEMON, ("--json", *DAEMON)],
    ("daemon", "break", "remove"): [("{text}", *DAEMON)],
    ("env", "list"): [DAEMON, ("--json", *DAEMON)],
    ("env", "create"): [("{text}", *DAEMON)],
    ("env", "destroy"): [("{text}", *DAEMON)],
    ("env", "load"): [("executive", "{definition}", *DAEMON)],
    ("env", "feature"): [("executive", "{text}", *DAEMON)],
    ("env", "features"): [DAEMON, ("--json", *DAEMON)],
    ("env", "watch"): [("executive", "facts", "{text}", *DAEMON)],
    ("env", "log"): [("executive", "{text}", *DAEMON)],
    ("env", "facts"): [("executive", *DAEMON), ("executive", "--json", *DAEMON)],
    ("env", "agenda"): [("executive", *DAEMON), ("executive", "--json", *DAEMON)],
    ("env", "eval"): [
        ("executive", '(printout t "{text}" crlf)', *DAEMON),
        ("executive", '(str-cat "{text}")', "--json", *DAEMON),
    ],
    ("env", "assert"): [("executive", '(x "{text}")', *DAEMON), ("executive", "(x {text}", *DAEMON)],
    ("env", "retract"): [("executive", "{text}", *DAEMON)],
    ("env", "modify"): [("executive", "1", "a={text}", *DAEMON)],
    ("bb", "list"): [BOARD, ("--json", *BOARD)],
    ("bb", "show"): [("{uid}", *BOARD), ("{uid}", "--json", *BOARD), ("{text}", *BOARD)],
    ("bb", "watch"): [
        ("*", "--timeout", "0.2", *BOARD),
        ("*", "--timeout", "0.2", "--json", *BOARD),
    ],
    ("bb", "set"): [("{uid}", "error={text}", *BOARD)],
    ("bb", "hz"): [("*", "--timeout", "0.2", *BOARD), ("{text}", "--timeout", "0.2", *BOARD)],
    ("bb", "send"): [("{uid}", "{text}", *BOARD)],
    ("skill", "exec"): [
        ("{text}", "--timeout", "1", *DAEMON),
        ("{text}", "--timeout", "1", "--json", *DAEMON),
        ("x", "--skiller", "S{text}", *BOARD),
    ],
    ("skill", "list"): [BOARD, ("--json", *BOARD), DAEMON],
    ("skill", "executor"): [("{text}", "--agent", "{text}", *BOARD)],
    ("skill", "board"): [BOARD, ("--json", *BOARD)],
    ("skill", "monitor"): [
        ("--skiller", "S" + SHORT, "--count", "1", *BOARD),
        ("--skiller", "S" + SHORT, "--count", "1", "--json", *BOARD),
    ],
    ("skill", "graph"): [("{text}",), ("{text}", *DAEMON), ("say",)],
}
"""How each command is driven; names in braces are of the fixture ``place``."""


def test_every_command_is_driven_with_existing_options() -> None:
    assert COMMANDS.keys() == DRIVEN.keys()
    for words, rows in DRIVEN.items():
        options = {
            name for option in COMMANDS[words].params for name in (*option.opts, *option.secondary_opts)
        }
        driven = {word.partition("=")[0] for row in rows for word in row if word.startswith("--")}
        assert driven <= options, words


@pytest.mark.parametrize("words", share(DRIVEN, 14), ids=" ".join)
def test_commands_print_no_escape_sequences(
    words: tuple[str, ...], place: dict[str, Path | str], cxbridge: Callable[..., str]
) -> None:
    for arguments in DRIVEN[words]:
        filled = (re.sub(r"\{(\w+)\}", lambda name: str(place[name[1]]), argument) for argument in arguments)
        cxbridge(*words, *filled)


def test_modules_print_through_console_only() -> None:
    """`print` and its like are in cli/console.py; modules that write to a terminal are listed."""
    for file in module_files().values():
        if file.name in {"console.py", "printing.py"}:
            continue
        if not PRINTS.search(text := file.read_text()):
            continue
        for node in ast.walk(ast.parse(text)):
            if not isinstance(node, ast.Call) or not last_name(node.func).endswith(LAST_NAMES):
                continue
            called = ast.unparse(node.func)
            assert called not in {"print", "typer.echo", "click.echo", "typer.secho"}, (file, node.lineno)
            assert called not in {"sys.stdout.write", "sys.stderr.write"}, (file, node.lineno)
            assert not called.endswith("Console") or "unfiltered_stream" in ast.unparse(node), (
                file,
                node.lineno,
            )


PRINTS = re.compile(r"\b(?:print|echo|secho|stdout|stderr)\b|Console\b")
"""Words of a file that prints. Files without them need not be parsed."""
LAST_NAMES = ("print", "echo", "secho", "write", "Console")


def last_name(called: ast.expr) -> str:
    match called:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
    return ""


def on_a_terminal(*arguments: object, keys: bytes = b"", seconds: float = 20, until: bytes = b"") -> bytes:
    """Run a command on a separate terminal until it prints a text, or ends; return the output."""
    terminal, its = pty.openpty()
    environment = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "200", "LINES": "60"}
    process = Started(*arguments, terminal=its, environment=environment)
    os.close(its)
    output, deadline = b"", time.monotonic() + seconds
    try:
        while time.monotonic() < deadline and not (until and until in output):
            if select.select([terminal], [], [], 0.1)[0]:
                try:
                    output += os.read(terminal, 65536)
                except OSError:  # the command has ended
                    break
            if keys and len(output) > 1000:
                os.write(terminal, keys)
                keys = b""
    finally:
        process.kill()
        process.wait()
        os.close(terminal)
    return output


SIGNS = (b"\x1b]52", b"\x1b]8;", b"\x1b[31mred", b"\x1b]0;", "\x9b".encode(), "\u202e".encode(), b"\x07back")
"""Sequences in our text; the drawing of a screen uses different sequences."""


@pytest.mark.parametrize(
    ("arguments", "until"),
    [
        (("monitor", "{run}"), b"red"),
        (("skill", "monitor", "--skiller", f"S{SHORT}", *BOARD), b"control:"),
        (("skill", "exec", "{text}", "--timeout", "2", *DAEMON), b""),
        (("trace", "replay", "{run}", *BOARD), b""),
        (("run", "{scenario}", "--skiller", "simulator", "-v"), b""),
        (("daemon", "start", "{wrong}"), b""),
    ],
    ids=lambda value: " ".join(value[:2]) if isinstance(value, tuple) else "",
)
def test_screens_print_no_escape_sequences(
    arguments: tuple[str, ...], until: bytes, place: dict[str, Path | str]
) -> None:
    filled = [re.sub(r"\{(\w+)\}", lambda name: str(place[name[1]]), argument) for argument in arguments]
    output = on_a_terminal(*filled, until=until)
    assert output
    if until:
        assert until in output
    assert not [sign for sign in SIGNS if sign in output], output[-3000:]


@pytest.mark.parametrize("to", ["fawkes-log", "transitions"])
def test_text_recordings_have_one_entry_per_line(
    to: str, tmp_path: Path, cxbridge: Callable[..., str]
) -> None:
    h = " ".join(ATTACKS[:-1])
    whole = [
        GoalTransition(1, "executive", "g", "C", "s", "nil", "FINISHED", "FAILED", h),
        SkillStatus(2, "executive", "S", h, 7, "S_RUNNING"),
        LogLine(3, Level.WARN, "c", h),
        FactChange(4, "executive", True, 1, "x", f'(x (a 1) (message "{h}"))'),
        LogLine(5, Level.ERROR, "c", "\\u000a \\u001b \\u00e9 \\"),
    ]
    path, source = tmp_path / "run.txt", write(tmp_path / "run.mcap", whole)
    cxbridge("trace", "convert", source, path, "--to", to)
    check(path.read_bytes())
    kinds = (GoalTransition, SkillStatus) if to == "transitions" else (LogLine, FactChange)
    again = [replace(event, time_us=0) for event in open_run(path)]
    assert again == [replace(event, time_us=0) for event in whole if isinstance(event, kinds)]


def test_reports_of_comparison_hold_no_escape_sequences(
    place: dict[str, Path | str], tmp_path: Path, cxbridge: Callable[..., str]
) -> None:
    junit, page = tmp_path / "junit.xml", tmp_path / "page.html"
    cxbridge("trace", "diff", place["run"], place["other"], "--junit", junit, "--html", page)
    check(junit.read_bytes())
    check(page.read_bytes(), own_lines=True)  # a line break becomes a blank
    ET.parse(junit)


def test_notification_of_systemd_has_one_status(tmp_path: Path) -> None:
    receiver = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    with receiver:
        receiver.bind(str(tmp_path / "notify"))
        SystemdNotifier(str(tmp_path / "notify")).report_ready(f"serving\nMAINPID=1\n{TEXT}")
        notification = check(receiver.recv(65536))
    assert [line.partition("=")[0] for line in notification.splitlines()] == ["READY", "STATUS"]


def test_fawkes_viewers_get_no_escape_sequences() -> None:
    sent: list[bytes] = []

    class Viewer:
        def send(self, frame: bytes) -> None:
            sent.append(frame)

    from cxbridge_fawkes.network.components.logger import NetworkLogger

    bus = EventBus(RealClock())
    logger = NetworkLogger(bus)
    logger._set_subscribers(frozenset({Viewer()}))  # type: ignore[arg-type]
    bus.logger("peer" + SHORT).error(TEXT)
    (frame,) = sent
    text = frame.decode("utf-8", "replace")
    assert not {"\x1b", "\x9b", "\r", "\u202e", "\x07\x1b"} & set(text[40:])
    assert f"\n{FORGED}" not in text
