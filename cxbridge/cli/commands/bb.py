"""``cxbridge bb``: read and write a blackboard."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from cxbridge.cli.connect import (
    DEFAULT_URL,
    TIMED_OUT,
    AsJson,
    Connect,
    Globs,
    InterfaceDirs,
    Uid,
    connect,
    say_unmatched,
    split_glob,
    suggest_interface,
)
from cxbridge.cli.console import local_time, say, say_json, say_lines, say_result
from cxbridge.cli.discovery import group_rows, make_group_class

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping

    from cxbridge.blackboard import BlackBoard, InterfaceInfo
    from cxbridge.blackboard.following import Deadline, Feed, InterfaceChange
    from cxbridge.interfaces.instance import Interface

app = typer.Typer(name="bb", cls=make_group_class(lambda: group_rows("bb"), {}), no_args_is_help=True)

OWNER: Final = "cxbridge bb"

_ANY_INTERFACE: Final = "*"

Assignments = Annotated[
    list[str] | None,
    typer.Argument(metavar="NAME=VALUE...", help="Fields: NAME=VALUE, NAME=V,V,V for arrays."),
]
Glob = Annotated[
    str, typer.Argument(metavar="GLOB", help="TYPE or TYPE::ID with the shell patterns *, ?, [].")
]


@app.callback()
def _bb() -> None:
    """Read and write the blackboard of a cxbridge daemon or of Fawkes."""


@app.command("list")
def list_interfaces(
    glob: Glob = _ANY_INTERFACE,
    url: Connect = DEFAULT_URL,
    interface_dir: InterfaceDirs = None,
    as_json: AsJson = False,
) -> None:
    """List the open interfaces with their writers, readers and last writes.

    Exit status: 0 listed; 2 no interface matches GLOB.

    Fawkes does not report the names of owners: its lists contain the number of readers.

    Example: cxbridge bb list 'Skiller*'
    """
    from cxbridge.errors import BlackBoardError

    type_glob, id_glob = split_glob(glob)
    with connect(url, interface_dir) as board:
        interfaces = list(board.list(type_glob, id_glob))
        if not interfaces and glob != _ANY_INTERFACE:
            raise BlackBoardError(
                f"no interface matches '{glob}'{suggest_interface(board, glob)}",
                hint="see 'cxbridge bb list'",
            )
    say_result(
        [_interface_to_json(interface) for interface in interfaces],
        _format_table(interfaces),
        as_json=as_json,
    )


def _format_table(interfaces: Iterable[InterfaceInfo]) -> Iterator[str]:
    """Yield the lines of the list of interfaces, with a heading."""
    rows = [("INTERFACE", "WRITER", "READERS", "WRITTEN")]
    for interface in interfaces:
        writer = (interface.writer or "yes") if interface.has_writer else "-"
        rows.append((interface.uid, writer, _list_readers(interface), local_time(interface.timestamp_us)))
    *padded_columns, _ = zip(*rows, strict=True)
    widths = [max(map(len, column)) for column in padded_columns]
    for *cells, written in rows:
        yield "  ".join([*map(str.ljust, cells, widths), written])


def _list_readers(interface: InterfaceInfo) -> str:
    """Return the names of an interface's readers; their number if Fawkes does not report the names."""
    return ", ".join(filter(None, interface.readers)) or str(interface.num_readers)


@app.command()
def show(
    uid: Uid, url: Connect = DEFAULT_URL, interface_dir: InterfaceDirs = None, as_json: AsJson = False
) -> None:
    """Show an interface with its writer, its readers and its fields.

    Example: cxbridge bb show SkillerInterface::Skiller
    """
    with connect(url, interface_dir) as board:
        interface = _find_interface(board, uid)
        with board.open_for_reading(interface.type, interface.id, owner=OWNER) as instance:
            instance.read()
            description = {**_interface_to_json(interface), "fields": _json_values(instance.as_dict())}
            say_result(description, _describe_interface(interface, instance), as_json=as_json)


@app.command()
def watch(
    globs: Globs,
    url: Connect = DEFAULT_URL,
    interface_dir: InterfaceDirs = None,
    count: Annotated[int | None, typer.Option(min=1, help="End after N lines.")] = None,
    timeout: Annotated[float | None, typer.Option(min=0, help="End after SECONDS.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object per line.")] = False,
) -> int:
    """Print the changed fields of each write on a line, until Ctrl-C.

    Interfaces that are opened later are watched, too. Exit status: 0 after --count lines, or after --timeout
    without --count; 3 after --timeout with fewer than --count lines; 130 after Ctrl-C.

    Example: cxbridge bb watch 'ComponentInterface' --count 10
    """
    from cxbridge.blackboard.following import Deadline, Feed

    deadline, printed_count = Deadline(timeout), 0
    with connect(url, interface_dir) as board, Feed(board, OWNER) as feed:
        last_values: dict[str, dict[str, Any]] = {}
        say_unmatched(board, globs)
        # reads the present values, so that the first line of an interface has the changed fields only
        for type_glob, id_glob in map(split_glob, globs):
            for instance in feed.follow(type_glob, id_glob):
                last_values[instance.uid] = feed.read_state(instance).values
        while count is None or printed_count < count:
            change = feed.wait_for_change(deadline)
            if change is None:
                return 0 if count is None else TIMED_OUT
            printed_count += _print_change(change, last_values, as_json=as_json)
    return 0


@app.command("set")
def set_fields(
    uid: Uid,
    assignments: Assignments = None,
    url: Connect = DEFAULT_URL,
    interface_dir: InterfaceDirs = None,
    hold: Annotated[
        float | None, typer.Option(min=0, help="Remain the writer for SECONDS afterwards.")
    ] = None,
) -> None:
    """Write fields of an interface that has no other writer; its other fields keep their values.

    The values last as long as a process has the interface open, with --hold at least SECONDS.

    Example: cxbridge bb set SwitchInterface::Light enabled=true --hold 60
    """
    from cxbridge.blackboard import parse_uid
    from cxbridge.blackboard.following import Deadline, Feed
    from cxbridge.interfaces.assignments import assign

    with (
        connect(url, interface_dir) as board,
        board.open_for_writing(*parse_uid(uid), owner=OWNER) as writer,
        Feed(board, OWNER) as feed,
    ):
        writer.read()  # a new writer starts with the values of the last one
        if assign(writer, assignments or ()):
            writer.mark_data_changed()
        writer.mark_data_refreshed()  # a write of equal values has a new time stamp
        writer.write()
        if hold is not None:
            feed.wait_for_change(Deadline(hold))  # waits for the whole time: the feed follows no interface


@app.command()
def send(
    uid: Uid,
    message: Annotated[str, typer.Argument(metavar="MESSAGE", help="Type of the message, e.g. ExecSkill.")],
    assignments: Assignments = None,
    url: Connect = DEFAULT_URL,
    interface_dir: InterfaceDirs = None,
    wait: Annotated[
        bool,
        typer.Option("--wait", help="Wait until the field msgid of the interface is the id of the message."),
    ] = False,
    timeout: Annotated[float, typer.Option(min=0, help="Limit of --wait, in seconds.")] = 10.0,
) -> int:
    """Send a message to the writer of an interface; print its id, and with --wait the fields after the reply.

    Exit status: 0 sent, and with --wait answered; 2 not sent; 3 no reply in time.

    Example: cxbridge bb send SkillerInterface::Skiller ExecSkill skill_string='say{text="hi"}'
    """
    from cxbridge.blackboard.following import Deadline, Feed
    from cxbridge.errors import BlackBoardError
    from cxbridge.interfaces.assignments import assign

    with connect(url, interface_dir) as board, Feed(board, OWNER) as feed:
        interface = _find_interface(board, uid)
        instance = feed.open(interface.type, interface.id)
        if wait and instance.SCHEMA.field("msgid") is None:
            raise BlackBoardError(
                f"{interface.type} has no field msgid to wait for",
                hint="omit --wait, and look with 'bb watch'",
            )
        has_suffix = message in instance.MESSAGES or message.endswith("Message")
        outgoing = instance.create_message(message if has_suffix else f"{message}Message")
        assign(outgoing, assignments or ())
        earlier_change = feed.read_state(instance)
        msgid = instance.msgq_enqueue(outgoing)
        say(msgid, flush=True)
        if wait and not _print_reply(feed, earlier_change, msgid, Deadline(timeout)):
            reason = (
                ": another client has exclusive control of the Skiller"
                if earlier_change.values.get("exclusive_controller")
                else ""
            )
            say(f"no answer to message {msgid} after {timeout:g} s{reason}", err=True)
            return TIMED_OUT
    return 0


def _print_reply(feed: Feed, earlier_change: InterfaceChange, msgid: int, deadline: Deadline) -> bool:
    """Wait for the reply to a message and print its fields; return whether the reply has come in time."""
    while (change := feed.wait_for_change(deadline)) is not None:
        # a listener may get an old write, from before the message, twice
        is_stale = change.values == earlier_change.values and change.time_us <= earlier_change.time_us
        if change.kind == "data" and not is_stale and change.values["msgid"] == msgid:
            say_lines(_format_fields(change.values))
            return True
    return False


def _find_interface(board: BlackBoard, uid: str) -> InterfaceInfo:
    """Return the description of an interface.

    :raises BlackBoardError: if no process has it open.
    """
    from cxbridge.blackboard import parse_uid
    from cxbridge.errors import BlackBoardError
    from cxbridge.suggestions import did_you_mean, nearest_names

    interface_type, interface_id = parse_uid(uid)
    interfaces = board.list()
    if matching := [
        interface
        for interface in interfaces
        if (interface.type, interface.id) == (interface_type, interface_id)
    ]:
        return matching[0]

    types = [interface_type, *nearest_names(interface_type, {interface.type for interface in interfaces})]
    hint = did_you_mean(
        uid, (interface.uid for interface in interfaces if interface.type in types), "see 'cxbridge bb list'"
    )
    raise BlackBoardError(f"no process has {uid} open", hint=hint)


def _json_values(values: Mapping[str, Any]) -> dict[str, Any]:
    from cxbridge.interfaces.assignments import json_value

    return {name: json_value(value) for name, value in values.items()}


def _interface_to_json(interface: InterfaceInfo) -> dict[str, Any]:
    """Return the description of an interface for JSON."""
    return {
        "uid": interface.uid,
        "type": interface.type,
        "id": interface.id,
        "hash": interface.hash.hex().upper(),
        "serial": interface.serial,
        "has_writer": interface.has_writer,
        "writer": interface.writer,
        "num_readers": interface.num_readers,
        "readers": list(interface.readers),
        "timestamp_us": interface.timestamp_us,
    }


def _describe_interface(interface: InterfaceInfo, instance: Interface) -> list[str]:
    writer = (interface.writer or "an unnamed owner") if interface.has_writer else "no writer"
    return [
        f"{interface.uid}  {interface.hash.hex().upper()}",
        f"written by {writer}, last {local_time(instance.timestamp_us)}",
        f"read by {_list_readers(interface)}",
        *_format_fields(instance.as_dict()),
    ]


def _format_fields(values: Mapping[str, Any]) -> list[str]:
    from cxbridge.interfaces.assignments import field_text

    width = max(map(len, values), default=0)
    return [f"  {name:{width}}  {field_text(value)}" for name, value in values.items()]


def _print_change(change: InterfaceChange, last_values: dict[str, dict[str, Any]], *, as_json: bool) -> bool:
    """Print a line for a change, unless it is a write of equal values; return whether it was printed.

    :param last_values: the last received values by interface; updated.
    """
    from cxbridge.interfaces.assignments import fields_text

    fields: Collection[str] = ()
    if change.kind == "data":
        earlier_values = last_values.get(change.uid)
        last_values[change.uid] = change.values
        fields = [
            name
            for name, value in change.values.items()
            if earlier_values is None or earlier_values[name] != value
        ]
        if not fields:
            return False
    if as_json:
        values = _json_values({name: change.values[name] for name in fields})
        line = {"time_us": change.time_us, "uid": change.uid, "what": change.kind, "fields": values}
        say_json(line, flush=True)
    else:
        change_text = fields_text(change.values, fields) if change.kind == "data" else change.kind
        say(f"{local_time(change.time_us)}  {change.uid}  {change_text}", flush=True)
    return True
