"""Fawkes' REST API, a stream of events and a page over HTTP; see docs/rest.md.

The server works in a thread. Its requests to the executive and the blackboard are carried out by the main
loop, which :class:`~cxbridge_web.queue.RequestQueue` hands the questions to.
"""

from typing import Final

FOXGLOVE_PORT: Final = 8765
"""The port at which Foxglove looks for a server when its user names no port."""
