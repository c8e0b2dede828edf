"""Run: the steps that a user takes, from files or own meshes to full load hours: import, classify,
trace, weigh, edit, update, compare, export; and what an edit of a city is.

In: files, objects, a Request. Out: a Session with all that was found, results on the faces, files.
Read first: `solar_city`, `import_city`, `trace_city`, `city_design`.
"""

DOORS = (
    "choose_faces.follow_least_hours",
    "compare_results.find_variants",
    "compare_results.percent_of",
    "compare_results.read_comparison",
    "compare_results.show_end",
    "compare_results.write_energy",
    "compare_results.write_row",
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
