"""Weather of one or more years: readers of every format, and checks of what they read.

In: a file, or a place for the clear sky. Out: a Weather in UTC. Read first: read_weather.py.
"""
