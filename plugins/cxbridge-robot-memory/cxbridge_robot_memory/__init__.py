"""The robot memory: documents in collections, change events, mutexes.

:mod:`memory` is the entry point of applications, :mod:`store` the interface of stores. :mod:`embedded` is the
store in this process, :mod:`mongodb` the store on MongoDB (extra ``mongodb``); docs/several-agents.md.
"""
