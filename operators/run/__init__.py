"""Run: the steps that a user takes, from files or own meshes to full load hours: import, classify,
trace, weigh, edit, update, compare, export; and what an edit of a city is.

In: files, objects, a Request. Out: a Session with all that was found, results on the faces, files.
Read first: `solar_city`, `import_city`, `trace_city`, `city_design`.
"""

DOORS = (
    "choose_faces.follow_least_hours",
    "import_city.IMPORT_LABEL",
    "watch_edits.start_watching",
    "watch_edits.stop_watching",
)
