"""Light on the surfaces of a city: what rays of patches meet, and the radiosity equation solved
with it.

In: scene, suns, plan of effects. Out: the Transfer, free of weather. Read first: trace_gather.py.
"""
