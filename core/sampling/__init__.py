"""Random numbers and low-discrepancy point sets for ray origins and directions.

In: keys and counts. Out: Sobol points, barycentric weights, cosine-weighted directions. Read first: sample_points.py.
"""
