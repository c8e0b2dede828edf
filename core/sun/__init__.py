"""The sun: where it stands, which positions are traced, and which of them stand for an hour.

In: times and a place. Out: Suns, SunMatch, SkyTriangles. Read first: solar_position.py, then
sun_sampling.py.
"""
