"""The documented behaviour of MongoDB's operators as cases.

The cases follow the manual, or else the server's own tests (paths: matcher/path_test.cpp; null:
null_query_semantics.js; upserts: upsert_fields.js; comparisons: expression_leaf.cpp).
"""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from cxbridge_robot_memory.values import ObjectId, Regex, Timestamp

NOW = datetime(2026, 1, 2, 3, 4, 5, 678000, tzinfo=UTC)
NAN = float("nan")

# --- queries ----------------------------------------------------------------------------------------------

QUERY_CASES: dict[str, list[tuple[dict[str, Any], Any, bool]]] = {
    # operator: document, condition of its field, whether it matches; {"query": ...} is a whole query
    "$eq": [
        ({"a": 1}, {"$eq": 1.0}, True),
        ({"a": 1}, {"$eq": True}, False),
        ({"a": [1, 2]}, {"$eq": 2}, True),
        ({"a": [[1, 2]]}, {"$eq": [1, 2]}, True),
        ({"a": [[1, 2]]}, {"$eq": 1}, False),
        ({"a": {"x": 1, "y": 2}}, {"$eq": {"y": 2, "x": 1}}, False),
        ({"a": 0.0}, {"$eq": -0.0}, True),
        ({"a": 2**53 + 1}, {"$eq": 2.0**53}, False),
        ({"a": "abc"}, {"$eq": Regex("b")}, False),
        ({"a": Regex("b")}, {"$eq": Regex("b")}, True),
        ({}, {"$eq": None}, True),
        ({"a": []}, {"$eq": None}, False),
        ({"a": [None]}, {"$eq": None}, True),
        ({"a": 4}, {"query": {"a.b": None}}, True),
        ({"a": {}}, {"query": {"a.b": None}}, True),
        ({"a": []}, {"query": {"a.b": None}}, False),
        ({"a": [1, "x"]}, {"query": {"a.b": None}}, False),
        ({"a": [[]]}, {"query": {"a.b": None}}, False),
        ({"a": [{"b": 3}, {}]}, {"query": {"a.b": None}}, True),
        ({"a": [{"b": 3}]}, {"query": {"a.b": None}}, False),
        ({"a": [[{"b": 4}]]}, {"query": {"a.b": 4}}, False),
        ({"": 1}, {"query": {"": 1}}, True),
    ],
    "$ne": [
        ({"a": 1}, {"$ne": 2}, True),
        ({"a": [1, 2]}, {"$ne": 2}, False),
        ({}, {"$ne": 2}, True),
        ({"a": []}, {"query": {"a.b": {"$ne": None}}}, True),
    ],
    "$gt": [
        ({"a": 2}, {"$gt": 1}, True),
        ({"a": "2"}, {"$gt": 1}, False),
        ({"a": [0, 5]}, {"$gt": 4}, True),
        ({"a": [1, 2]}, {"$gt": [1]}, True),
        ({"a": NAN}, {"$gt": NAN}, False),
        ({"a": 1}, {"$gt": NAN}, False),
        ({"a": {"x": 2}}, {"$gt": {"x": 1}}, True),
    ],
    "$gte": [
        ({"a": 2}, {"$gte": 2}, True),
        ({}, {"$gte": None}, True),
        ({"a": NAN}, {"$gte": NAN}, True),
        ({"a": NAN}, {"$gte": 0}, False),
        ({"a": True}, {"$gte": False}, True),
        ({"a": NOW}, {"$gte": NOW}, True),
    ],
    "$lt": [
        ({"a": 1}, {"$lt": 2}, True),
        ({"a": NAN}, {"$lt": 5}, False),
        ({"a": None}, {"$lt": 1}, False),
        ({"a": False}, {"$lt": 1}, False),
        ({"a": "B"}, {"$lt": "a"}, True),
        ({"a": ObjectId("1" * 24)}, {"$lt": ObjectId("2" * 24)}, True),
        ({"a": Timestamp(1, 5)}, {"$lt": Timestamp(2, 0)}, True),
        ({"a": b"b"}, {"$lt": b"aa"}, True),
    ],
    "$lte": [
        ({"a": 2}, {"$lte": 2.0}, True),
        ({"a": NAN}, {"$lte": 2}, False),
        ({"a": None}, {"$lte": None}, True),
        ({"a": []}, {"$lte": [1]}, True),
    ],
    "$in": [
        ({"a": 1}, {"$in": [1.0]}, True),
        ({"a": [3, 1]}, {"$in": [1]}, True),
        ({"a": [1, 2]}, {"$in": [[1, 2]]}, True),
        ({}, {"$in": [None]}, True),
        ({"a": "xy"}, {"$in": [Regex("^X", "i")]}, True),
        ({"a": 1}, {"$in": []}, False),
    ],
    "$nin": [
        ({"a": 1}, {"$nin": [1.0]}, False),
        ({"a": [3, 1]}, {"$nin": [1]}, False),
        ({}, {"$nin": [1]}, True),
        ({}, {"$nin": [None]}, False),
        ({"a": 1}, {"$nin": []}, True),
    ],
    "$and": [
        ({"a": 1, "b": 2}, {"query": {"$and": [{"a": 1}, {"b": 2}]}}, True),
        ({"a": 1}, {"query": {"$and": [{"a": 1}, {"b": 2}]}}, False),
    ],
    "$or": [
        ({"a": 1}, {"query": {"$or": [{"a": 1}, {"b": 2}]}}, True),
        ({"a": 2}, {"query": {"$or": [{"a": 1}, {"b": 2}]}}, False),
    ],
    "$not": [
        ({"a": 1}, {"$not": {"$gt": 1}}, True),
        ({}, {"$not": {"$gt": 1}}, True),
        ({"a": "x"}, {"$not": Regex("x")}, False),
        ({"a": "x"}, {"$not": {"$regex": "y"}}, True),
    ],
    "$exists": [
        ({"a": None}, {"$exists": True}, True),
        ({}, {"$exists": True}, False),
        ({}, {"$exists": 0}, True),
        ({"a": []}, {"query": {"a.b": {"$exists": False}}}, True),
        ({"a": [{}, {"b": 1}]}, {"query": {"a.b": {"$exists": True}}}, True),
    ],
    "$regex": [
        ({"a": "xaby"}, {"$regex": "ab"}, True),
        ({"a": "a1"}, {"$regex": r"(?P<n>\d)$"}, True),
        ({"a": "x\n"}, {"$regex": "x$"}, True),
        ({"a": ["z", "ab"]}, {"$regex": "^ab$"}, True),
        ({"a": 1}, {"$regex": "1"}, False),
        ({"a": "a"}, {"$regex": Regex("A", "i")}, True),
        ({"a": Regex("A", "i")}, {"$regex": "A"}, False),
        ({"a": Regex("A", "i")}, {"$regex": "A", "$options": "i"}, True),
    ],
    "$options": [
        ({"a": "É"}, {"$regex": "é", "$options": "i"}, True),
        ({"a": "x\ny"}, {"$regex": "^y", "$options": "m"}, True),
        ({"a": "x\ny"}, {"$options": "s", "$regex": "x.y"}, True),
        ({"a": "ab"}, {"$regex": "a b # comment", "$options": "x"}, True),
        ({"a": "B"}, {"$regex": "b", "$options": ""}, False),
    ],
}

BAD_QUERIES: list[tuple[Any, str]] = [
    # a query that MongoDB refuses, and a part of the error
    ({"a": {"$in": 1}}, "$in"),
    ({"a": {"$in": [{"$gt": 1}]}}, "$in"),
    ({"a": {"$gt": 1, "b": 1}}, "b needs MongoDB"),
    ({"a": {"$not": 1}}, "$not"),
    ({"a": {"$not": {}}}, "$not"),
    ({"a": {"$gt": Regex("x")}}, "$gt"),
    ({"a": {"$ne": Regex("x")}}, "$ne"),
    ({"a": {"$regex": 1}}, "must be strings"),
    ({"a": {"$regex": "("}}, "regular expression"),
    ({"a": {"$regex": "a", "$options": "g"}}, "'g'"),
    ({"a": {"$options": "i"}}, "$options"),
    ({"$and": []}, "$and"),
    ({"a.0": 1}, "the index in the path 'a.0' needs MongoDB"),
    ({"$or": [1]}, "$or"),
]

# --- updates ----------------------------------------------------------------------------------------------

UPDATE_CASES: dict[str, list[tuple[dict[str, Any], dict[str, Any], Any]]] = {
    # operator: document, update, the updated document; a text is a part of the error
    "$set": [
        ({"a": 1}, {"$set": {"b": 2}}, {"a": 1, "b": 2}),
        ({}, {"$set": {"b": 2, "a": 1}}, {"a": 1, "b": 2}),
        ({}, {"$set": {"a.b.c": 1}}, {"a": {"b": {"c": 1}}}),
        ({"a": [1]}, {"$set": {"a.b": 5}}, "'a.b'"),
        ({"a": None}, {"$set": {"a.b": 5}}, "'a.b'"),
        ({"a": 1}, {"$set": {"_id": 2}}, "'_id'"),
        ({"a": 1}, {"$set": {"a": {"x": 1}, "a.b": 1}}, "conflict at 'a'"),
        ({"a": 1}, {"$set": {"a.b": 1}, "$unset": {"a": 1}}, "conflict at 'a'"),
        ({"a": 1}, {"$set": {"a": 1}, "$inc": {"a": 1}}, "conflict at 'a'"),
        ({"a": [1]}, {"$set": {"a.0": 5}}, "needs MongoDB"),
        ({"a": 1}, {"$set": {"a.b.c": 1}, "$inc": {"a.b": 1}}, "conflict at 'a.b'"),
        ({"a": {}}, {"$set": {"a.b": 1}, "$inc": {"a.bc": 1}}, {"a": {"b": 1, "bc": 1}}),
        ({"a": 1}, {"$set": {"a..b": 1}}, "'a..b'"),
        ({"a": 1}, {"$set": {"$b": 1}}, "$b"),
        ({"a": 1}, {"$set": 1}, "$set"),
    ],
    "$unset": [
        ({"a": 1, "b": 2}, {"$unset": {"a": ""}}, {"b": 2}),
        ({"a": {"b": 1, "c": 2}}, {"$unset": {"a.b": 1}}, {"a": {"c": 2}}),
        ({"a": [1]}, {"$unset": {"a.b": 1}}, {"a": [1]}),
        ({"a": 1}, {"$unset": {"a.b": 1}}, {"a": 1}),
        ({"a": 1}, {"$unset": {"_id": 1}}, "'_id'"),
    ],
    "$inc": [
        ({"a": 1}, {"$inc": {"a": 2}}, {"a": 3}),
        ({"a": 1}, {"$inc": {"a": 2}}, {"a": 3}),
        ({"a": 2**31 - 1}, {"$inc": {"a": 1}}, {"a": 2**31}),
        ({"a": 2**63 - 1}, {"$inc": {"a": 1}}, "'a'"),
        ({"a": 1}, {"$inc": {"a": 0.5}}, {"a": 1.5}),
        ({"a": 2**53 + 1}, {"$inc": {"a": 0.0}}, {"a": 2.0**53}),
        ({}, {"$inc": {"a.b": 2}}, {"a": {"b": 2}}),
        ({"a": None}, {"$inc": {"a": 1}}, "'a'"),
        ({"a": True}, {"$inc": {"a": 1}}, "'a'"),
        ({"b": 1}, {"$inc": {"a": "1"}}, "$inc"),
        ({"b": 1}, {"$inc": {"a": True}}, "$inc"),
    ],
    "$currentDate": [
        ({}, {"$currentDate": {"a": True}}, {"a": NOW}),
        ({}, {"$currentDate": {"a": 1}}, "$currentDate"),
    ],
    "$push": [
        ({"a": [1]}, {"$push": {"a": 2}}, {"a": [1, 2]}),
        ({}, {"$push": {"a": 2}}, {"a": [2]}),
        ({}, {"$push": {"a.b": 2}}, {"a": {"b": [2]}}),
        ({"a": [1]}, {"$push": {"a": [2, 3]}}, {"a": [1, [2, 3]]}),
        ({"a": [1]}, {"$push": {"a": {"b": 1}}}, {"a": [1, {"b": 1}]}),
        ({"a": 1}, {"$push": {"a": 2}}, "$push"),
    ],
}

UPSERTS: list[tuple[dict[str, Any], dict[str, Any], Any]] = [
    # query, update, the document without its _id; a text is a part of the error
    ({"x": 1}, {"$set": {"a": 1}}, {"x": 1, "a": 1}),
    ({"x": {"$in": [Regex("x")]}}, {"$set": {"a": 1}}, {"a": 1}),
    ({"x": {"$in": [1, 2]}}, {"$set": {"a": 1}}, {"a": 1}),
    ({"$and": [{"x": 1}, {"y": 2}]}, {"$set": {"a": 1}}, {"x": 1, "y": 2, "a": 1}),
    ({"$or": [{"x": 1}, {"y": 2}]}, {"$set": {"a": 1}}, {"a": 1}),
    ({"x": {"$gt": 1}, "y": {"$ne": 1}}, {"$set": {"a": 1}}, {"a": 1}),
    ({"x": Regex("x")}, {"$set": {"a": 1}}, {"a": 1}),
    ({"x": {"$eq": Regex("x")}}, {"$set": {"a": 1}}, {"x": Regex("x"), "a": 1}),
    ({"x": [1, 2]}, {"$set": {"a": 1}}, {"x": [1, 2], "a": 1}),
    ({"x.y": 1, "x.z": 2}, {"$set": {"a": 1}}, {"x": {"y": 1, "z": 2}, "a": 1}),
    ({"x": 1, "x.y": 1}, {"$set": {"a": 1}}, "'x.y'"),
    ({"x": 1}, {"$set": {"x": 5}}, {"x": 5}),
    ({"x": 1}, {"$inc": {"x": 5}}, {"x": 6}),
    ({"_id": 1}, {"$set": {"_id": 2}}, "'_id'"),
    ({}, {"$set": {"_id": [1]}}, "'_id'"),
    ({}, {"$set": {"_id": Regex("x")}}, "'_id'"),
]
