"""Skills that are only simulated: durations and outcomes by estimators, faults on purpose."""
