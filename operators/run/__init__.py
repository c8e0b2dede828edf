"""Run: the steps that a user takes, from files or own meshes to full load hours: import, classify,
trace, weigh, edit, update, export.

In: files, objects, a Request. Out: a Session with all that was found, results on the faces, files.
Read first: `solar_city`, `import_city`, `trace_city`.
"""

DOORS = (
    "compute_energy.read_best",
    "import_city.IMPORT_LABEL",
    "plan_trace.DAYS",
    "plan_trace.ITEMS",
    "plan_trace.describe_prediction",
    "plan_trace.find_preset",
    "plan_trace.read_plan",
    "watch_edits.HANDLERS",
    "watch_edits.TICK",
    "watch_edits.watch",
)
