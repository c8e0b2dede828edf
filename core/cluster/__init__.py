"""Cities in tiles, and worlds in parts, as tasks for one process or for many machines (Dask).

In: a Scene with its plan and suns, or environments and weather. Out: one Transfer, or one World, as
from a single run. Read first: trace_tiles.py.
"""

DOORS = (
    "run_tasks.check_cluster",
    "run_tasks.drop_kept",
    "run_tasks.keeping",
    "run_tasks.kept_beside",
    "trace_part.bound_hours",
    "trace_tiles.ClusterSettings",
    "trace_tiles.check_cluster_settings",
    "trace_tiles.plan_tiles",
    "trace_tiles.trace_tiles",
    "world_tasks.compute_in_tasks",
)
