"""Cities in tiles, and worlds in parts, as tasks for one process or for many machines (Dask).

In: a Scene with its plan and suns, or environments and weather. Out: one Transfer, or one World, as
from a single run. Read first: trace_tiles.py.
"""
