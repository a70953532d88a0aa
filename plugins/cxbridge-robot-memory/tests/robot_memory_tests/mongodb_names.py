"""The names of all operators of MongoDB's manual: each has cases, or is refused by its name."""

from __future__ import annotations


def _names(text: str) -> list[str]:
    return text.split()


QUERY_OPERATORS = _names("""
$eq $gt $gte $in $lt $lte $ne $nin $and $not $nor $or $exists $type $expr $jsonSchema $mod $regex
$options $text $where $geoIntersects $geoWithin $near $nearSphere $box $center $centerSphere $geometry
$maxDistance $minDistance $polygon $uniqueDocs $within $all $elemMatch $size $bitsAllClear $bitsAllSet
$bitsAnyClear $bitsAnySet $comment $rand $natural $sampleRate $meta $slice $search $language
$caseSensitive $diacriticSensitive $encStrContains $encStrEndsWith $encStrNormalizedEq $encStrStartsWith
""")
"""The operators of fields, and the parts of their operands."""

TOP_QUERY_OPERATORS = _names("""
$and $or $nor $expr $jsonSchema $text $where $comment $sampleRate $rand
""")
"""The operators next to the fields of a query."""

UPDATE_OPERATORS = _names("""
$currentDate $inc $min $max $mul $rename $set $setOnInsert $unset $addToSet $pop $pull $push $pullAll
$pushAll $each $position $slice $sort $bit $isolated $addFields $project $replaceRoot $replaceWith
""")
"""Operators and modifiers of updates, and the stages of pipelines for updates."""

POSITIONAL_OPERATORS = _names("""
$ $[] $[x]
""")
"""Parts of paths in updates."""

INDEX_KINDS = _names("""
text 2d 2dsphere hashed geoHaystack
""")
"""Kinds of indexes apart from 1 and -1."""
