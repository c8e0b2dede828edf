"""Compile loops in a second process while the first one reads the city.

In: `loops.txt`, the loops that a run calls. Out: numba's cache on disk. Read first: compile_ahead.py.
"""
