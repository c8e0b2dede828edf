"""Sun positions: where the sun is, which positions are traced, and which of these represents each hour.

In: times and a place. Out: Suns, SunMatch. Read first: choose_suns.py.
"""
