"""Models of the diffuse sky: how DHI is shared by dome, circumsolar disc and horizon, and the horizon as a source.

In: a Weather; surface normals. Out: SkyParts; rays towards the horizon. Read first: sky_models.py.
"""
