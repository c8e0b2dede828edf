"""Random numbers and point sets: where rays start and which way they go.

In: keys and counts. Out: Sobol points, barycentric weights, cosine-weighted directions. Read first: sample_points.py.
"""
