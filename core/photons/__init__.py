"""The forward estimator: photons from sun, sky and far ground (Bredemeier et al., Eq. 1 to 4).

In: a Scene and Suns. Out: a Transfer. Read first: trace_forward.py.
"""
