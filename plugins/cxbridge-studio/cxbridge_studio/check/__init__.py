"""Checks an agent without running it: its configuration, CLIPS files, PDDL domain, action mapping and skills.

:mod:`.agent` loads a spec's files and lets CLIPS read them, :mod:`.checks` has the checks, one file each,
:mod:`.findings` has their results, and :mod:`.formats` prints them.
"""
