"""Fawkes' REST API, a stream of events and a web page over HTTP; see docs/rest.md.

The server runs in a thread. The main loop carries out its requests to the executive and the blackboard, which
:class:`~cxbridge_web.request_queue.RequestQueue` passes on.
"""

from typing import Final

FOXGLOVE_PORT: Final = 8765  # the port at which Foxglove connects by default
