"""Models of the diffuse sky: how DHI is shared by dome, circumsolar disc and horizon, and the traced sources of light.

In: a Weather; surface normals. Out: SkyParts; rays and photons of traced sources. Read first: sky_models.py, then
light_sources.py.
"""
