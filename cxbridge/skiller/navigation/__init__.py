"""Navigation of simulated robots: a navgraph, a base that turns and drives, and the executor ``Move``."""

from __future__ import annotations

from cxbridge.skiller.navigation.move import Move as Move
