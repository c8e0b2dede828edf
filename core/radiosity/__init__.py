"""The gather estimator: hemisphere rays, shadow rays, and reflections through the matrix of form factors.

In: a Scene and Suns. Out: a Transfer. Read first: trace_gather.py.
"""
