"""Trees: crowns that let part of the light through, and opaque trunks.

In: trees of a City. Out: Crowns, and a Canopy that attenuates rays. Read first: canopy.py.
"""
