"""Blender operators, and the only bridge between bpy and numpy: read settings, call core, write
back.

In: the user's scene, settings and files. Out: results on faces, in tables, pictures, files. Read
first: `run.solar_city`. Three rooms: city, show, run; a room may use the ones before it.
"""
