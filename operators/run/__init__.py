"""Run: the steps that a user takes, from files or own meshes to full load hours: import, classify,
trace, weigh, edit, update, export.

In: files, objects, a Request. Out: a Session with all that was found, results on the faces, files.
Read first: `solar_city`, `import_city`, `trace_city`.
"""
