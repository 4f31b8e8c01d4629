"""Recorded logs through a localizer, and what that leaves: experiments.replay."""
