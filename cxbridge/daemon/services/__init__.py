"""The long-lived processes other than the daemon: record, replay, gateway, executors."""
