"""What runs while data comes in: gates, tracker, wrench and running estimate, free of ROS."""
