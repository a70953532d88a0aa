"""The names of all operators of MongoDB's manual: each does what it documents, or is refused by its name."""

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
"""What a query can ask a field, or stands in such an operand."""

TOP_QUERY_OPERATORS = _names("""
$and $or $nor $expr $jsonSchema $text $where $comment $sampleRate $rand
""")
"""What stands beside the fields of a query."""

UPDATE_OPERATORS = _names("""
$currentDate $inc $min $max $mul $rename $set $setOnInsert $unset $addToSet $pop $pull $push $pullAll
$pushAll $each $position $slice $sort $bit $isolated $addFields $project $replaceRoot $replaceWith
""")
"""Operators and modifiers of updates, and stages that an update by a pipeline has."""

POSITIONAL_OPERATORS = _names("""
$ $[] $[x]
""")
"""Parts of paths in updates."""

STAGES = _names("""
$addFields $bucket $bucketAuto $changeStream $changeStreamSplitLargeEvent $collStats $count $currentOp
$densify $documents $facet $fill $geoNear $graphLookup $group $indexStats $limit $listClusterCatalog
$listLocalSessions $listSampledQueries $listSearchIndexes $listSessions $lookup $match $merge $out
$planCacheStats $project $querySettings $queryStats $rankFusion $redact $replaceRoot $replaceWith $sample
$score $scoreFusion $search $searchMeta $set $setWindowFields $shardedDataDistribution $skip $sort
$sortByCount $unionWith $unset $unwind $vectorSearch
""")
"""Stages of pipelines."""

EXPRESSIONS = _names("""
$abs $accumulator $acos $acosh $add $addToSet $allElementsTrue $and $anyElementTrue $arrayElemAt
$arrayToObject $asin $asinh $atan $atan2 $atanh $avg $binarySize $bitAnd $bitNot $bitOr $bitXor $bottom
$bottomN $bsonSize $ceil $cmp $concat $concatArrays $cond $convert $cos $cosh $count $covariancePop
$covarianceSamp $dateAdd $dateDiff $dateFromParts $dateFromString $dateSubtract $dateToParts
$dateToString $dateTrunc $dayOfMonth $dayOfWeek $dayOfYear $degreesToRadians $denseRank $derivative
$divide $documentNumber $eq $exp $expMovingAvg $filter $first $firstN $floor $function $getField $gt $gte
$hour $ifNull $in $indexOfArray $indexOfBytes $indexOfCP $integral $isArray $isNumber $isoDayOfWeek
$isoWeek $isoWeekYear $last $lastN $let $linearFill $literal $ln $locf $log $log10 $lt $lte $ltrim $map
$max $maxN $median $mergeObjects $meta $millisecond $min $minN $minute $minMaxScaler $mod $month
$multiply $ne $not $objectToArray $or $percentile $pow $push $radiansToDegrees $rand $range $rank $reduce
$regexFind $regexFindAll $regexMatch $replaceAll $replaceOne $reverseArray $round $rtrim $sampleRate
$second $setDifference $setEquals $setField $setIntersection $setIsSubset $setUnion $shift $sigmoid $sin
$sinh $size $slice $sortArray $split $sqrt $stdDevPop $stdDevSamp $strLenBytes $strLenCP $strcasecmp
$substr $substrBytes $substrCP $subtract $sum $switch $tan $tanh $toBool $toDate $toDecimal $toDouble
$toHashedIndexKey $toInt $toLong $toLower $toObjectId $toString $toUpper $toUUID $top $topN $trim $trunc
$tsIncrement $tsSecond $type $unsetField $week $year $zip
""")
"""What ``$project`` can compute with."""

INDEX_KINDS = _names("""
text 2d 2dsphere hashed geoHaystack
""")
"""Indexes of other kinds than 1 and -1."""

FIND_OPTIONS = _names("""
projection skip collation hint max min batch_size allow_disk_use comment no_cursor_timeout return_key
show_record_id let array_filters
""")
"""Options of find, as pymongo spells them."""

FIND_AND_MODIFY_OPTIONS = _names("""
remove new fields sort array_filters bypass_document_validation collation hint let
""")
"""Options of findAndModify."""

INDEX_OPTIONS = _names("""
sparse partial_filter_expression collation hidden name background weights default_language
wildcard_projection
""")
"""Options of indexes besides ``unique`` and ``expireAfterSeconds``."""
