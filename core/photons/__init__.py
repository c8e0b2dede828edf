"""Photons: the forward estimator (Bredemeier et al., Eq. 1 to 4), and the specular pass beside
gather.

In: a Scene and Suns. Out: a Transfer. Read first: trace_forward.py, specular_light.py.
"""

DOORS = (
    "specular_light.specular_of",
    "specular_light.trace_hybrid",
    "trace_forward.trace_forward",
)
