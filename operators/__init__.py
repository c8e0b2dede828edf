"""Blender operators, and the only bridge between bpy and numpy: read settings, call core, write
back.

In: the user's scene, settings and files. Out: results on faces, in tables, pictures, files. Read
first: `solar_city`. Rooms by what a user does: city, light, result, picture, edits. Beside them
stands what all of them share.
"""
