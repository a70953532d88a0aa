"""Reading and printing CLIPS text: source files, printed facts, values. It needs no CLIPS.

:mod:`.syntax` reads what people write, :mod:`.facts` reads what CLIPS prints (in which strings are not
escaped), and :mod:`.values` has the values of both, with their one printer.
"""
