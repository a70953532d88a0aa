"""The robot memory: documents in collections, changes as events, mutexes.

`memory` is the entry of an application; `store` is the interface of stores, `embedded` the one in this
process, `mongodb` the one on MongoDB (the extra `mongodb`). See docs/robot-memory.md.
"""
