"""The horizon of distant terrain: how high it rises in each direction, and which sky and suns it hides.

In: a file with heights or with angles, and a Scene. Out: a TerrainHorizon. Read first: horizon.py.
"""
