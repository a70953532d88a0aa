"""Coverage of an agent by recorded runs: rules, goal classes, actions and skills."""
