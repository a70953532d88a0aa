"""The robot memory: documents in collections, change events, mutexes.

:mod:`component` has the robot memory of a run, :mod:`feature` the functions for rules, :mod:`store` the
interface of stores. :mod:`embedded` is the store in this process, :mod:`mongodb` the store on MongoDB (extra
``mongodb``). See docs/several-agents.md.
"""
