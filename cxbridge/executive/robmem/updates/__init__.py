"""Updates of the embedded store: operators on paths, applied to documents."""
