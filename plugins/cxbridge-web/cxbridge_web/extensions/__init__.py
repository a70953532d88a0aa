"""The endpoints of cxbridge besides operations: status, rules, agenda, interfaces, commands.

A handler reads the executive and the blackboard in the main loop. The reading of files and the models of long
lists follow in the server's thread, in ``finish``.
"""
