"""Recorded logs as streams of observations, and pose graphs as files."""
