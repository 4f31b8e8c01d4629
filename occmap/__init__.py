"""The robot's mind: mapping, exploring and localising in a building it has never seen.

Needs NumPy, SciPy, Numba, QDLDL, and PyYAML for map files; knows nothing of simulators, recorders or the
truth.
"""
