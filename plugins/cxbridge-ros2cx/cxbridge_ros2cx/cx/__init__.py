"""Today's CLIPS Executive for ROS 2 (carologistics/clips_executive): its node, its plug-ins, its agents."""
