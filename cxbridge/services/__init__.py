"""The long-lived processes beside the daemon: record, replay, gateway, executors."""
