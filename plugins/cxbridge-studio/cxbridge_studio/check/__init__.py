"""Static checks of an agent: configuration, CLIPS files, PDDL domain, action mapping and skills.

:mod:`.agent` loads the files of a spec into CLIPS without running them. :mod:`.checks` has one module per
group of checks, :mod:`.findings` their results, and :mod:`.formats` the output formats.
"""
