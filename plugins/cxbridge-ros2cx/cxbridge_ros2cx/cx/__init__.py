"""Today's CLIPS Executive for ROS 2 (carologistics/clips_executive): its node, plug-ins and agents."""
