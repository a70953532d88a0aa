"""Checks an agent without running it: its configuration, CLIPS files, PDDL domain, action mapping and skills.

:mod:`.agent` finds what a spec loads and lets CLIPS read it, :mod:`.checks` has the checks, one file each,
:mod:`.findings` is what they find, and :mod:`.formats` prints it.
"""
