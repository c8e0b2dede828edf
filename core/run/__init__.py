"""The application, for the command line, Python and Blender alike: the chain, runs of a whole city
or of its tiles on many machines (Dask), further rounds, variants, and what a run writes.

In: paths and a Request; a log. Out: results in a folder that is whole or not there. Read first:
study.py, which is the chain, then simulate.py and trace_tiles.py.
"""

DOORS = (
    "make_world.WorldSettings",
    "make_world.make_world",
    "run_log.RunLog",
    "run_log.print_output",
    "simulate.recompute",
    "simulate.simulate",
    "simulate.trace_city",
    "study.check_settings",
    "study.check_tracing",
    "study.compute_energy",
    "study.make_scene",
    "study.prepare_study",
    "study.read_buildings",
    "study.read_scene",
    "study.read_year",
    "trace_tiles.ClusterSettings",
    "variant.Change",
    "variant.errors_of_change",
    "variant.make_variant",
    "variant.trace_edit",
    "write_run.Output",
)
