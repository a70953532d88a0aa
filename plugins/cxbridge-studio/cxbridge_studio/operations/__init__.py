"""The operations of the studio: the debugger, CLIPS environments, their facts and features."""
