"""The triangulated scene: surfaces, their kinds, and the site on Earth.

In: a City and its ground. Out: a Scene. Read first: scene.py, then build_scene.py.
"""
