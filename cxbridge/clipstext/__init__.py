"""Parsing and printing of CLIPS text: source files, printed facts, values. The parsers need no CLIPS.

:mod:`.syntax` parses source text, :mod:`.facts` parses printed facts, in which strings are not escaped,
:mod:`.values` has the values of both and their printer, and :mod:`.goal_slots` lists the slots of goals.
"""
