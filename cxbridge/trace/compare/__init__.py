"""Comparison of recorded runs; docs/comparing.md defines equality.

:func:`.runs.compare_runs` chooses a comparison by level and order: :mod:`.total` compares events at equal
positions, :mod:`.partial` the transitions of each goal, and :mod:`.sequences` the states of each Skiller or
interface. A is the compared run, B a run with which it is compared. Names are ids that differ between runs,
such as ``gen12`` (:mod:`.names`).
"""
