"""Sun positions: where the sun stands, which positions are traced, and which of them stands for each hour.

In: times and a place. Out: Suns, SunMatch. Read first: choose_suns.py.
"""
