"""Fawkes' REST API, a stream of events and a page over HTTP; see docs/rest.md.

The server works in a thread of its own. What it asks of the executive and the blackboard is done by the main
loop, which :class:`~cxbridge_web.queue.RequestQueue` takes the questions to.
"""
