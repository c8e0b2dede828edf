"""City: what a city is in Blender: objects, their face attributes, its session, the settings; and
how a step runs beside the window.

In: objects and settings of the Blender scene. Out: a Session with City, Scene and Transfer, a
Request, marks on cities whose results are stale. Read first: `session`, `run_step`.
"""
