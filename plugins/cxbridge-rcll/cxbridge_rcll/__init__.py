"""Games of the RoboCup Logistics League on the virtual clock: referee, machines and robots in one run."""
