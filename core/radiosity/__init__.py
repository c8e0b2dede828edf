"""The gather estimator: hemisphere rays, shadow rays, and reflections by the matrix of form factors.

In: a Scene and Suns. Out: a Transfer. Read first: trace_gather.py.
"""
