"""The robot memory: documents in collections, changes as events, mutexes.

`memory` is what an application holds; `store` says what a store can do, `embedded` is the one in this
process, `mongo` the one on MongoDB. See docs/robot-memory.md. Nothing is imported here: `bson` takes its
time, and most runs have no robot memory.
"""
