"""The world: buildings, physics, lidar, odometry and faults. Knows nothing of mapping or exploring."""
