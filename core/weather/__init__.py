"""Weather of one or more years: readers for all formats, and checks.

In: a file, or a place for the clear sky. Out: a Weather in UTC. Read first: read_weather.py.
"""
