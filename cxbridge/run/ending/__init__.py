"""Why a run does not begin, or ends before its time: a broken agent, a run in which nothing can happen."""
