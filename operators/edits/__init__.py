"""Edits: what the user changes in Blender: meshes taken as buildings, edited meshes, several
cities, opened files.

In: objects of the Blender scene.
Out: a City, marks on cities whose results are stale.
Read first: `take_meshes`.
"""
