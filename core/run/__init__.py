"""The application, for the command line, Python and Blender alike: runs, further rounds, variants,
comparisons, and what a run writes.

In: paths and a Request; a log. Out: results in a folder that is whole or not there. Read first:
simulate.py.
"""

DOORS = (
    "compare.compare",
    "compare.describe_comparison",
    "run_log.RunLog",
    "run_log.print_output",
    "simulate.recompute",
    "simulate.simulate",
    "simulate.trace_city",
    "variant.Change",
    "variant.errors_of_change",
    "variant.make_variant",
    "variant.trace_edit",
    "write_run.Output",
    "write_run.draw_city",
)
