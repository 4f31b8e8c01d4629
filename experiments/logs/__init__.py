"""Recorded logs as observations: CARMEN text and ROS bags; pose graphs as g2o files."""
