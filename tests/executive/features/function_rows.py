"""A row for each function of Fawkes' features: a valid call with its result, and an invalid call.

The calls are the actions of a deffunction; the result is that of the last action. Text in single
quotes becomes a CLIPS string, quotes and all. ``@DIR@`` is a folder of the test, ``@PORT@`` and ``@OTHER@``
are free ports.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress, Symbol

NULL = ExternalAddress(0)
ENDS = "ends"
"""As the result of a call that ends the right-hand side."""

TOO_MANY = "too many"
"""For functions without invalid arguments: CLIPS refuses a call with too many arguments."""


class AnyOf:
    """Equal to each value of a type; of addresses, to the addresses of one kind."""

    def __init__(self, kind: type) -> None:
        self.kind = kind

    def __eq__(self, other: object) -> bool:
        return isinstance(other, self.kind) and other != NULL

    def __hash__(self) -> int:
        return hash(self.kind)

    def __repr__(self) -> str:
        return f"any {self.kind.__name__}"


@dataclass(frozen=True)
class Row:
    """A function.

    :param good: valid call without a warning in the log.
    :param result: result of the valid call.
    :param bad: invalid call, or :data:`TOO_MANY`.
    :param failure: result of the invalid call.
    :param told: part of the warning or error in the log; empty for a silent function.
    :param store: state of the robot memory during the bad call: ``slow`` without answers, ``away`` without
        connection.
    :param first: actions before the good call, a loop earlier.
    """

    good: str
    result: Any
    bad: str = TOO_MANY
    failure: Any = None
    told: str = ""
    store: str = ""
    first: str = ""


ADDRESS, INTEGER = AnyOf(ExternalAddress), AnyOf(int)

HOST = {
    "ff-feature-request": Row(
        "(ff-feature-request spare)",
        TRUE,
        "(ff-feature-request nothing)",
        FALSE,
        "requested unavailable feature nothing",
    ),
    "now": Row("(nth$ 1 (now))", 1_000_000_000),
    "now-systime": Row("(length$ (now-systime))", 2),
    "quit": Row("(quit) went-on", "went-on"),
    "map-action-skill": Row(
        '(map-action-skill say (create$ text) (create$ "hi"))',
        'say{text="hi"}',
        '(map-action-skill say (create$ text) (create$ "hi" "ho"))',
        "",
        "Number of parameter names and values do not match for action 'say'",
    ),
}

_MESSAGE = "(bind ?m (blackboard-create-msg 'RowInterface::R' '{}Message'))"
_SET_LIST, _NO_MESSAGE = _MESSAGE.format("SetList"), _MESSAGE.format("No")


def _is_open(uid: str) -> str:
    return f"(any-factp ((?f blackboard-interface)) (eq ?f:uid '{uid}'))"


_WRITE = "(blackboard-set 'RowInterface::W' number 7) (blackboard-write 'RowInterface::W')"
_READ = "(blackboard-read) (do-for-fact ((?f RowInterface)) TRUE ?f:{})"

BLACKBOARD = {
    "blackboard-enable-time-read": Row(
        "(blackboard-enable-time-read) (member$ blackboard-read (get-defrule-list))", INTEGER
    ),
    **{
        name: Row(
            f"({name} 'TestInterface' 'A') {_is_open('TestInterface::A')}",
            TRUE,
            f"({name} 'NoInterface' 'A') {_is_open('NoInterface::A')}",
            FALSE,
            "Failed to open interface NoInterface:A",
        )
        for name in ("blackboard-open", "blackboard-open-reading")
    },
    "blackboard-open-writing": Row(
        f"(blackboard-open-writing 'TestInterface' 'A') {_is_open('TestInterface::A')}",
        TRUE,
        f"(blackboard-open-writing 'TestInterface' 'Taken') {_is_open('TestInterface::Taken')}",
        FALSE,
        "There is already a writer",
    ),
    "blackboard-preload": Row(
        "(blackboard-preload 'SwitchInterface') (member$ SwitchInterface (get-deftemplate-list))",
        INTEGER,
        "(blackboard-preload 'NoInterface')",
        None,
        "Failed to preload interface type NoInterface",
    ),
    "blackboard-close": Row(
        "(blackboard-close 'RowInterface' 'W') (blackboard-open-writing 'RowInterface' 'W') done",
        "done",
        "(blackboard-close 'NoInterface' 'A')",
    ),
    "blackboard-read": Row(_WRITE + _READ.format("id"), "W"),
    "blackboard-write": Row(
        _WRITE + _READ.format("number"),
        7,
        "(blackboard-write 'RowInterface::Q')",
        None,
        "Interface RowInterface::Q not opened for writing",
    ),
    "blackboard-get-info": Row(
        "(blackboard-get-info) (any-factp ((?f blackboard-interface-info)) (eq ?f:id 'W'))", TRUE
    ),
    "blackboard-set": Row(
        _WRITE + _READ.format("number"),
        7,
        "(blackboard-set 'RowInterface::W' nothing 7)",
        None,
        "Can't find field nothing",
    ),
    "blackboard-set-multifield": Row(
        "(blackboard-set-multifield 'RowInterface::W' list (create$ 1 2))"
        " (blackboard-write 'RowInterface::W')" + _READ.format("list"),
        (1, 2, 0),
        "(blackboard-set-multifield 'RowInterface::W' list (create$ one))",
        None,
        "takes an INTEGER",
    ),
    "blackboard-create-msg": Row(f"{_SET_LIST} ?m", ADDRESS, f"{_NO_MESSAGE} ?m", NULL, "NoMessage"),
    "blackboard-list-msg-fields": Row(
        f"{_SET_LIST} (blackboard-list-msg-fields ?m)",
        ("list", "number"),
        f"{_NO_MESSAGE} (blackboard-list-msg-fields ?m)",
        (),
        "NoMessage",
    ),
    "blackboard-set-msg-field": Row(
        f"{_SET_LIST} (blackboard-set-msg-field ?m number 5) (blackboard-send-msg ?m)",
        1,
        f"{_NO_MESSAGE} (blackboard-set-msg-field ?m number 5)",
        None,
        "Can't set message field, the pointer is wrong.",
    ),
    "blackboard-set-msg-multifield": Row(
        f"{_SET_LIST} (blackboard-set-msg-multifield ?m list (create$ 4 5)) (blackboard-send-msg ?m)",
        1,
        f"{_SET_LIST} (blackboard-set-msg-multifield ?m list (create$ four))",
        None,
        "takes an INTEGER",
    ),
    "blackboard-send-msg": Row(
        f"{_SET_LIST} (blackboard-send-msg ?m)",
        1,
        f"{_SET_LIST} (blackboard-send-msg ?m) (blackboard-send-msg ?m)",
        0,
        "Can't send message, was it already sent?",
    ),
}

_OPERATOR = "(do-for-fact ((?o domain-operator)) TRUE ?o:name)"

OTHERS = {
    "config-load": Row(
        "(config-load '/a/maps') (do-for-fact ((?f confval)) TRUE ?f:value)",
        "one",
        "(config-load '/nothing') (any-factp ((?f confval)) TRUE)",
        FALSE,
    ),
    "parse-pddl-domain": Row(
        f"(parse-pddl-domain '@DIR@/domain.pddl') {_OPERATOR}",
        "take",
        f"(parse-pddl-domain '@DIR@/none.pddl') {_OPERATOR}",
        FALSE,
        "Failed to parse domain: ",
    ),
    "parse-pddl-formula": Row(
        "(parse-pddl-formula '(held x)' 'q') (do-for-fact ((?p pddl-predicate)) TRUE ?p:id)",
        "q11-atom",
        "(parse-pddl-formula '(held' 'q') (any-factp ((?p pddl-predicate)) TRUE)",
        FALSE,
        "Failed to parse formula: ",
    ),
    "navgraph-block-edge": Row(
        "(navgraph-block-edge hall kitchen)",
        None,
        "(navgraph-block-edge hall moon)",
        None,
        "Environment executive tried to block edge hall--moon, which does not exist in graph",
    ),
    "navgraph-unblock-edge": Row(
        "(navgraph-block-edge hall kitchen) (navgraph-unblock-edge hall kitchen)",
        None,
        "(navgraph-unblock-edge hall moon)",
        None,
        "Environment executive tried to unblock edge hall--moon, which does not exist in graph",
    ),
}

MOTOR_SWITCH = {
    "motor-enable": Row("(motor-enable)", None),
    "motor-disable": Row("(motor-disable)", None),
}

_HERE = "'map' 'robot' (create$ 0 0)"
_NOWHERE = "'map' 'moon' (create$ 0 0)"
_X, _TURN = "(create$ 1 0 0)", "(create$ 0 0 0 1)"


def _transform(name: str, values: str, result: tuple[float, ...]) -> dict[str, Row]:
    call = f"(tf-transform-{name} {{}} {values})"
    told = f"Failed to transform {name} from moon to map: "
    return {f"tf-transform-{name}": Row(call.format(_HERE), result, call.format(_NOWHERE), (FALSE,), told)}


TF = {
    "tf-quat-from-yaw": Row("(tf-quat-from-yaw 0)", (0.0, 0.0, 0.0, 1.0)),
    "tf-yaw-from-quat": Row(
        f"(tf-yaw-from-quat {_TURN})", 0.0, f"(tf-yaw-from-quat {_X})", 0.0, "Invalid quaternion"
    ),
    "tf-frame-exists": Row("(tf-frame-exists robot)", TRUE, "(tf-frame-exists moon)", FALSE),
    "tf-can-transform": Row(
        f"(tf-can-transform {_HERE})",
        TRUE,
        "(tf-can-transform 'map' 'robot' (create$ 1 2 3))",
        FALSE,
        "Invalid time: must be list of exactly two entries",
    ),
    **_transform("point", _X, (2.0, 2.0, 0.0)),
    **_transform("vector", _X, (1.0, 0.0, 0.0)),
    **_transform("quaternion", _TURN, (0.0, 0.0, 0.0, 1.0)),
    **_transform("pose", f"{_X} {_TURN}", (2.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0)),
    "tf-add-publisher": Row(
        "(tf-add-publisher box)", (TRUE,), "(tf-add-publisher box) (tf-add-publisher box)", (FALSE,)
    ),
    **{
        name: Row(
            f"(tf-add-publisher box) ({name} map box 0.0 1.0 2.0)",
            (TRUE,),
            f"({name} map box 0.0 1.0 2.0)",
            (FALSE,),
        )
        for name in ("tf-publish-pose", "tf-publish-pose-static")
    },
}

_REPORT = "(bind ?m (pb-create test_msgs.Report))"
_NOTHING = "(bind ?m (pb-create test_msgs.Nothing))"
_UNKNOWN = "Cannot create message of type test_msgs.Nothing"
_PEER = "(bind ?p (pb-peer-create-local '127.0.0.1' @PORT@ @OTHER@))"
_ORDER = "(bind ?m (pb-create test_msgs.Order))"

PROTOBUF = {
    "pb-register-type": Row(
        "(pb-register-type late.Late)",
        TRUE,
        "(pb-register-type test_msgs.Nothing)",
        FALSE,
        "Registering type test_msgs.Nothing failed",
    ),
    "pb-create": Row(f"{_REPORT} ?m", ADDRESS, f"{_NOTHING} ?m", NULL, _UNKNOWN),
    "pb-ref": Row(
        f"{_REPORT} (bind ?r (pb-ref ?m)) (pb-destroy ?m) (pb-field-type ?r robot)",
        "STRING",
        f"{_REPORT} (pb-destroy ?m) (pb-ref ?m)",
        NULL,
    ),
    "pb-destroy": Row(
        f"{_REPORT} (pb-destroy ?m) (pb-field-type ?m robot)",
        "INVALID-MESSAGE",
        f"{_REPORT} (pb-destroy ?m) (pb-destroy ?m)",
    ),
    "pb-field-names": Row(
        f"{_ORDER} (pb-field-names ?m)", ("id", "text"), f"{_NOTHING} (pb-field-names ?m)", (), _UNKNOWN
    ),
    "pb-field-type": Row(
        f"{_REPORT} (pb-field-type ?m d)", "DOUBLE", f"{_REPORT} (pb-field-type ?m no)", "DOES-NOT-EXIST"
    ),
    "pb-field-label": Row(
        f"{_REPORT} (pb-field-label ?m robot)",
        "REQUIRED",
        f"{_REPORT} (pb-field-label ?m no)",
        "DOES-NOT-EXIST",
    ),
    "pb-has-field": Row(
        f"{_REPORT} (pb-set-field ?m robot R1) (pb-has-field ?m robot)",
        TRUE,
        f"{_REPORT} (pb-has-field ?m no)",
        FALSE,
    ),
    "pb-field-is-list": Row(
        f"{_REPORT} (pb-field-is-list ?m numbers)", TRUE, f"{_REPORT} (pb-field-is-list ?m no)", FALSE
    ),
    "pb-field-value": Row(
        f"{_REPORT} (pb-set-field ?m d 2.5) (pb-field-value ?m d)",
        2.5,
        f"{_REPORT} (pb-field-value ?m robot)",
        "NOT-SET",
        "Field robot of test_msgs.Report not set",
    ),
    "pb-field-list": Row(
        f"{_REPORT} (pb-add-list ?m numbers 1) (pb-add-list ?m numbers 2) (pb-field-list ?m numbers)",
        (1, 2),
        f"{_REPORT} (pb-field-list ?m no)",
        ("DOES-NOT-EXIST",),
    ),
    "pb-set-field": Row(
        f"{_REPORT} (pb-set-field ?m colour GREEN) (pb-field-value ?m colour)",
        Symbol("GREEN"),
        f"{_REPORT} (pb-set-field ?m no 1)",
        None,
        "Could not find field no",
    ),
    "pb-add-list": Row(
        f"{_REPORT} (pb-add-list ?m names a) (pb-field-list ?m names)",
        ("a",),
        f"{_REPORT} (pb-add-list ?m numbers one)",
        None,
        "Failed to add field numbers",
    ),
    "pb-tostring": Row(
        f"{_ORDER} (pb-set-field ?m id 3) (pb-tostring ?m)",
        "id: 3\n",
        f"{_NOTHING} (pb-tostring ?m)",
        "",
        "Cannot convert message to string: invalid message",
    ),
    "pb-server-enable": Row(
        "(pb-server-enable @PORT@)", None, "(pb-server-enable 70000)", None, "no port 70000"
    ),
    "pb-server-disable": Row("(pb-server-enable @PORT@) (pb-server-disable)", None),
    "pb-connect": Row("(pb-connect '127.0.0.1' @PORT@)", 1, "(pb-connect '127.0.0.1' 0)", 0),
    "pb-disconnect": Row(
        "(bind ?c (pb-connect '127.0.0.1' @PORT@)) (pb-disconnect ?c)", None, "(pb-disconnect 77)"
    ),
    "pb-send": Row(
        f"{_PEER} {_ORDER} (pb-send ?p ?m)",
        None,
        f"{_PEER} {_NOTHING} (pb-send ?p ?m)",
        None,
        "Cannot send to 1: invalid message",
    ),
    "pb-broadcast": Row(
        f"{_PEER} {_ORDER} (pb-broadcast ?p ?m)", None, f"{_ORDER} (pb-broadcast 77 ?m)", None
    ),
    "pb-peer-create": Row(
        "(pb-peer-create '127.0.0.1' @PORT@)", 1, "(pb-peer-create '127.0.0.1' 70000)", 0, "no port 70000"
    ),
    "pb-peer-create-local": Row(
        f"{_PEER} ?p", 1, "(pb-peer-create-local '127.0.0.1' 70000 0)", 0, "no port 70000"
    ),
    "pb-peer-create-crypto": Row(
        "(pb-peer-create-crypto '127.0.0.1' @PORT@ key 'aes-128-cbc')",
        1,
        "(pb-peer-create-crypto '127.0.0.1' @PORT@ key rot13)",
        0,
        "no cipher 'rot13'",
    ),
    "pb-peer-create-local-crypto": Row(
        "(pb-peer-create-local-crypto '127.0.0.1' @PORT@ @OTHER@ key 'aes-128-cbc')",
        1,
        "(pb-peer-create-local-crypto '127.0.0.1' @PORT@ @OTHER@ key rot13)",
        0,
        "no cipher 'rot13'",
    ),
    "pb-peer-destroy": Row(f"{_PEER} (pb-peer-destroy ?p)", None, "(pb-peer-destroy 77)"),
    "pb-peer-setup-crypto": Row(
        f"{_PEER} (pb-peer-setup-crypto ?p key 'aes-128-cbc')",
        None,
        f"{_PEER} (pb-peer-setup-crypto ?p key rot13)",
        None,
        "no cipher 'rot13'",
    ),
}
