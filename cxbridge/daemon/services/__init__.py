"""The long-lived processes besides the daemon: record, replay, gateway, executors."""
