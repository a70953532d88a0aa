"""The rows of the robot memory's CLIPS functions, for the tests of all functions."""

from __future__ import annotations

from cxbridge.executive.host.values import FALSE, TRUE
from tests.executive.features.function_rows import ADDRESS, ENDS, Row

_DESTROY = "(bson-destroy ?d)"
_PARSE = "(bind ?d (bson-parse '{}'))"
_EMPTY = _PARSE.format("{}")
_DOCUMENT = _PARSE.format('{"a": 1}')
_DESTROYED = "was destroyed before"
_TEXT = "(bson-tostring ?d)"

BSON = {
    "bson-create": Row("(bson-tostring (bson-create))", "{ }"),
    "bson-parse": Row(
        f"{_DOCUMENT} {_TEXT}",
        '{ "a" : 1 }',
        _PARSE.format("{broken") + _TEXT,
        "{ }",
        "Parsing JSON doc failed",
    ),
    "bson-destroy": Row(
        f"{_DOCUMENT} {_DESTROY}", None, f"{_DOCUMENT} {_DESTROY} {_DESTROY}", None, _DESTROYED
    ),
    "bson-tostring": Row(
        f"{_DOCUMENT} {_TEXT}", '{ "a" : 1 }', f"{_DOCUMENT} {_DESTROY} {_TEXT}", "", _DESTROYED
    ),
    "bson-append": Row(
        f"{_EMPTY} (bson-append ?d a TRUE) {_TEXT}",
        '{ "a" : "TRUE" }',
        f"{_EMPTY} (bson-append ?d a (create$ 1 2))",
        None,
        "a",
    ),
    "bson-append-regex": Row(
        f"{_EMPTY} (bson-append-regex ?d a '^b') {_TEXT}",
        '{ "a" : { "$regex" : "^b", "$options" : "" } }',
        f"{_EMPTY} (bson-append-regex ?d a b)",
        None,
        "Regex string has to be of type string",
    ),
    "bson-append-array": Row(
        f"{_EMPTY} (bson-append-array ?d a (create$ 1 b)) {_TEXT}",
        '{ "a" : [ 1, "b" ] }',
        f"{_EMPTY} {_DESTROY} (bson-append-array ?d a (create$ 1))",
        None,
        _DESTROYED,
    ),
    "bson-array-start": Row("(bson-array-start)", ADDRESS),
    "bson-array-append": Row(
        f"{_EMPTY} (bind ?l (bson-array-start)) (bson-array-append ?l 1) (bson-array-finish ?d a ?l) {_TEXT}",
        '{ "a" : [ 1 ] }',
        "(bson-array-append (bson-array-start) (create$ 1 2))",
        None,
        "tried to add unknown type to BSON",
    ),
    "bson-array-finish": Row(
        f"{_EMPTY} (bson-array-finish ?d a (bson-array-start)) {_TEXT}",
        '{ "a" : [  ] }',
        f"{_EMPTY} (bind ?l (bson-array-start)) (bson-array-finish ?d a ?l) (bson-array-finish ?d b ?l)",
        None,
        _DESTROYED,
    ),
    "bson-append-time": Row(
        f"{_EMPTY} (bson-append-time ?d a (create$ 1 2999)) {_TEXT}",
        '{ "a" : { "$date" : 1002 } }',
        f"{_EMPTY} (bson-append-time ?d a (create$ 1))",
        None,
        "Invalid time",
    ),
    "bson-field-names": Row(
        f"{_DOCUMENT} (bson-field-names ?d)",
        ("a",),
        f"{_DOCUMENT} {_DESTROY} (bson-field-names ?d)",
        (FALSE,),
        _DESTROYED,
    ),
    "bson-has-field": Row(
        _PARSE.format('{"a": {"b": 1}}') + "(bson-has-field ?d a.b)",
        TRUE,
        f"{_DOCUMENT} (bson-has-field ?d a.b)",
        FALSE,
    ),
    "bson-get": Row(
        f"{_DOCUMENT} (bson-get ?d a)", 1, f"{_DOCUMENT} (bson-get ?d b)", FALSE, "no such element in doc"
    ),
    "bson-get-array": Row(
        _PARSE.format('{"a": [1, "b", true]}') + "(bson-get-array ?d a)",
        (1, "b", TRUE),
        f"{_DOCUMENT} (bson-get-array ?d a)",
        (FALSE,),
        "field a is not an array",
    ),
    "bson-get-time": Row(
        _PARSE.format('{"a": {"$date": 1500}}') + "(bson-get-time ?d a)",
        (1, 500_000),
        f"{_DOCUMENT} (bson-get-time ?d a)",
        (FALSE,),
        "field a is not a time",
    ),
}

_TEST = "'robmem.test'"
_INSERT = f"{_DOCUMENT} (robmem-insert {_TEST} ?d)"
_SET = "(bson-parse '{\"b\": 2}')"
_QUERY = "'{\"a\": 1}'"
_FOUND = f"(bind ?c (robmem-query {_TEST} (bson-create))) (bson-get (robmem-cursor-next ?c) b)"
_CURSOR = f"{_INSERT} (bind ?c (robmem-query {_TEST} (bson-create)))"
_END = "(robmem-cursor-destroy ?c)"
_WRONG = "(bson-parse '{\"$frob\": 1}')"

COLLECTIONS = {
    "robmem-insert": Row(
        f"{_INSERT} (bson-get (robmem-cursor-next (robmem-query {_TEST} (bson-create))) a)",
        1,
        f"{_DOCUMENT} (robmem-insert nowhere ?d)",
        None,
        "Insert failed",
    ),
    **{
        f"robmem-{name}": Row(
            f"{_INSERT} (robmem-{name} {_TEST} {_SET} {_QUERY}) {_FOUND}",
            2,
            f"{_DOCUMENT} (robmem-{name} {_TEST} ?d 5)",
            None,
            "failed",
        )
        for name in ("update", "upsert", "replace")
    },
    "robmem-query": Row(
        f"(robmem-query {_TEST} (bson-create))",
        ADDRESS,
        f"(robmem-query {_TEST} {_WRONG})",
        FALSE,
        "Query failed",
    ),
    "robmem-query-sort": Row(
        f"{_INSERT} (bson-get (robmem-cursor-next (robmem-query-sort {_TEST} (bson-create) ?d)) a)",
        1,
        f"(robmem-query-sort {_TEST} (bson-create) (bson-parse '{{\"a\": 5}}'))",
        FALSE,
        "Query failed",
    ),
    "robmem-remove": Row(
        f"{_INSERT} (robmem-remove {_TEST} ?d) (robmem-cursor-next (robmem-query {_TEST} (bson-create)))",
        FALSE,
        f"{_DOCUMENT} (robmem-remove nowhere ?d)",
        None,
        "Remove failed",
    ),
    "robmem-dump-collection": Row(
        f"{_INSERT} (robmem-dump-collection {_TEST} '@DIR@/dump')",
        TRUE,
        f"{_INSERT} (robmem-dump-collection {_TEST} '/proc/nowhere')",
        FALSE,
        "nowhere",
    ),
    "robmem-restore-collection": Row(
        f"{_INSERT} (robmem-dump-collection {_TEST} '@DIR@/dump') (robmem-remove {_TEST} ?d)"
        f" (robmem-restore-collection {_TEST} '@DIR@/dump' '')",
        TRUE,
        f"(robmem-restore-collection {_TEST} '@DIR@/none' '')",
        FALSE,
        "none",
    ),
    "robmem-cursor-next": Row(
        f"{_CURSOR} (bson-get (robmem-cursor-next ?c) a)",
        1,
        f"{_CURSOR} {_END} (robmem-cursor-next ?c)",
        FALSE,
        _DESTROYED,
    ),
    "robmem-cursor-more": Row("", None, f"{_CURSOR} (robmem-cursor-more ?c)", ENDS, "no longer supported"),
    "robmem-cursor-destroy": Row(f"{_CURSOR} {_END}", None, f"{_CURSOR} {_END} {_END}", None, _DESTROYED),
    "robmem-trigger-register": Row(
        f"(robmem-trigger-register {_TEST} (bson-create) t)",
        TRUE,
        f"(robmem-trigger-register {_TEST} (bson-create) t)"
        f" (robmem-trigger-register {_TEST} (bson-create) t)",
        FALSE,
        "",
        store="slow",
    ),
    "robmem-trigger-destroy": Row(
        "(robmem-trigger-destroy"
        " (do-for-fact ((?f mutex-trigger-register-feedback)) TRUE (nth$ 3 ?f:implied)))",
        None,
        "(robmem-trigger-destroy FALSE)",
        None,
        "trigger",
        first=f"(robmem-trigger-register {_TEST} (bson-create) t)",
    ),
    "robmem-create-index": Row(
        f"{_DOCUMENT} (robmem-create-index {_TEST} ?d)",
        None,
        f"(robmem-create-index {_TEST} (bson-create))",
        None,
        "Creating index failed",
    ),
    "robmem-create-unique-index": Row(
        "", None, f"{_DOCUMENT} (robmem-create-unique-index {_TEST} ?d)", None, "needs MongoDB"
    ),
}

_LOCK = "(robmem-mutex-try-lock m me)"


def _mutex_rows(name: str, good: str, bad: str) -> dict[str, Row]:
    return {f"robmem-mutex-{name}": Row(good, TRUE, bad, FALSE)}


def _unreachable_rows(name: str, good: str, bad: str) -> dict[str, Row]:
    return {f"robmem-mutex-{name}": Row(good, TRUE, bad, FALSE, f"Mutex {name} failed", store="away")}


def _async_rows(name: str, owner: str) -> dict[str, Row]:
    call = f"(robmem-mutex-{name}-async m {owner})"
    busy = (FALSE, f"Task already running for m ({name} failed)")
    return {f"robmem-mutex-{name}-async": Row(call, (TRUE,), call + call, busy, store="slow")}


MUTEXES = {
    **_mutex_rows("create", "(robmem-mutex-create m)", "(robmem-mutex-create m) (robmem-mutex-create m)"),
    **_unreachable_rows(
        "destroy", "(robmem-mutex-create m) (robmem-mutex-destroy m)", "(robmem-mutex-destroy m)"
    ),
    **_mutex_rows("try-lock", _LOCK, f"{_LOCK} (robmem-mutex-try-lock m other)"),
    **_mutex_rows("renew-lock", f"{_LOCK} (robmem-mutex-renew-lock m me)", "(robmem-mutex-renew-lock m me)"),
    **_unreachable_rows(
        "force-lock", f"{_LOCK} (robmem-mutex-force-lock m other)", "(robmem-mutex-force-lock m other)"
    ),
    **_mutex_rows("unlock", f"{_LOCK} (robmem-mutex-unlock m me)", f"{_LOCK} (robmem-mutex-unlock m other)"),
    "robmem-mutex-setup-ttl": Row(
        "", None, "(robmem-mutex-setup-ttl 5.0)", FALSE, "Mutex setup-ttl failed: a unique or expiring index"
    ),
    **_unreachable_rows("expire-locks", "(robmem-mutex-expire-locks 5.0)", "(robmem-mutex-expire-locks 5.0)"),
    **_async_rows("create", ""),
    **_async_rows("destroy", ""),
    **_async_rows("try-lock", "me"),
    **_async_rows("renew-lock", "me"),
    **_async_rows("force-lock", "me"),
    **_async_rows("unlock", "me"),
    "robmem-mutex-expire-locks-async": Row(
        "(robmem-mutex-expire-locks-async 5.0)",
        TRUE,
        "(robmem-mutex-expire-locks-async 5.0) (robmem-mutex-expire-locks-async 5.0)",
        FALSE,
        store="slow",
    ),
}

ROBOT_MEMORY = BSON | COLLECTIONS | MUTEXES
