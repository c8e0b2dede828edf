"""The triangulated scene with its surfaces, their kinds and its site on Earth.

In: a City and its ground. Out: a Scene. Read first: scene.py, then build_scene.py.
"""
