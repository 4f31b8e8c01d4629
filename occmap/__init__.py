"""The robot's mind: mapping, exploring and localising in a building it has never seen.

Knows numpy, scipy and numba; nothing of simulators, recorders or the truth.
"""
