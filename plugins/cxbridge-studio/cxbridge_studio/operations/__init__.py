"""The operations of the studio: the debugger, CLIPS environments, their facts, features and loggers."""
