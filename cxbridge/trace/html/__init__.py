"""Pages about recorded runs: one file each, that needs nothing from anywhere else."""
